"""How the three phases of a shot fit together: local frequencies, their errors, and a sum that is 0 for every surface.

For fringe numbers N, N - 1 and N - k the phases close: phi_IR + (k - 1) phi_R - k phi_G = 0 up to whole turns, for any
surface. A shift of the infrared image turns that sum by a constant angle, and other fringe numbers let it drift.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot
from quadfringe.decoding import closure_params as limits
from quadfringe.decoding import params
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.stages import wrapped_phases
from quadfringe.decoding.symptoms import linear_light_of
from quadfringe.errors import DecodeError

__all__ = [
    "Angle",
    "Closure",
    "Complex",
    "closed_wave",
    "closing_steps",
    "closure_of",
    "closure_of_waves",
    "in_squares",
    "local_mean",
    "local_rates",
    "waves_of",
]

Complex = NDArray[np.complex128]
Map = NDArray[np.float32]


@dataclass(frozen=True)
class Angle:
    """The closure of the three phases; NaN for fringe numbers that do not close.

    `rad` is its mean, `agreement` its local length, 0 to 1, and `steady` the length of its mean over that, 1 for the
    same angle everywhere.
    """

    rad: float
    agreement: float
    steady: float


@dataclass(frozen=True)
class Closure:
    """How the phases of red and blue, green and infrared fit together.

    If each colour has another fringe number, blue has the place of infrared. `green` and `infrared` are local
    frequencies over what the fringe numbers say, 1 if they agree, negative where red and blue run backwards.
    `infrared_px` is the period of the infrared fringes, NaN without a third phase. `waves` are those that were
    measured, and `ratios` the maps of which `green` and `infrared` are the medians, NaN where unknown.
    """

    green: float
    infrared: float
    angle: Angle
    infrared_px: float
    waves: list[Complex] = field(repr=False, compare=False)
    ratios: list[Map] = field(repr=False, compare=False)

    @cached_property
    def errors(self) -> tuple[float, float]:
        """Standard errors of `green` and `infrared`: infinite where too few fringes are in view to tell.

        They follow from the scatter of the ratio from place to place, which holds noise, print, edges and curvature.
        """
        green, *infrared = (_error_of_median(ratio) for ratio in self.ratios)
        return green, infrared[0] if infrared else 0.0

    @property
    def off(self) -> float:
        """The larger deviation of a frequency from what the fringe numbers say."""
        return max(abs(self.green - 1), abs(self.infrared - 1))

    @property
    def shift_px(self) -> float:
        """The shift of the infrared image along x, px, that explains the angle, up to whole periods."""
        return -self.angle.rad / (2 * np.pi) * self.infrared_px


def closure_of(shot: AnyShot, plan: Plan, lit: NDArray[np.bool_] | None = None) -> Closure | None:
    """Measure how the three phases close, where it is `lit`; None when no fringes cross the rows.

    Two phases close for every surface; without a third one only the frequency of green tells anything.
    """
    waves = waves_of(linear_light_of(shot, plan), plan)
    if waves is None:
        return None
    return closure_of_waves(waves if lit is None else [wave * lit for wave in waves], plan)


def waves_of(light: dict[str, Map], plan: Plan) -> list[Complex] | None:
    """Give exp(i phase) of each channel with another fringe number, 0 without a phase; None without fringes."""
    try:
        phases = wrapped_phases(light, plan.fringes.code)
    except DecodeError:
        return None
    return [np.where(np.isfinite(p), np.exp(1j * np.nan_to_num(p).astype(np.float64)), 0) for p in phases]


def closure_of_waves(waves: list[Complex], plan: Plan) -> Closure | None:
    """Measure how waves close where they are not 0; None when they do not change along the rows."""
    first, second, *others = plan.fringes.numbers
    rates = local_rates(waves)
    lag = waves[0].shape[1] - rates[0].shape[1]
    known = (np.abs(rates[0]) > 0.1 / params.LAG_PX) & np.all([wave[:, lag:] != 0 for wave in waves], axis=0)
    if not known.any():
        return None
    ratios = [
        np.where(known, rate / np.where(known, rates[0], 1.0) * first / number, np.nan).astype(np.float32)
        for rate, number in zip(rates[1:], (second, *others), strict=True)
    ]
    green, *infrared = (float(np.median(ratio[known])) for ratio in ratios)
    if not others:
        return Closure(green, 1.0, Angle(0.0, 1.0, 0.0), float("nan"), waves, ratios)
    angle = _closed(waves, (first, second, others[0]))
    period = 2 * np.pi / max(float(np.median(np.abs(rates[2][known]))), 1e-6)
    return Closure(green, infrared[0], angle, period, waves, ratios)


def _error_of_median(ratio: Map) -> float:
    """Give the standard error of the median of a map: from the medians of squares that know little of one another."""
    squares = in_squares(ratio, limits.RATIO_SQUARE_PX)
    known = np.count_nonzero(np.isfinite(squares), axis=1)
    full = known >= limits.SQUARE_SHARE * squares.shape[1]
    if np.count_nonzero(full) < limits.SQUARES_MIN:
        return float("inf")
    medians = np.nanmedian(squares[full], axis=1)
    scatter = limits.SD_OF_DEVIATION * float(np.median(np.abs(medians - np.median(medians))))
    count = float(known[full].sum() ** 2 / (known[full].astype(float) ** 2).sum())
    return float(np.sqrt(np.pi / 2)) * scatter / float(np.sqrt(count))


def in_squares(values: NDArray[Any], side: int) -> NDArray[Any]:
    """Cut a map into squares, (squares, side * side). The rest at the right and lower edges is dropped."""
    rows, columns = (size // side for size in values.shape)
    parts = values[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return parts.swapaxes(1, 2).reshape(rows * columns, side * side)


def local_rates(waves: list[Complex]) -> list[NDArray[np.float64]]:
    """Give the local frequencies along the rows, rad / px, all over the same distance: (H, W - lag)."""
    next_to = np.abs(np.angle(local_mean(waves[0][:, 1:] * np.conj(waves[0][:, :-1]), params.FREQUENCY_PX)))
    turn = np.median(next_to[next_to > 0]) if next_to.any() else 0.0
    # Over more than half a period a phase is known up to whole turns only.
    lag = int(np.clip(params.LAG_TURNS * 2 * np.pi / max(float(turn), 1e-6), 1, params.LAG_PX))
    return [np.angle(local_mean(wave[:, lag:] * np.conj(wave[:, :-lag]), params.FREQUENCY_PX)) / lag for wave in waves]


def _closed(waves: list[Complex], numbers: tuple[float, ...]) -> Angle:
    """Measure the sum of the three phases that is the same for every surface."""
    closed = closed_wave(waves, numbers)
    if closed is None:
        return Angle(float("nan"), float("nan"), float("nan"))
    share = np.count_nonzero(closed) / closed.size
    local = float(np.abs(local_mean(closed, params.CLOSURE_PX)).mean()) / max(share, 1e-9)
    mean = complex(closed.mean()) / max(share, 1e-9)
    return Angle(float(np.angle(mean)), local, abs(mean) / max(local, 1e-9))


def closed_wave(waves: list[Complex], numbers: tuple[float, ...]) -> Complex | None:
    """Give exp(i sum) of the sum of the three phases that is 0 for every surface; None if these do not close."""
    steps = closing_steps(numbers)
    if steps is None:
        return None
    closed: Complex = waves[2] * waves[0] ** (steps - 1) * np.conj(waves[1]) ** steps
    return closed


def closing_steps(numbers: tuple[float, ...]) -> int | None:
    """Give the k of fringe numbers N, M, N - k (N - M), whose three phases add up to whole turns; None for others."""
    first, second, third = numbers
    steps = (first - third) / (first - second)
    return round(steps) if abs(steps - round(steps)) < 1e-6 else None


def local_mean(wave: Complex, side_px: int) -> Complex:
    """Give the mean of a wave over squares of this side."""
    import cv2

    size = (side_px, side_px)
    mean: Complex = cv2.boxFilter(wave.real.copy(), -1, size) + 1j * cv2.boxFilter(wave.imag.copy(), -1, size)
    return mean
