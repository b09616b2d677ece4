"""A projector as an inverse camera: the projector pixel that lights each point of a board, from phase maps.

For each pose, the projector shows N-step fringes along its columns and along its rows, each at three fringe numbers.
The phases give the projector column and row that light each camera pixel; a smooth fit around the image of a board
point gives the projector pixel of that point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration._params import (
    FIT_RADIUS,
    LIT_SHARE_MIN,
    MODULATION_MIN,
    ORDER_MARGIN_MIN,
    PRINT_EDGE,
    SATURATED,
)
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


@dataclass(frozen=True)
class StepPlan:
    """The images of each pose: `steps` equal phase shifts at three fringe numbers, along columns and along rows.

    With eight steps, harmonics of the response (gamma) up to the sixth do not affect the phase. `size_px` is (columns,
    rows) of the projector. Raises `InputError` for fewer than four steps, and ValueError for fringe numbers that are
    ambiguous over the projector.
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
        """Return the phase shift of a step, rad."""
        return 2 * np.pi * step / self.steps


@dataclass(frozen=True)
class ProjectorMap:
    """The projector position that lights each camera pixel: `column_px`, `row_px` (H, W) float32, NaN without data.

    `modulation` is the fringe amplitude and `background` the mean of all images, shares of full scale. The background
    shows the scene without fringes at low noise; boards are detected in it. `size_px` is (columns, rows).
    """

    column_px: Map
    row_px: Map
    modulation: Map
    background: Map
    size_px: tuple[int, int]


@dataclass(frozen=True)
class ProjectorPoints:
    """Projector pixels of board points: `points_px` (n, 2) float64, NaN where a point is not lit.

    `slope` (n, 2, 2) is the change of the projector pixel per camera pixel; it propagates errors of the camera point
    to the projector pixel. `ids` (n,) are indices in `target.points_mm`; `size_px` is (columns, rows) of the projector.
    """

    points_px: NDArray[np.float64]
    slope: NDArray[np.float64]
    ids: NDArray[np.intp]
    size_px: tuple[int, int]


def step_image(plan: StepPlan, axis: Axis, frequency: int, step: int) -> Map:
    """Return the projected image, (rows, columns) float32, linear light 0 to 1, sampled at the mirror positions."""
    number, shift = plan.fringes.numbers[frequency], plan.shift_rad(step)
    return _core.step_pattern(number, shift, *plan.size_px, axis=axis, layout=plan.fringes.layout)


def projector_map(columns: Sequence[Map], rows: Sequence[Map], plan: StepPlan) -> ProjectorMap:
    """Compute the map of one pose from three stacks per direction, (steps, H, W) float32, shares of full scale.

    Raises `InputError` for missing stacks or steps and for mixed image sizes.
    """
    found = {axis: position_map(stacks, plan, axis) for axis, stacks in zip(AXES, (columns, rows), strict=True)}
    return joined(found["columns"], found["rows"], plan)


@dataclass(frozen=True)
class Positions:
    """Column or row that lights each camera pixel, (H, W) px, NaN without data, with modulation and background."""

    position_px: Map
    modulation: Map
    background: Map


def joined(columns: Positions, rows: Positions, plan: StepPlan) -> ProjectorMap:
    """Combine the positions along columns and rows; raises `InputError` for different image sizes."""
    if columns.position_px.shape != rows.position_px.shape:
        raise InputError(
            f"fringes along columns have images of {columns.position_px.shape}, fringes along rows of "
            f"{rows.position_px.shape}; all images of a calibration must have one size"
        )
    dark = np.isnan(columns.position_px) | np.isnan(rows.position_px)
    column_px, row_px = (np.where(dark, np.float32(np.nan), p.position_px) for p in (columns, rows))
    modulation = np.minimum(columns.modulation, rows.modulation)
    return ProjectorMap(column_px, row_px, modulation, 0.5 * (columns.background + rows.background), plan.size_px)


