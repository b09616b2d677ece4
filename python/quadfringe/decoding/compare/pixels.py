"""The difference of two shapes of one camera, pixel by pixel, and what it may depend on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape, Truth
from quadfringe.decoding.compare import params
from quadfringe.decoding.compare.deviations import bands_of, deviations_of
from quadfringe.decoding.compare.profiles import profiles_of
from quadfringe.decoding.compare.results import ShapeComparison
from quadfringe.errors import InputError

__all__ = [
    "Pair",
    "combined_uncertainty",
    "compare_pixels",
    "fringe_period_px_of",
    "pair_of",
    "slopes",
    "surface_angle_deg",
    "uncertainty_of",
]

Map = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Pair:
    """Two shapes on one grid, maps (H, W): columns, px, depths, mm, or None, and where they are known and count."""

    a: Shape
    b: Shape | Truth
    column_a_px: Map
    column_b_px: Map
    period_px: float
    edge: Mask
    wrong_order: Mask
    judged: Mask  # whether the order is right is known
    returned_a: Mask
    returned_b: Mask

    @property
    def counted(self) -> Mask:
        """Pixels that both return, away from edges."""
        return np.asarray(self.returned_a & self.returned_b & ~self.edge)

    @property
    def right(self) -> Mask:
        """Counted pixels with the same order in both."""
        return np.asarray(self.counted & ~self.wrong_order)

    @property
    def fringe_px(self) -> float:
        """The fringe period in camera pixels, along the direction in which it is shortest; 20 without fringes."""
        slope = np.hypot(*slopes(self.column_b_px))
        known = slope[np.isfinite(slope)]
        rate = float(np.median(known)) / self.period_px if known.size else 0.0
        return 1 / rate if rate > 1e-4 else 20.0


def fringe_period_px_of(shape: Shape) -> float:
    """Give the width of a fringe in columns of the projector, from phase and column of a shape; NaN if it is empty."""
    known = np.isfinite(shape.column_px) & (shape.phase_rad > np.pi)
    if not known.any():
        return float("nan")
    return float(np.median(2 * np.pi * shape.column_px[known].astype(np.float64) / shape.phase_rad[known]))


def pair_of(a: Shape, b: Shape | Truth, period_px: float) -> Pair:
    """Put two shapes of one camera on one grid; raises `InputError` for unequal sizes."""
    if a.column_px.shape != b.column_px.shape:
        (rows, columns), (other_rows, other_columns) = a.column_px.shape, b.column_px.shape
        raise InputError(
            f"compare: expected two shapes of one camera, got {columns} x {rows} and {other_columns} x {other_rows} "
            "pixels; for shapes of different cameras align them: align=True, or --align"
        )
    if not period_px > 0 and isinstance(b, Shape):
        period_px = fringe_period_px_of(b)
    column_a, column_b = a.column_px.astype(np.float64), b.column_px.astype(np.float64)
    judged = a.returned  # the truth knows of every pixel whether it is lit
    if isinstance(b, Truth):
        returned_b, edge = np.isfinite(column_b) & ~b.shadow, b.edge
    else:
        returned_b, edge, judged = b.returned, _edges(column_b, period_px), a.returned & b.returned
    wrong = judged & ~(np.abs(column_a - column_b) < period_px / 2)
    return Pair(a, b, column_a, column_b, period_px, edge, wrong, judged, a.returned, returned_b)


def compare_pixels(pair: Pair) -> ShapeComparison:
    """Give the comparison of a pair, without causes."""
    a, b = pair.a, pair.b
    depth_a, depth_b = a.depth_mm, b.depth_mm
    radians = 2 * np.pi / pair.period_px * (pair.column_a_px - pair.column_b_px)
    millimetres = None if depth_a is None or depth_b is None else depth_a.astype(np.float64) - depth_b
    difference, unit = (radians, "rad") if millimetres is None else (millimetres, "mm")
    sigma = combined_uncertainty(pair, unit)
    counted = pair.counted & np.isfinite(difference)
    right = counted & ~pair.wrong_order
    either = int((pair.returned_a | pair.returned_b).sum())
    return ShapeComparison(
        difference_mm=None if millimetres is None else millimetres.astype(np.float32),
        difference_rad=radians.astype(np.float32),
        wrong_order=pair.wrong_order,
        edge=pair.edge,
        overall=deviations_of(difference, counted, sigma, unit),
        right=deviations_of(difference, right, sigma, unit),
        bands=bands_of(difference, right, 0.187 * params.CUT_OFF_PERIODS * pair.fringe_px),
        returned_percent=_percent(pair.returned_a & pair.returned_b, int(pair.returned_b.sum())),
        both_percent=_percent(pair.returned_a & pair.returned_b, either),
        only_a_percent=_percent(pair.returned_a & ~pair.returned_b, either),
        only_b_percent=_percent(~pair.returned_a & pair.returned_b, either),
        wrong_order_percent=_percent(pair.wrong_order, int(pair.judged.sum())),
        profiles=profiles_of(difference, right, quantities_of(pair)),
    )


def combined_uncertainty(pair: Pair, unit: str) -> Map | None:
    """Give the combined standard uncertainty of a difference (D1), (H, W) in `unit`; None when A states none."""
    parts = [uncertainty_of(shape, unit, pair.period_px) for shape in (pair.a, pair.b) if isinstance(shape, Shape)]
    if any(part is None for part in parts):
        return None
    variance: Map = np.zeros(pair.edge.shape)
    for part in parts:
        variance = variance + (0.0 if part is None else part**2)
    return np.asarray(np.sqrt(variance))


def uncertainty_of(shape: Shape, unit: str, period_px: float) -> Map | None:
    """Give the stated uncertainty; that of a depth becomes one of phase by the slope of the depth over the phase."""
    if unit == "mm" or shape.uncertainty_rad is not None:
        sigma = shape.uncertainty_mm if unit == "mm" else shape.uncertainty_rad
        return None if sigma is None else sigma.astype(np.float64)
    if shape.uncertainty_mm is None or shape.calibration is None:
        return None
    from quadfringe import _core
    from quadfringe.data import core_device

    devices = core_device(shape.calibration.camera), core_device(shape.calibration.projector)
    step_px = np.float32(0.5)
    near, far = (_core.xyz_from_column(shape.column_px + s * step_px, *devices)[..., 2] for s in (-1, 1))
    mm_per_px = np.abs(far.astype(np.float64) - near) / (2 * step_px)
    return np.asarray(2 * np.pi / period_px * shape.uncertainty_mm / np.maximum(mm_per_px, 1e-9))


def quantities_of(pair: Pair) -> dict[str, tuple[str, Map]]:
    """Give what a difference may depend on, (unit, map) by name."""
    rows, columns = pair.edge.shape
    y, x = np.mgrid[:rows, :columns].astype(np.float64)
    found = {
        "modulation": ("share of full scale", pair.a.modulation.astype(np.float64)),
        "fringe phase": ("rad", np.mod(2 * np.pi / pair.period_px * pair.column_b_px, 2 * np.pi)),
        "image column": ("px", x),
        "image row": ("px", y),
    }
    if pair.a.albedo is not None:
        # Without an infrared channel its albedo is NaN everywhere.
        count = 3 if np.isnan(pair.a.albedo[..., 3]).all() else 4
        found["albedo"] = ("share of full scale", pair.a.albedo[..., :count].mean(axis=2, dtype=np.float64))
    points = pair.b.xyz_mm if pair.b.xyz_mm is not None else pair.a.xyz_mm
    if points is not None:
        found["surface angle"] = ("degrees from the line of sight", surface_angle_deg(points))
    return found


def slopes(values: Map) -> tuple[Map, Map]:
    """Give the slopes of a map (H, W) along x and along y, per px, over a few px; NaN at gaps."""
    half = params.SLOPE_PX // 2
    along_x, along_y = np.full(values.shape, np.nan), np.full(values.shape, np.nan)
    along_x[:, half:-half] = (values[:, 2 * half :] - values[:, : -2 * half]) / (2 * half)
    along_y[half:-half] = (values[2 * half :] - values[: -2 * half]) / (2 * half)
    return along_x, along_y


def surface_angle_deg(xyz_mm: NDArray[np.floating]) -> Map:
    """Give the angle between the normal of a surface (H, W, 3) and the line of sight, (H, W), degrees."""
    points = xyz_mm.astype(np.float64)
    along = [np.stack(parts, axis=-1) for parts in zip(*(slopes(points[..., i]) for i in range(3)), strict=True)]
    normal = np.cross(along[0], along[1])
    lengths = np.linalg.norm(normal, axis=-1) * np.linalg.norm(points, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.abs(np.sum(normal * points, axis=-1)) / lengths
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, 0, 1))))


def _edges(column_px: Map, period_px: float) -> Mask:
    """Mark pixels near a step of half a fringe or more between neighbours."""
    import cv2

    step = np.zeros(column_px.shape, np.uint8)
    for axis in (0, 1):
        jump = np.abs(np.diff(column_px, axis=axis)) >= period_px / 2
        before = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        step[before] |= jump
    side = 2 * params.EDGE_PX + 1
    return np.asarray(cv2.dilate(step, np.ones((side, side), np.uint8)), bool)


def _percent(part: Mask, whole: int) -> float:
    return 100.0 * int(part.sum()) / whole if whole else float("nan")
