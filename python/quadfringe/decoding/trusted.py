"""The part of a shape whose orders can be trusted although those of the whole cannot.

A part is trusted by a test that uses no orders: the three phases have the frequencies of their fringe numbers and
close. Exchanged channels, other fringe numbers, shifted infrared and noise fail it, whatever their order margin.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Reason, Shape
from quadfringe.decoding import params
from quadfringe.decoding.closures import (
    Closure,
    closed_wave,
    closure_of_waves,
    local_mean,
    local_rates,
    waves_of,
)
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.plausibility import BOUNDED
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["is_scattered", "mean_width_px", "take_out", "trusted_part"]

Mask = NDArray[np.bool_]
Map = NDArray[np.float32]
Complex = NDArray[np.complex128]
Box = tuple[slice, slice]


def is_scattered(shape: Shape) -> bool:
    """Say whether fringes with a sure order fill no connected region, as those that noise shows by chance."""
    return not _regions(_sure(shape, params.OBJECT_MARGIN_MIN), _least_pixels(shape))


def trusted_part(shape: Shape, shot: AnyShot, plan: Plan) -> Mask | None:
    """Give the returned pixels, (H, W), whose channels fit the fringe numbers, or None when they are too few.

    Without infrared, and for fringe numbers whose phases do not close, nothing can tell.
    """
    if not (plan.fringes.infrared and plan.fringes.quadrature):
        return None
    light, part = linear_light_of(shot, plan), np.zeros(shape.quality.shape, bool)
    contradicted = np.zeros(shape.quality.shape, bool)
    closures: list[tuple[Closure, Mask]] = []
    for box, inside in _regions(_sure(shape, params.LOCAL_MARGIN_MIN), _least_pixels(shape)):
        # The period is then that of the region, and not that of a pattern on a wall around it.
        waves = waves_of({name: np.ascontiguousarray(image[box]) for name, image in light.items()}, plan)
        if waves is None:
            continue
        fitting = _locally_fitting([wave * inside for wave in waves], shape.phase_rad[box], plan)
        # At the rim of the region, windows hold too little of it to contradict anything.
        contradicted[box] |= ~fitting & (_window(inside, params.CLOSURE_PX) >= params.INNER_SHARE)
        for inner, region in _regions(_mostly(fitting), _least_pixels(shape)):
            closure = closure_of_waves([wave[inner] * region for wave in waves], plan)
            if closure is not None and _whole(region, closure):
                part[box][inner] |= region
                closures.append((closure, region))
    part = _grown(part) & ~contradicted & shape.returned
    return part if np.count_nonzero(part) >= _least_pixels(shape) and _close(closures) else None


def _least_pixels(shape: Shape) -> float:
    """Give the number of pixels from which a region may be trusted."""
    return max(params.REGION_SHARE * shape.quality.size, params.REGION_PX)


def take_out(shape: Shape, rest: Mask) -> None:
    """Make no data of these pixels, in place: their order is doubtful."""
    out = rest & shape.returned
    for values in (getattr(shape, name) for name in BOUNDED):
        if values is not None:
            values[out] = np.nan
    if shape.reason is not None:
        shape.reason[out] = Reason.DOUBTFUL_ORDER


def _sure(shape: Shape, least: float) -> Mask:
    """Find the places that are mostly lit, with at least this margin in the mean."""
    lit = np.isfinite(shape.quality)
    margin = _window(np.nan_to_num(shape.quality)) / np.maximum(_window(lit), 1e-6)
    found: Mask = _mostly(lit) & (margin >= least)
    return found


def _mostly(lit: Mask) -> Mask:
    found: Mask = lit & (_window(lit) >= params.LIT_WINDOW_SHARE)
    return found


def _window(values: NDArray[Any], side_px: int = params.LIT_WINDOW_PX) -> Map:
    import cv2

    means: Map = cv2.boxFilter(values.astype(np.float32), -1, (side_px, side_px), borderType=cv2.BORDER_REPLICATE)
    return means


def _grown(part: Mask) -> Mask:
    """Add the rim that the window of the closure takes away."""
    import cv2

    window = np.ones((params.CLOSURE_PX, params.CLOSURE_PX), np.uint8)
    grown: Mask = cv2.dilate(part.astype(np.uint8), window).astype(bool)
    return grown


def _regions(mask: Mask, least: float) -> list[tuple[Box, Mask]]:
    """Give connected regions of at least so many pixels: the box of each, and which pixels in the box belong to it."""
    import cv2

    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    found = []
    for label, (x, y, width, height, pixels) in enumerate(stats):
        if label and pixels >= least:
            box = np.s_[y : y + height, x : x + width]
            found.append((box, labels[box] == label))
    return found


def _locally_fitting(waves: list[Complex], phase_rad: Map, plan: Plan) -> Mask:
    """Find the pixels where the waves close, and have the frequencies of the plan and the phase of the shape."""
    numbers = plan.fringes.numbers
    closed = closed_wave(waves, plan.fringes.numbers)
    if closed is None:
        return np.zeros(phase_rad.shape, bool)
    off = local_mean(closed, params.CLOSURE_PX)
    fitting: Mask = np.isfinite(phase_rad) & (np.abs(np.angle(off)) < params.LOCAL_CLOSURE_RAD)
    expected_rad = np.nan_to_num(phase_rad).astype(np.float64)
    for wave, number in zip(waves, numbers, strict=True):
        off = local_mean(wave * np.exp(-1j * number / numbers[0] * expected_rad) * fitting, params.CLOSURE_PX)
        fitting &= (wave != 0) & (np.abs(np.angle(off)) < params.LOCAL_OFF_RAD)
    red, *others = local_rates(waves)
    lag = fitting.shape[1] - red.shape[1]
    for rate, number in zip(others, numbers[1:], strict=True):
        # Multiplied out, so that a rate of 0 is no division by it.
        strange = np.abs(rate * numbers[0] / number - red) > params.LOCAL_RATIO_OFF * np.abs(red)
        fitting[:, lag // 2 : lag // 2 + strange.shape[1]] &= ~strange
    return fitting


def _periods(region: Mask, closure: Closure) -> float:
    """Give the mean width of a region in infrared fringes."""
    return mean_width_px(region) / closure.infrared_px


def mean_width_px(region: Mask) -> float:
    """Give the mean width of a region in the rows that it has; 0 if it is empty."""
    return float(region.sum() / max(np.count_nonzero(region.any(axis=1)), 1))


def _whole(region: Mask, closure: Closure) -> bool:
    """Say whether a region is wide enough to tell frequencies, and its infrared is not shifted."""
    return _periods(region, closure) >= params.REGION_PERIODS_MIN and abs(closure.angle.rad) < params.CLOSURE_RAD


def _close(found: list[tuple[Closure, Mask]]) -> bool:
    """Say whether all regions together have the frequencies of the plan: a drift as small as noise explains."""
    if not found:
        return False
    closures, regions = zip(*found, strict=True)
    pixels = [int(region.sum()) for region in regions]
    figures = [(closure.green - 1, closure.infrared - 1, closure.angle.agreement) for closure in closures]
    green, infrared, agreement = np.average(figures, axis=0, weights=pixels)
    off = max(abs(green), abs(infrared))
    drift_rad = 2 * np.pi * off * max(_periods(region, closure) for closure, region in found)
    return bool(
        off < params.RATIO_OFF and drift_rad < params.REGION_DRIFT_RAD and agreement > params.REGION_AGREEMENT_MIN
    )
