"""Whether the infrared image lies on the visible one, and the shift that mends it.

A shift along x turns the closure of the three phases by the same angle as a shift by whole fringes more or less. Which
one it is shows on a surface whose fringes are not even: only the right one, undone, makes the phases close everywhere.
An infrared projector that has moved turns the closure too, but phases close no better when the image is moved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot
from quadfringe.decoding import closure_params as limits
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.closures import Closure, Complex, closed_wave, closure_of_waves, in_squares
from quadfringe.decoding.number_ratios import FringeNumbers, agree, strange
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.symptoms import rows_match

__all__ = ["registration", "wrong_order_rad"]


def registration(shot: AnyShot, plan: Plan, closure: Closure | None, *, pure: bool = True) -> Cause | None:
    """Find an infrared image that is shifted from the visible one, and the shift that mends it.

    It is fatal from half the angle of a wrong order on: then orders are wrong, or nearly so. A shift along y leaves
    upright fringes where they are, and does harm at edges only. With crosstalk the channels are not `pure`: it lets the
    closure swing over the field as shifts by whole fringes do, so that these are not looked for.
    """
    if closure is None or not plan.fringes.infrared or not _closes(closure):
        return None
    fits = closure.off < params.RATIO_OFF or _within_errors(closure, plan)
    whole_px = _whole_fringes_px(plan, closure, fits=fits) if pure else None
    if whole_px is None and not fits:
        return None
    turned = abs(closure.angle.rad) > params.CLOSURE_RAD and closure.angle.steady > params.STEADY_MIN
    shifted = turned or whole_px is not None
    columns = whole_px if whole_px is not None else closure.shift_px if turned else 0.0
    rows = rows_match(shot, plan, columns)
    fatal = shifted and (whole_px is not None or abs(closure.angle.rad) > 0.5 * wrong_order_rad(plan.fringes.numbers))
    if turned and whole_px is None and rows is not None and rows.still > rows.moved + params.CORRELATION_MORE:
        return replace(_pair_moved(columns), fatal=fatal)
    if shifted or (rows is not None and abs(rows.shift_px) > params.SHIFT_MIN_PX):
        shift_px = None if rows is None or rows.moved < params.CORRELATION_MIN else rows.shift_px
        return replace(_shifted(columns if shifted else None, shift_px, sure=whole_px is not None), fatal=fatal)
    return None


def wrong_order_rad(numbers: FringeNumbers) -> float:
    """Give the angle by which a wrong order puts the fringes of the third channel off."""
    return 2 * np.pi * (numbers[0] - numbers[2]) / numbers[0]


def _closes(closure: Closure) -> bool:
    """Say whether the phases close by more than noise: nearly so in each place, or by the same angle in all of them."""
    return closure.angle.agreement > params.AGREEMENT_MIN or closure.angle.steady > limits.STEADY_ALONE


def _within_errors(closure: Closure, plan: Plan) -> bool:
    """Say whether the ratios are those of the numbers within their errors, and these small enough to tell anything."""
    told = not strange(closure) and max(closure.errors) < params.RATIO_STRANGE
    return told and agree(plan.fringes.numbers, plan, closure)


@dataclass(frozen=True)
class _Move:
    """A shift of infrared, px, and the closed waves once it is undone, in squares, 0 where unknown, (squares, px)."""

    shift_px: float
    closed: NDArray[Any]

    @property
    def mean(self) -> complex:
        return complex(self.closed.sum() / max(np.count_nonzero(self.closed), 1))

    def longer(self, other: _Move) -> float:
        """Give by how many errors the closure is longer than that of another move, by its squares."""
        both = np.minimum(*(np.count_nonzero(one.closed, axis=1) for one in (self, other)))
        full = both >= limits.SQUARE_SHARE * self.closed.shape[1]
        if np.count_nonzero(full) < limits.SQUARES_MIN:
            return 0.0
        more = self._lengths(full) - other._lengths(full)
        return float(more.mean() / max(more.std(ddof=1) / np.sqrt(more.size), 1e-9))

    def _lengths(self, full: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Give the part of the mean of each square that points along the mean of all."""
        counts = np.count_nonzero(self.closed[full], axis=1)
        along = np.conj(self.mean) / max(abs(self.mean), 1e-9)
        return np.asarray((self.closed[full].sum(axis=1) / counts * along).real, np.float64)