def position_map(stacks: Sequence[Map], plan: StepPlan, axis: Axis) -> Positions:
    """Compute the column or row that lights each pixel from three stacks (steps, H, W), shares of full scale.

    The beat ladder (S4) gives the fringe orders; the position is the mean of the three phases weighted by precision,
    that is by the square of the fringe number.
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
    unlit = (modulation < MODULATION_MIN) | (margin < ORDER_MARGIN_MIN) | saturated
    position[unlit] = np.nan
    return Positions(position.astype(np.float32), modulation, np.mean(backgrounds, axis=0, dtype=np.float32))


def _check_stacks(stacks: Sequence[Map], plan: StepPlan, axis: Axis) -> None:
    if len(stacks) != 3:
        raise InputError(f"fringes along {axis}: expected 3 stacks, one for each fringe number, got {len(stacks)}")
    shapes = [stack.shape for stack in stacks]
    for number, shape in zip(plan.fringes.numbers, shapes, strict=True):
        if len(shape) != 3 or shape[0] != plan.steps:
            have = f"{shape[0]} images" if len(shape) == 3 else f"an array of shape {shape}"
            raise InputError(
                f"{number:g} fringes along {axis}: expected {plan.steps} steps (steps, H, W), got {have}; "
                "capture every step"
            )
        if shape[1:] != shapes[0][1:]:
            raise InputError(
                f"{number:g} fringes along {axis}: images of {shape[2]} x {shape[1]} pixels, the others have "
                f"{shapes[0][2]} x {shapes[0][1]}; all images of a calibration must have one size"
            )


def projector_points(
    lit: ProjectorMap, view: View, radius_px: float | None = None, ir_registration: Affine | None = None
) -> ProjectorPoints:
    """Return the projector pixels of the points of a view, from a quadratic fit to the map around each point.

    A quadratic represents a local homography and the curvature of both lenses. Pixels are weighted by the square of
    their modulation; those at the edges of the print get a hundredth of it. `radius_px` is the radius of the fit, by
    default half the distance of neighbouring points. `ir_registration` is the affine map from visible to infrared
    pixels, for a map of the infrared chip. A point is NaN when less than 40 % of the pixels around it are lit. Raises
    `InputError` when map and view differ in size.
    """
    shape = lit.column_px.shape
    if ir_registration is None and shape != view.size_px[::-1]:
        raise InputError(
            f"the view has {view.size_px[0]} x {view.size_px[1]} pixels, the projector map {shape[1]} x {shape[0]}; "
            "all images of a calibration must have one size"
        )
    affine = np.array(ir_registration if ir_registration is not None else ((1.0, 0, 0), (0, 1.0, 0)))
    places = view.points_px @ affine[:, :2].T + affine[:, 2]
    reach = FIT_RADIUS * _spacing_px(places) if radius_px is None else radius_px
    points, slopes = np.full_like(places, np.nan), np.full((len(places), 2, 2), np.nan)
    weight = _weights(lit.modulation)
    for i, place in enumerate(places):
        fitted = _around(lit, weight, place, reach)
        if fitted is not None:
            points[i], slopes[i] = fitted[:, 0], fitted[:, 1:] @ affine[:, :2]
    return ProjectorPoints(points, slopes, view.ids, lit.size_px)


def _weights(modulation: Map) -> Map:
    """Return the weight of each residual: the modulation, and a tenth of it at the edges of the print.

    A pixel at an edge mixes paper and ink, and its phase is biased towards that of the paper.
    """
    down, right = np.gradient(modulation)
    edge = np.hypot(down, right) > PRINT_EDGE * modulation
    return np.where(edge, np.float32(0.1) * modulation, modulation).astype(np.float32)


def _spacing_px(places: NDArray[np.float64]) -> float:
    apart = np.linalg.norm(places[:, None] - places, axis=2)
    return float(np.median(np.sort(apart, axis=1)[:, 1]))


def _around(lit: ProjectorMap, weights: Map, place: NDArray[np.float64], reach: float) -> NDArray[np.float64] | None:
    """Fit value and slopes (2, 3) of column and row at a place; None where too few pixels are lit."""
    low = np.maximum(np.floor(place - reach).astype(int), 0)
    high = np.ceil(place + reach).astype(int) + 1
    part = (slice(low[1], high[1]), slice(low[0], high[0]))
    seen = np.stack([lit.column_px[part], lit.row_px[part]], axis=2).astype(np.float64)
    rows, columns = seen.shape[:2]
    dx = (low[0] + np.arange(columns) - place[0])[None, :].repeat(rows, axis=0)
    dy = (low[1] + np.arange(rows) - place[1])[:, None].repeat(columns, axis=1)
    inside = (np.hypot(dx, dy) <= reach) & np.isfinite(seen[..., 0])
    if inside.sum() < LIT_SHARE_MIN * np.pi * reach**2:
        return None
    x, y, values = dx[inside] / reach, dy[inside] / reach, seen[inside]
    weight = weights[part][inside].astype(np.float64)
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    for _ in range(2):
        fitted, *_ = np.linalg.lstsq(terms * weight[:, None], values * weight[:, None], rcond=None)
        missed = np.linalg.norm(values - terms @ fitted, axis=1)
        weight = np.where(missed > 5 * np.median(missed) + 1e-6, 0.0, weight)
    return np.asarray(np.concatenate([fitted[:1], fitted[1:3] / reach]).T, np.float64)
