"""Amplitude, contrast, harmonics and crosstalk of the fringes of a decoded shot, and drift of the infrared fringes.

With the absolute phase known at every pixel, each channel is a sum of known waves: its fringes, their second harmonic
(a non-linear response) and the fringes of the other channels (crosstalk). Least squares over the whole image gives
their amplitudes; over the image, even 36 and 35 fringes are nearly orthogonal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Device
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.stages import carrier
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["Drift", "Fit", "fit_fringes", "infrared_column", "infrared_drift", "pixels_of"]

Map = NDArray[np.float32]
Real = TypeVar("Real", np.float32, np.float64)
# Checked by pytest tests/test_doctor.py on shots with known defects.
PIXELS_MIN = 5000  # pixels with fringes, below which amplitudes are not estimated
TILE_PX = 96  # side of a tile: several fringes, so that the offset of a tile averages the noise
TILE_SHARE = 0.3  # share of a tile that must carry fringes
TILES_MIN = 2
SHIFT_MAX = 6  # largest order error that is considered, fringes
# Of the tiles: a projector that has moved moves the fringes in all of them, while printed edges move single tiles. A
# larger quantile takes coloured squares for drift: 2.7 px in one tile of twenty, 0.2 px in three quarters of the tiles
# (`python evaluation/diagnosis.py`).
QUANTILE = 0.75


class Stray(NamedTuple):
    """A channel, the channel whose fringes it sees too, and their amplitude relative to the right ones."""

    to: str
    of: str
    share: float


@dataclass(frozen=True)
class Fit:
    """Fringe amplitude of each channel, share of full scale, and the ratio of its second harmonic to the first.

    `contrast` is the amplitude over the mean light: 1 for full fringes, 0 without any. `crosstalk` (4, 4), or (3, 3)
    without infrared, is the amplitude of the fringes of each channel (columns) in each captured channel (rows),
    relative to the fringes of the captured channel itself.
    """

    names: tuple[str, ...]
    amplitude: NDArray[np.float64]
    harmonic: NDArray[np.float64]
    crosstalk: NDArray[np.float64]
    contrast: NDArray[np.float64]

    @property
    def worst_stray(self) -> Stray:
        """The strongest crosstalk."""
        stray = np.abs(self.crosstalk - np.diag(np.diag(self.crosstalk)))
        to, of = np.unravel_index(int(np.argmax(stray)), stray.shape)
        return Stray(self.names[int(to)], self.names[int(of)], float(stray[to, of]))


@dataclass(frozen=True)
class Drift:
    """Offset of the infrared fringes from their expected position, projector px, over tiles of the image.

    `off` is the share of tiles whose orders are all wrong by the same number of whole fringes.
    """

    median_px: float
    worst_px: float
    off: float


def fit_fringes(shot: AnyShot, shape: Shape, plan: Plan) -> Fit | None:
    """Fit the waves of every channel in linear light; None when fewer than 5000 pixels carry fringes."""
    light, backgrounds, inside = _waves(shot, shape, plan)
    if inside.sum() < PIXELS_MIN:
        return None
    phases = _phases(shape, plan, inside)
    if plan.fringes.quadrature:  # blue is a quarter period before red
        first, second, *third = phases
        phases = (first, second, first, *third)
    shown = np.stack([np.cos(phase) for phase in phases], axis=1)
    if plan.fringes.quadrature:
        shown[:, 2] = -np.sin(phases[2])
    names, count = plan.fringes.channels, len(plan.fringes.channels)
    amplitude, harmonic, crosstalk, contrast = np.zeros(count), np.zeros(count), np.zeros((count,) * 2), np.zeros(count)
    for i, name in enumerate(names):
        phase = phases[i]
        twice = np.stack([np.cos(2 * phase), np.sin(2 * phase), np.ones_like(phase)], axis=1)
        wave = light[name][inside] / backgrounds[name][inside] - 1
        found = np.linalg.lstsq(np.hstack([shown, twice]), wave, rcond=None)[0]
        crosstalk[i] = found[:count] / found[i]
        harmonic[i] = float(np.hypot(found[count], found[count + 1]) / abs(found[i]))
        contrast[i] = abs(found[i])
        amplitude[i] = contrast[i] * float(np.median(backgrounds[name][inside]))
    return Fit(names, amplitude, harmonic, crosstalk, contrast)


def infrared_drift(shot: AnyShot, shape: Shape, plan: Plan) -> Drift | None:
    """Compare infrared fringes with the position that the calibration predicts; None without, or with too few tiles.

    Without an infrared projector in the calibration, both projectors count as coaxial. A large misalignment shifts
    every order by the same number of fringes, and the shape still looks plausible; the green fringes, which come from
    the projector of red and blue, then give that number, because their tile mean is good to a hundredth of a fringe.
    """
    if not plan.fringes.infrared:
        return None
    light, backgrounds, inside = _waves(shot, shape, plan)
    width = plan.projector_width_px
    periods = [width / number for number in plan.fringes.numbers]
    column = shape.column_px.astype(float)
    places = (column, column, _expected_ir_column(shape, plan))
    inside = inside & np.isfinite(places[2])
    waves = [light[name] / np.maximum(backgrounds[name], 1e-6) - 1 for name in ("red", "green", "ir")]
    away, shifts = [], []
    for tile in _tiles(inside):
        lit = inside[tile]
        first, second, third = (
            _offset_px(wave[tile][lit], place[tile][lit], period)
            for wave, place, period in zip(waves, places, periods, strict=True)
        )
        shift = _fringes_off(_wrapped(second - first, periods[1]), periods)
        away.append(_wrapped(third - first - shift * periods[0], periods[2]))
        shifts.append(shift)
    if len(away) < TILES_MIN:
        return None
    return Drift(float(np.median(away)), float(np.quantile(np.abs(away), QUANTILE)), _share_off(shifts))


def _share_off(shifts: list[int]) -> float:
    """Give the share of tiles that are off by the same number of fringes; crosstalk and prints push to either side."""
    return max(shifts.count(shift) - shifts.count(-shift) for shift in range(-SHIFT_MAX, SHIFT_MAX + 1)) / len(shifts)


def _tiles(inside: NDArray[np.bool_]) -> list[tuple[slice, slice]]:
    rows, columns = inside.shape
    tiles = [
        (slice(y, y + TILE_PX), slice(x, x + TILE_PX))
        for y in range(0, rows - TILE_PX + 1, TILE_PX)
        for x in range(0, columns - TILE_PX + 1, TILE_PX)
    ]
    return [tile for tile in tiles if inside[tile].mean() >= TILE_SHARE]


def _offset_px(wave: NDArray[np.floating], column: NDArray[np.float64], period: float) -> float:
    """Return the offset of the fringes of a wave from their place, projector px, within half a period."""
    phase = 2 * np.pi * column / period
    design = np.stack([np.cos(phase), -np.sin(phase), np.ones_like(phase)], axis=1)
    cos, sin, _ = np.linalg.lstsq(design, wave, rcond=None)[0]
    return float(np.arctan2(sin, cos)) * period / (2 * np.pi)


def _fringes_off(green_px: float, periods: list[float]) -> int:
    """Return the smallest order error of red and blue, fringes, that explains the offset of green."""
    shifts = sorted(range(-SHIFT_MAX, SHIFT_MAX + 1), key=abs)
    missed = [abs(_wrapped(green_px - shift * periods[0], periods[1])) for shift in shifts]
    close = min(missed) + 0.25 * abs(periods[0] - periods[1])
    return next(shift for shift, miss in zip(shifts, missed, strict=True) if miss <= close)


def _wrapped(offset_px: float, period: float) -> float:
    return (offset_px + period / 2) % period - period / 2


class _Waves(NamedTuple):
    """Linear light and its mean over about a fringe, by channel, and the pixels where all of them are valid."""

    light: dict[str, Map]
    backgrounds: dict[str, Map]
    inside: NDArray[np.bool_]


def _waves(shot: AnyShot, shape: Shape, plan: Plan) -> _Waves:
    """Compute the linear light of a shot and its mean over about a fringe."""
    import cv2

    light = linear_light_of(shot, plan)
    period_px, _ = carrier(np.nan_to_num(light["red"]))
    period_px = period_px if np.isfinite(period_px) else 20.0
    known = shape.returned & np.all([np.isfinite(image) for image in light.values()], axis=0)
    weight = cv2.GaussianBlur(known.astype(np.float32), (0, 0), period_px)
    backgrounds = {}
    for name, image in light.items():
        summed = cv2.GaussianBlur(np.where(known, image, 0).astype(np.float32), (0, 0), period_px)
        backgrounds[name] = summed / np.maximum(weight, 1e-6)
    inside = known & (weight > 0.95) & np.all([b > 0.02 for b in backgrounds.values()], axis=0)
    return _Waves(light, backgrounds, inside)


def _phases(shape: Shape, plan: Plan, inside: NDArray[np.bool_]) -> tuple[NDArray[np.float64], ...]:
    column = shape.column_px.astype(float)
    third = infrared_column(shape, plan) if plan.fringes.infrared else column
    numbers = zip(plan.fringes.numbers, (column, column, third), strict=False)  # there may be two
    return tuple(2 * np.pi * number * seen[inside] / plan.projector_width_px for number, seen in numbers)


def infrared_column(shape: Shape, plan: Plan) -> NDArray[np.float64]:
    """Give the column (H, W) of the plain infrared fringes at each point, as the decoder takes them to lie.

    It is that of the visible projector, unless the shape was decoded with the calibration of both projectors.
    """
    if plan.decode.unwrapping == "pair" and plan.fringes.predeformed_z_mm is None:
        return _expected_ir_column(shape, plan)
    return shape.column_px.astype(float)


def _expected_ir_column(shape: Shape, plan: Plan) -> NDArray[np.float64]:
    """Return the column of the infrared projector that lights each point according to the calibration."""
    calibration = plan.calibration
    if calibration is None or calibration.infrared is None or shape.xyz_mm is None:
        return shape.column_px.astype(float)
    return _columns_px(shape.xyz_mm, calibration.infrared)


def _columns_px(xyz_mm: Map, device: Device) -> NDArray[np.float64]:
    points = np.nan_to_num(xyz_mm.reshape(-1, 3).astype(float), nan=1.0)
    columns = pixels_of(points, device)[:, 0].reshape(xyz_mm.shape[:2])
    return np.where(np.isfinite(xyz_mm[:, :, 2]), columns, np.nan)


def pixels_of(points_mm: NDArray[Real], device: Device) -> NDArray[Real]:
    """Give columns and rows, (..., 2) px, at which a device sees points of the camera frame, (..., 3) mm.

    NaN stays NaN. As cv2.projectPoints, which takes about ten times as long: every decode projects thousands of points.
    """
    kind = points_mm.dtype
    (fx, fy), (cx, cy), (k1, k2, p1, p2, k3) = device.focal_px, device.centre_px, device.distortion
    turn, shift_mm = np.array(device.rotation, kind), np.array(device.translation_mm, kind)
    with np.errstate(all="ignore"):  # points in the plane of the device, and numbers that no lens has
        turned = turn @ np.moveaxis(points_mm, -1, 0).reshape(3, -1) + shift_mm[:, None]
        x, y = turned[:2] / turned[2]
        r2, xy = x * x + y * y, x * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        column = fx * (x * radial + 2 * p1 * xy + p2 * (r2 + 2 * x * x)) + cx
        row = fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * xy) + cy
    return np.stack([column, row], axis=-1).reshape(*points_mm.shape[:-1], 2)
