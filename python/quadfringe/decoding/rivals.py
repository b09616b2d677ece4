"""Whether a shot as it is given explains its light clearly better than every other reading of it.

Strong print moves the fringes of each channel by another angle, so that G and IR lie off the phase although all orders
are right (`agreement`). But other readings explain the light still less: channels in another order, other fringe
numbers, shifted infrared. Each is decoded on a band of rows. The measure is the sum of the order margins of the pixels
that pass the tests of the decoder.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import params
from quadfringe.decoding import verdict_params as limits
from quadfringe.decoding._kernel import KernelDecoder
from quadfringe.decoding.column_direction import unusual_direction
from quadfringe.decoding.number_ratios import covers, families
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.plausibility import mirrored
from quadfringe.decoding.readings import band_of, other_readings, rows_of
from quadfringe.decoding.trusted import mean_width_px

__all__ = ["outdoes_rivals"]


def outdoes_rivals(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> bool:
    """Say whether most lit pixels are returned, fringes run forwards, and every other reading explains clearly less.

    Only fringe numbers for red and blue, green and infrared allow the test, and objects of a few fringes.
    """
    plan = decoder.plan
    if not (plan.fringes.infrared and plan.fringes.quadrature):
        return False
    if np.count_nonzero(shape.returned) < limits.STANDING_MIN * np.count_nonzero(np.isfinite(shape.quality)):
        return False
    first, count = band_of(shape)
    part, band = decoder.for_rows(first, count), rows_of(shot, first, count)
    given = part.shape(band)
    narrow = mean_width_px(given.returned) < limits.STANDING_FRINGES_MIN * _period_px(given)
    if narrow or not _forwards(given):
        return False
    most = _explained(given) / limits.CLEARLY_BETTER
    return all(_explained(rival) < most or not _forwards(rival) for rival in _rivals(given, band, part))


def _explained(shape: Shape) -> float:
    """Sum the order margins of the returned pixels."""
    return float(shape.quality[shape.returned].sum())


def _forwards(shape: Shape) -> bool:
    """Say whether projector columns grow as they should: with red and blue exchanged, they run backwards."""
    return (unusual_direction(shape) if shape.calibration is None else mirrored(shape)) is None


def _rivals(given: Shape, band: AnyShot, decoder: KernelDecoder) -> Iterator[Shape]:
    for reading in other_readings(band):
        yield decoder.shape(reading.shot)
    for shift_px in _shifts_px(given, decoder.plan):
        assert band.ir is not None
        shifted = decoder.shape(replace(band, ir=np.roll(band.ir, shift_px, axis=1)))
        if _differs(shifted, given):
            yield shifted
    for numbers in _other_numbers(decoder.plan):
        yield decoder.with_numbers(numbers).shape(band)


def _differs(rival: Shape, given: Shape) -> bool:
    """Say whether orders differ: infrared that is shifted by a small part of its fringe leaves them as they are."""
    both = rival.returned & given.returned
    off = np.abs(rival.phase_rad[both] - given.phase_rad[both]) > np.pi
    return bool(np.count_nonzero(off) > params.WARNED_SHARE * off.size)


def _period_px(shape: Shape) -> float:
    """Give the usual period along the rows, which is at most a row."""
    slope = np.abs(np.diff(shape.phase_rad, axis=1))
    known = slope[np.isfinite(slope)]
    turn = float(np.median(known)) if known.size else 0.0
    return min(2 * np.pi / max(turn, 1e-6), float(shape.returned.shape[1]))


def _shifts_px(given: Shape, plan: Plan) -> list[int]:
    """Give the shifts of infrared that divide one of its fringes evenly."""
    first, *_, third = plan.fringes.numbers
    period_px = _period_px(given) * first / third
    parts = np.arange(1, limits.SHIFTS_OF_A_FRINGE) / limits.SHIFTS_OF_A_FRINGE
    return sorted({round(part * period_px) for part in parts} - {0})


def _other_numbers(plan: Plan) -> list[tuple[float, ...]]:
    """Give the families of fringe numbers, and all three numbers one larger or smaller than those of the plan."""
    next_to = [tuple(number + step for number in plan.fringes.numbers) for step in (-1, 1)]
    return [numbers for numbers in (*families(plan), *next_to) if covers(numbers, plan)]
