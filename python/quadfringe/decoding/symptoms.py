"""Figures of a shot that need no decoding: bits in use, light, sharpness, and the closure of its three phases.

For fringe numbers N, N - 1 and N - k the phases close: phi_IR + (k - 1) phi_R - k phi_G = 0 up to whole turns, for any
surface. A shift of the infrared image turns that sum by a constant angle, and other fringe numbers let it drift.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot
from quadfringe.decoding import params
from quadfringe.decoding.given import saturated_from
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.stages import carrier, linear_light, wrapped_phases
from quadfringe.errors import DecodeError

__all__ = [
    "Angle",
    "Bits",
    "Closure",
    "bits_in_use",
    "brightness",
    "closed_wave",
    "closing_steps",
    "closure_of",
    "closure_of_waves",
    "linear_light_of",
    "local_mean",
    "local_rates",
    "rows_match",
    "saturation",
    "waves_of",
]

Complex = NDArray[np.complex128]
Map = NDArray[np.float32]
DEPTHS = (8, 10, 12, 14)  # bits that cameras deliver in 16-bit files


@dataclass(frozen=True)
class Bits:
    """The bits that 16-bit data hold, whether less light would not explain it as well, and the largest value."""

    held: int
    sure: bool
    top: int


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
    `infrared_px` is the period of the infrared fringes, NaN without a third phase.
    """

    green: float
    infrared: float
    angle: Angle
    infrared_px: float

    @property
    def off(self) -> float:
        """The larger deviation of a frequency from what the fringe numbers say."""
        return max(abs(self.green - 1), abs(self.infrared - 1))

    @property
    def shift_px(self) -> float:
        """The shift of the infrared image along x, px, that explains the angle, up to whole periods."""
        return -self.angle.rad / (2 * np.pi) * self.infrared_px


@dataclass(frozen=True)
class RowsMatch:
    """Shift of the infrared image along y, px, and its correlation with the visible one, moved along x and not."""

    shift_px: float
    moved: float
    still: float


def bits_in_use(shot: AnyShot) -> Bits | None:
    """Give the bits of the camera when 16-bit data have fewer and count as 16; None when nothing is wrong.

    Crests cut off at the largest value of some bits show these. Else it is the fewest bits of a camera that hold all
    values; 14 are not sure, because a quarter of the light looks the same.
    """
    if shot.first.dtype != np.uint16 or shot.full_scale_value < np.iinfo(np.uint16).max:
        return None
    top = max(int(image.max()) for image in shot.images.values())
    width = top.bit_length()
    if 8 <= width < 16 and top == 2**width - 1 and sum(np.count_nonzero(i == top) for i in shot.images.values()) > 1:
        return Bits(width, True, top)
    held = next((bits for bits in DEPTHS if 0 < top < 2**bits), None)
    return None if held is None else Bits(held, held <= params.SURE_BITS, top)


def brightness(shot: AnyShot) -> dict[str, float]:
    """Give the brightest hundredth of what is lit of each channel, share of full scale.

    Of a dark frame, a hundredth may be half of the object. Means of neighbours leave out noise and single hot pixels.
    """
    import cv2

    samples = {name: image[::4, ::4] for name, image in shot.channels.items()}
    mean = cv2.blur(np.mean(list(samples.values()), axis=0), (3, 3))
    lit = mean > params.LIT_SHARE * np.quantile(mean, 0.999)
    return {name: float(np.quantile(image[lit], 0.99)) / shot.full_scale_value for name, image in samples.items()}


def saturation(shot: AnyShot) -> dict[str, float]:
    """Give the share of saturated pixels of each channel, in some of the rows."""
    level = saturated_from(shot)
    rows = {name: image[:: params.SATURATED_ROWS] for name, image in shot.channels.items()}
    return {name: np.count_nonzero(image >= level) / image.size for name, image in rows.items()}


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
    green, *infrareds = (float(np.median(rate[known] / rates[0][known])) for rate in rates[1:])
    if not others:
        return Closure(green * first / second, 1.0, Angle(0.0, 1.0, 0.0), float("nan"))
    third, infrared = others[0], infrareds[0]
    angle = _closed(waves, (first, second, third))
    period = 2 * np.pi / max(float(np.median(np.abs(rates[2][known]))), 1e-6)
    return Closure(green * first / second, infrared * first / third, angle, period)


def rows_match(shot: AnyShot, plan: Plan, columns_px: float) -> RowsMatch | None:
    """Compare infrared with visible rows, once infrared is moved back by `columns_px`, from detail along y.

    A mean over a fringe along x takes the fringes out and keeps detail along y. None when there is none in common.
    """
    import cv2

    light = linear_light_of(shot, plan)
    period_px, _ = carrier(np.nan_to_num(light["red"]))
    reach = params.SHIFT_MAX_PX
    if not np.isfinite(period_px) or min(light["ir"].shape) <= 4 * reach:
        return None
    visible, infrared = (
        _detail_along_y(np.nan_to_num(image), float(period_px))
        for image in (light["red"] + light["green"] + light["blue"], light["ir"])
    )
    inner = visible[reach:-reach, reach:-reach]
    moved, still = (
        cv2.matchTemplate(np.roll(infrared, -columns, axis=1)[:, reach:-reach], inner, cv2.TM_CCOEFF_NORMED)[:, 0]
        for columns in (round(columns_px), 0)
    )
    best = int(moved.argmax())
    if max(moved.max(), still.max()) < params.CORRELATION_MIN or not 0 < best < 2 * reach:
        return None
    return RowsMatch(best - reach + _peak(moved[best - 1 : best + 2]), float(moved.max()), float(still.max()))


def linear_light_of(shot: AnyShot, plan: Plan) -> dict[str, Map]:
    """Give the linear light of a shot by the response that the plan states; linear where it states none."""
    return linear_light(shot, plan.calibration, "calibration" if plan.response == "auto" else plan.response)


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


def _detail_along_y(image: Map, period_px: float) -> Map:
    """Give the relative brightness of detail of a few px along y, in means over about a fringe along x."""
    import cv2

    fine = cv2.GaussianBlur(image, (0, 0), sigmaX=0.6 * period_px, sigmaY=1.0)
    coarse = cv2.GaussianBlur(image, (0, 0), sigmaX=0.6 * period_px, sigmaY=5.0)
    relative: Map = (fine / np.maximum(coarse, 1e-3)).astype(np.float32)
    return relative


def _peak(three: NDArray[np.float32]) -> float:
    """Give the place of the maximum of a parabola through three values, from the middle one."""
    before, middle, after = (float(value) for value in three)
    bend = before - 2 * middle + after
    return 0.0 if bend >= 0 else 0.5 * (before - after) / bend