def _whole_fringes_px(plan: Plan, closure: Closure, *, fits: bool) -> float | None:
    """Give the shift of infrared that closes the phases clearly better than the nearest one and than none.

    Where the ratios do not fit the numbers it must close them better than they agree locally, which is the best that
    other numbers can do, and the ratios must then fit.
    """
    base = closed_wave([*closure.waves[:2], np.ones_like(closure.waves[2])], plan.fringes.numbers)
    if base is None or not np.isfinite(closure.shift_px):
        return None
    reach_px = limits.SHIFT_REACH * base.shape[1]
    turns = range(-int(reach_px / closure.infrared_px) - 1, int(reach_px / closure.infrared_px) + 2)
    starts = [closure.shift_px + turn * closure.infrared_px for turn in turns]
    moves = [_refined(closure, base, start) for start in starts if start == closure.shift_px or abs(start) <= reach_px]
    best = max(moves, key=lambda one: abs(one.mean))
    nearest = _refined(closure, base, closure.shift_px)
    still = _undone(closure, base, 0.0)
    if abs(best.shift_px - nearest.shift_px) < 0.5 * closure.infrared_px or abs(best.shift_px) > reach_px:
        return None
    if min(best.longer(nearest), best.longer(still)) < limits.LONGER:
        return None
    if abs(best.mean) < params.STEADY_MIN * closure.angle.agreement:
        return None
    return best.shift_px if fits or _mends(best, plan, closure) else None


def _mends(move: _Move, plan: Plan, closure: Closure) -> bool:
    """Say whether a move explains the ratios better than other numbers: it closes the phases, and then they fit."""
    if abs(move.mean) < closure.angle.agreement:
        return False
    undone = closure_of_waves([*closure.waves[:2], _moved(closure.waves[2], -round(move.shift_px))], plan)
    return undone is not None and agree(plan.fringes.numbers, plan, undone)


def _refined(closure: Closure, base: Complex, shift_px: float) -> _Move:
    """Find the shift next to this one with which the mean of the phases closes."""
    for _ in range(2):
        angle = np.angle(_undone(closure, base, shift_px).mean)
        shift_px = round(shift_px) - float(angle) / (2 * np.pi) * closure.infrared_px
    return _undone(closure, base, shift_px)


def _undone(closure: Closure, base: Complex, shift_px: float) -> _Move:
    closed = base * _moved(closure.waves[2], -round(shift_px))
    return _Move(shift_px, in_squares(closed, limits.RATIO_SQUARE_PX))


def _moved(wave: Complex, columns: int) -> Complex:
    """Move a wave to the right, with 0 where nothing is known."""
    moved = np.roll(wave, columns, axis=1)
    if columns:
        moved[:, slice(None, columns) if columns > 0 else slice(columns, None)] = 0
    return moved


def _shifted(columns: float | None, rows: float | None, *, sure: bool) -> Cause:
    shifts = {"x": columns, "y": rows}
    mend = " and ".join(f"{-shift:+.1f} px along {axis}" for axis, shift in shifts.items() if shift is not None)
    words = f"the infrared image does not lie on the visible one: a shift of {mend} would mend it"
    unknown = ("" if sure else "up to whole fringes; ") + "the scene has no edges that show a shift along y"
    words += "" if rows is not None else f" ({unknown})"
    words += "" if columns is not None else "; along y, fringes do not shift, and only edges of the object suffer"
    return Cause(
        "infrared registration",
        words,
        "register the chips: quadfringe calibrate run with its step registration, and decode with that calibration; if "
        "edges lie at the same place in all channels, the infrared projector has moved: calibrate the pair again",
    )


def _pair_moved(columns: float) -> Cause:
    words = f"infrared fringes lie {columns:+.1f} px away from the visible ones, and the edges of the images agree: "
    words += "the infrared projector has moved"
    fix = "calibrate the pair again, and project the pre-deformed infrared pattern (--predeformed-z-mm)"
    return Cause("infrared projector", words, fix)
