"""A projector as an inverse camera: the projector pixel that lights each point of a board, by phase.

For each pose the projector shows N-step fringes that count over its columns and over its rows, each at three fringe
numbers. The phases give every camera pixel the projector column and row that light it, and a smooth fit around the
image of a board point gives the projector pixel of that point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.detect import View
from quadfringe.config import Affine, Fringes
from quadfringe.errors import InputError

__all__ = [
    "AXES",
    "Positions",
    "ProjectorMap",
    "ProjectorPoints",
    "StepPlan",
    "joined",
    "position_map",
    "projector_map",
    "projector_points",
    "step_image",
]

Map = NDArray[np.float32]
Axis = Literal["columns", "rows"]
AXES: tuple[Axis, Axis] = ("columns", "rows")
MODULATION_MIN = 0.02  # share of full scale
MARGIN_MIN = 0.3  # of the fringe orders
SATURATED = 0.999  # share of full scale
REACH = 0.5  # of the distance to the nearest point: how far around a point the fit looks
SHARE_MIN = 0.4  # of the pixels around a point that must be lit
EDGE = 0.06  # change of the modulation from pixel to pixel, as a share of it, at which the edge of a print begins


@dataclass(frozen=True)
class StepPlan:
    """What a projector shows at each pose: `steps` equal shifts of three fringe numbers, over columns and over rows.

    Eight steps leave the phase alone for a response (gamma) whose harmonics end at the sixth.
    Raises `InputError` for fewer than four steps and ValueError for fringes that do not cover the projector.
    """

    fringes: Fringes = Fringes()
    steps: int = 8
    size_px: tuple[int, int] = (912, 1140)

    def __post_init__(self) -> None:
        if self.steps < 4:
            raise InputError(f"steps: expected at least 4, got {self.steps}")
        for size in self.size_px:
            _core.check_code(self.fringes.numbers, size)

    def shift_rad(self, step: int) -> float:
        """Shift of a step."""
        return 2 * np.pi * step / self.steps


@dataclass(frozen=True)
class ProjectorMap:
    """Where each camera pixel is lit from: `column_px`, `row_px` (H, W) float32, NaN where the projector is not seen.

    `modulation` is the amplitude of the fringes, `background` the mean of all images, both as shares of full scale:
    the background is the scene without fringes and with little noise, in which boards are looked for.
    """

    column_px: Map
    row_px: Map
    modulation: Map
    background: Map
    size_px: tuple[int, int]


@dataclass(frozen=True)
class ProjectorPoints:
    """Projector pixels of board points: `points_px` (n, 2) float64, NaN where a point is not lit.

    `slope` (n, 2, 2) is the change of the projector pixel per camera pixel, by which an error of the camera's point
    becomes one of the projector's. `ids` (n,) are indices in `target.points_mm`; `size_px` is the projector's size.
    """

    points_px: NDArray[np.float64]
    slope: NDArray[np.float64]
    ids: NDArray[np.intp]
    size_px: tuple[int, int]


def step_image(plan: StepPlan, axis: Axis, frequency: int, step: int) -> Map:
    """Give what the projector shows, (rows, columns) float32, linear light 0 to 1, at the places of its mirrors."""
    number, shift = plan.fringes.numbers[frequency], plan.shift_rad(step)
    return _core.step_pattern(number, shift, *plan.size_px, axis=axis, layout=plan.fringes.layout)


def projector_map(columns: Sequence[Map], rows: Sequence[Map], plan: StepPlan) -> ProjectorMap:
    """Give the map of one pose from its stacks, three for each direction, (steps, H, W) float32 shares of full scale.

    Raises `InputError` for stacks or steps that are missing and for mixed image sizes.
    """
    found = {axis: position_map(stacks, plan, axis) for axis, stacks in zip(AXES, (columns, rows), strict=True)}
    return joined(found["columns"], found["rows"], plan)


@dataclass(frozen=True)
class Positions:
    """Column or row that lights each camera pixel, (H, W), with modulation and background."""

    position_px: Map
    modulation: Map
    background: Map


def joined(columns: Positions, rows: Positions, plan: StepPlan) -> ProjectorMap:
    """Give the map of both directions."""
    if columns.position_px.shape != rows.position_px.shape:
        raise InputError(
            f"fringes over columns were captured at {columns.position_px.shape}, over rows at "
            f"{rows.position_px.shape}; all images of a calibration must have one size"
        )
    dark = np.isnan(columns.position_px) | np.isnan(rows.position_px)
    column_px, row_px = (np.where(dark, np.float32(np.nan), p.position_px) for p in (columns, rows))
    modulation = np.minimum(columns.modulation, rows.modulation)
    return ProjectorMap(column_px, row_px, modulation, 0.5 * (columns.background + rows.background), plan.size_px)


def position_map(stacks: Sequence[Map], plan: StepPlan, axis: Axis) -> Positions:
    """Give the column or row that lights each pixel, from three stacks (steps, H, W).

    The orders come from the three phases together (S4); the position is their mean, each weighted by its precision.
    """
    _check_stacks(stacks, plan, axis)
    size = plan.size_px[AXES.index(axis)]
    numbers = np.array(plan.fringes.numbers)
    found = [_core.n_step(np.ascontiguousarray(stack)) for stack in stacks]
    phases, backgrounds, modulations = ([maps[i] for maps in found] for i in range(3))
    absolute, margin = _core.unwrap(phases[0], phases[1], phases[2], plan.fringes.numbers, size)
    turns = absolute.astype(np.float64) / (2 * np.pi * numbers[0])
    position = np.zeros_like(turns)
    for number, phase in zip(numbers, phases, strict=True):
        seen = phase / (2 * np.pi)
        position += number * (seen + np.rint(turns * number - seen))
    position *= size / np.square(numbers).sum()
    modulation = np.minimum.reduce(modulations)
    saturated = np.logical_or.reduce([stack.max(axis=0) >= SATURATED for stack in stacks])
    unlit = (modulation < MODULATION_MIN) | (margin < MARGIN_MIN) | saturated
    position[unlit] = np.nan
    return Positions(position.astype(np.float32), modulation, np.mean(backgrounds, axis=0, dtype=np.float32))


def _check_stacks(stacks: Sequence[Map], plan: StepPlan, axis: Axis) -> None:
    if len(stacks) != 3:
        raise InputError(f"fringes over {axis}: expected 3 stacks, one for each fringe number, got {len(stacks)}")
    shapes = [stack.shape for stack in stacks]
    for number, shape in zip(plan.fringes.numbers, shapes, strict=True):
        if len(shape) != 3 or shape[0] != plan.steps:
            have = f"{shape[0]} images" if len(shape) == 3 else f"an array of shape {shape}"
            raise InputError(
                f"{number:g} fringes over {axis}: expected {plan.steps} steps (steps, H, W), got {have}; "
                "capture every step"
            )
        if shape[1:] != shapes[0][1:]:
            raise InputError(
                f"{number:g} fringes over {axis}: images of {shape[2]} x {shape[1]} pixels, the others have "
                f"{shapes[0][2]} x {shapes[0][1]}; all images of a calibration must have one size"
            )


def projector_points(
    lit: ProjectorMap, view: View, radius_px: float | None = None, ir_registration: Affine | None = None
) -> ProjectorPoints:
    """Give the projector pixels of the points of a view, by a quadratic fit to the map around each.

    A quadratic holds what a local homography can express, and the curvature of both lenses; pixels count by the square
    of their modulation, those at the edges of the print a hundredth of it. `radius_px` is half the distance of
    neighbouring points when absent. `ir_registration` is the affine map from visible to infrared pixels, for a map of
    the infrared chip. NaN where less than 40 % of the pixels around a point are lit. Raises `InputError` when map and
    view differ in size.
    """
    shape = lit.column_px.shape
    if ir_registration is None and shape != view.size_px[::-1]:
        raise InputError(
            f"the view is {view.size_px[0]} x {view.size_px[1]}, the map {shape[1]} x {shape[0]}; "
            "all images of a calibration must have one size"
        )
    affine = np.array(ir_registration if ir_registration is not None else ((1.0, 0, 0), (0, 1.0, 0)))
    places = view.points_px @ affine[:, :2].T + affine[:, 2]
    reach = REACH * _spacing_px(places) if radius_px is None else radius_px
    points, slopes = np.full_like(places, np.nan), np.full((len(places), 2, 2), np.nan)
    weight = _weights(lit.modulation)
    for i, place in enumerate(places):
        fitted = _around(lit, weight, place, reach)
        if fitted is not None:
            points[i], slopes[i] = fitted[:, 0], fitted[:, 1:] @ affine[:, :2]
    return ProjectorPoints(points, slopes, view.ids, lit.size_px)


def _weights(modulation: Map) -> Map:
    """Give the weight of each pixel: its modulation, a tenth of it at the edges of a print.

    There a pixel sees paper and ink, and its phase is that of the paper beside it.
    """
    down, right = np.gradient(modulation)
    edge = np.hypot(down, right) > EDGE * modulation
    return np.where(edge, np.float32(0.1) * modulation, modulation).astype(np.float32)


def _spacing_px(places: NDArray[np.float64]) -> float:
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    return float(np.median(np.sort(apart, axis=1)[:, 1]))


def _around(lit: ProjectorMap, weights: Map, place: NDArray[np.float64], reach: float) -> NDArray[np.float64] | None:
    """Give value and slopes (2, 3) of column and row at a place; None where too little is lit."""
    low = np.maximum(np.floor(place - reach).astype(int), 0)
    high = np.ceil(place + reach).astype(int) + 1
    part = (slice(low[1], high[1]), slice(low[0], high[0]))
    seen = np.stack([lit.column_px[part], lit.row_px[part]], axis=2).astype(np.float64)
    rows, columns = seen.shape[:2]
    dx = (low[0] + np.arange(columns) - place[0])[None, :].repeat(rows, axis=0)
    dy = (low[1] + np.arange(rows) - place[1])[:, None].repeat(columns, axis=1)
    inside = (np.hypot(dx, dy) <= reach) & np.isfinite(seen[..., 0])
    if inside.sum() < SHARE_MIN * np.pi * reach**2:
        return None
    x, y, values = dx[inside] / reach, dy[inside] / reach, seen[inside]
    weight = weights[part][inside].astype(np.float64)
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    for _ in range(2):
        fitted, *_ = np.linalg.lstsq(terms * weight[:, None], values * weight[:, None], rcond=None)
        missed = np.linalg.norm(values - terms @ fitted, axis=1)
        weight = np.where(missed > 5 * np.median(missed) + 1e-6, 0.0, weight)
    return np.asarray(np.concatenate([fitted[:1], fitted[1:3] / reach]).T, np.float64)
