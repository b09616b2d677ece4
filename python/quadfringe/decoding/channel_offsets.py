"""What the phases of the channels say to each other on a decoded shot: infrared that is shifted, other fringe numbers.

A decoded phase says where the fringes of green and infrared must lie. Their offsets tell where they lie, in a few bands
of rows, to save time. For fringe numbers N, N - 1 and N - k a wrong order leaves two sums of the offsets as they are:

- offset of infrared + (k - 1) times that of red - k times that of green: the closure of the three phases. A shift of
  infrared turns it by its phase; numbers with another k let it drift by a turn over the field for each k.
- N / k times the offset of infrared: numbers with the same differences, such as 37, 36, 31 in place of 36, 35, 30, let
  it drift by a turn for each fringe.

Red and blue a quarter period apart give the brightness of every pixel, so that print does not move the other fringes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import closure_params as limits
from quadfringe.decoding import params
from quadfringe.decoding._kernel import KernelDecoder, rows_of_calibration
from quadfringe.decoding.cause import ORDERS, Cause
from quadfringe.decoding.closures import Angle, Closure, closing_steps, closure_of
from quadfringe.decoding.fringe_fit import infrared_column
from quadfringe.decoding.number_ratios import NUMBERS_FIX, FringeNumbers, agree, family, listed, measured
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.readings import rows_of
from quadfringe.decoding.registration import registration, wrong_order_rad
from quadfringe.decoding.symptoms import linear_light_of
from quadfringe.decoding.trusted import take_out, trusted_part

__all__ = ["Offsets", "contradiction", "decoded_closure", "drifting", "offsets_of", "taken_out"]

UNCOVER_FIX = "keep what covers or moves a part of the infrared image out of its way"
CONTRADICTED_FIX = (
    "look where they are (`reason`): narrow parts of an object with less than a fringe may do this, and so does what "
    "covers or moves a part of the infrared image"
)

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Offsets:
    """Offsets of the fringes of red, green and the third channel in tiles, (T,) rad, and the mean columns of the tiles.

    `turn_rad` is the column as a share of the field, 0 to 2 pi. `place` is the band and the number of each tile in it,
    (T, 2).
    """

    red_rad: Real
    green_rad: Real
    third_rad: Real
    turn_rad: Real
    place: NDArray[np.intp]

    def closure_rad(self, numbers: tuple[float, ...]) -> Real:
        """Give the closure of the three phases (E6), (T,) rad; no tiles for numbers whose phases do not close."""
        steps = closing_steps(numbers)
        if steps is None:
            return np.zeros(0)
        return self.third_rad + (steps - 1) * self.red_rad - steps * self.green_rad


def contradiction(shape: Shape, shot: AnyShot, plan: Plan) -> Cause | None:
    """Name what the channels contradict in a decoded shot; None if they agree, or are two.

    If they contradict a part of it, what fits is kept and the rest becomes no data, in place.
    """
    if len(plan.fringes.numbers) < 3:
        return None
    offsets = offsets_of(shape, shot, plan)
    if offsets.turn_rad.size < params.OFFSET_TILES_MIN:
        return None
    shifted = _shifted(offsets, shape, shot, plan)
    if shifted is None and (numbers := _numbers(offsets, shape, shot, plan)):
        return numbers
    if (shifted is None or not shifted.fatal) and (found := _in_part(offsets, plan)):
        part = _where_it_fits(found, shape, shot, plan)
        # If nothing fits, it is no part, and a response or crosstalk moves the fringes as well.
        return shifted if part.fatal else part
    return shifted and _where_it_fits(shifted, shape, shot, plan)


def decoded_closure(closure: Closure | None, shape: Shape, shot: AnyShot, plan: Plan) -> Closure | None:
    """Give a closure with the angle that the decoded phase shows, if enough of it is decoded.

    A strong response bends the phase as it is read from the light. The decoded one is that without the harmonics.
    """
    if closure is None or len(plan.fringes.numbers) < 3:
        return closure
    offsets = offsets_of(shape, shot, plan).closure_rad(plan.fringes.numbers)
    if offsets.size < params.OFFSET_TILES_MIN:
        return closure
    mean = _mean(offsets)
    return replace(closure, angle=Angle(float(np.angle(mean)), closure.angle.agreement, abs(mean)))


def taken_out(shape: Shape, shot: AnyShot, plan: Plan, seen: Shape) -> Cause | None:
    """Name what the channels contradict in what the decoder took out, which `seen` has; hide what else does not fit."""
    cause = _in_part(offsets_of(seen, shot, plan), plan)
    if cause is None:
        share = np.count_nonzero(shape.quality == 0) / np.count_nonzero(np.isfinite(shape.quality))
        words = f"in {share:.0%} of the pixels with fringes, green and infrared contradict every fringe order, and "
        cause = Cause(ORDERS, words + "these are no data", CONTRADICTED_FIX)
    return replace(_where_it_fits(cause, shape, shot, plan), fatal=False)


def drifting(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> Cause | None:
    """Name what the channels contradict in a shot whose orders collapsed, with the pixels that the decoder took out.

    A part that fits speaks against it: other fringe numbers leave none.
    """
    if trusted_part(shape, shot, decoder.plan) is not None:
        return None
    found = contradiction(decoder.keeping_doubtful().shape(shot), shot, decoder.plan)
    return found if found and found.fatal else None


def _shifted(offsets: Offsets, shape: Shape, shot: AnyShot, plan: Plan) -> Cause | None:
    """Find a shift of infrared that the whole image confirms, or that is half the angle of a wrong order or more."""
    if not plan.fringes.infrared or closing_steps(plan.fringes.numbers) is None:
        return None
    mean = _mean(offsets.closure_rad(plan.fringes.numbers))
    if abs(mean) < params.STEADY_MIN or abs(np.angle(mean)) < params.CLOSURE_RAD:
        return None
    if named := registration(shot, plan, closure_of(shot, plan, np.isfinite(shape.quality))):
        return named
    if abs(np.angle(mean)) < 0.5 * wrong_order_rad(plan.fringes.numbers):
        return None
    words = f"the infrared fringes lie {np.angle(mean):+.2f} rad off their place among those of red and green"
    fix = "register the chips (quadfringe calibrate run, step registration), or calibrate the pair again"
    return Cause("infrared registration", words, fix)


def _numbers(offsets: Offsets, shape: Shape, shot: AnyShot, plan: Plan) -> Cause | None:
    """Find fringe numbers that are not those of the shot, by offsets that drift over the field.

    Numbers are proposed if both ratios of the shot agree with them. A drift that agrees with none, in a shot with the
    ratios of its numbers, has another cause. Both ratios must confirm a drift of tiles that scatter.
    """
    found = _by_drift(offsets, plan, params.DRIFT_LENGTH)
    doubtful = () if found else _by_drift(offsets, plan, _beyond_chance(offsets.turn_rad.size))
    if not found and not doubtful:
        return None
    words = f"the fringe numbers {listed(plan.fringes.numbers)} are not those of this shot: the offsets of the "
    words += "channels drift over the field, "
    closure = closure_of(shot, plan, np.isfinite(shape.quality))
    kept = closure is not None and agree(plan.fringes.numbers, plan, closure)
    fitting = [one for one in (*found, *doubtful) if closure is None or agree(one, plan, closure)]
    if len(fitting) == 1 and (found or not kept):
        return Cause("fringe numbers", f"{words}which fits {listed(fitting[0])}", NUMBERS_FIX)
    if closure is None or not found or (kept and not fitting):
        return None
    return Cause("fringe numbers", f"{words}and {measured(plan, closure)}", NUMBERS_FIX)


def _beyond_chance(tiles: int) -> float:
    """Give the length of a mean phasor over tiles that chance exceeds for one drift in a thousand searches."""
    searched = 2 * params.DRIFT_TURNS_MAX + 1
    return float(np.sqrt(np.log(searched / limits.DRIFT_BY_CHANCE) / tiles))


def _by_drift(offsets: Offsets, plan: Plan, least: float) -> list[FringeNumbers]:
    """Give the fringe numbers that the drifts of both sums allow, of this length; none when neither drifts.

    With numbers n, n - d and m the closure drifts by m - n + k d turns, and the offset of infrared by n less that of
    the plan, less N / k d times the drift of the closure.
    """
    first, second, third = numbers = plan.fringes.numbers
    infrared, turn_rad = first / (first - third) * offsets.third_rad, offsets.turn_rad
    steps, closed = closing_steps(numbers), [0]
    # Crosstalk of red and green turns the closure too, but leaves infrared at its place.
    if steps and abs(_mean(infrared)) < params.STEADY_MIN:
        closed = _drifts(offsets.closure_rad(numbers), turn_rad, least) or [0]
    most = params.DRIFT_TURNS_MAX if closed == [0] else limits.CLOSED_TURNS_MAX
    found: list[FringeNumbers] = []
    for drift, more in product(_drifts(infrared, turn_rad, least, most), closed):
        shift = drift - first * more / (first - third)
        found.append((first + shift, second + shift, third + shift + more))
    found += [family(max(steps - more, 1)) for more in closed if steps and more]
    whole = [one for one in found if all(number > 0 and number == round(number) for number in one)]
    return list(dict.fromkeys(whole))


def _in_part(offsets: Offsets, plan: Plan) -> Cause | None:
    """Find a part where the closure is off by half a wrong order, in tiles that agree with those around.

    Texture that differs from channel to channel moves the fringes too, but of tiles all over the shape.
    """
    wave, least = np.exp(1j * offsets.closure_rad(plan.fringes.numbers)), 0.5 * wrong_order_rad(plan.fringes.numbers)
    alone = np.abs(np.angle(wave)) > least
    if not plan.fringes.infrared or np.count_nonzero(alone) < params.OFFSET_TILES_MIN:
        return None
    near = np.abs(offsets.place[:, np.newaxis] - offsets.place).max(axis=2) <= 1
    # A product of matrices wakes threads of OpenBLAS, which go on without work on the cores that the next decode needs.
    around = np.where(near, wave, 0).mean(axis=1) / near.mean(axis=1)
    off = alone & (np.abs(around) > params.STEADY_MIN) & (np.abs(np.angle(around)) > least)
    together = np.count_nonzero(off) / np.count_nonzero(alone)
    few = np.count_nonzero(off) < params.OFFSET_TILES_MIN or together < params.OFFSET_TOGETHER_MIN
    if few or off.mean() > params.OFFSET_PART_MAX:
        return None
    words = (
        f"in {off.mean():.0%} of the shape the infrared fringes lie {np.angle(wave[off].mean()):+.2f} rad off their "
    )
    words += "place among those of red and green"
    return Cause("infrared registration", words, UNCOVER_FIX)


def _where_it_fits(cause: Cause, shape: Shape, shot: AnyShot, plan: Plan) -> Cause:
    """Take out what a shift of infrared spoils, if a part of the shape fits; else all of it cannot be trusted."""
    if not cause.fatal or (part := trusted_part(shape, shot, plan)) is None:
        return cause
    take_out(shape, shape.returned & ~part)
    return replace(cause, found=f"{cause.found}; the {part.mean():.0%} of the image that fit are returned", fatal=False)


def _drifts(angle_rad: Real, turn_rad: Real, least: float, most: int = params.DRIFT_TURNS_MAX) -> list[int]:
    """Give the turns by which an angle may drift over the field; none unless a drift explains it better than none.

    The likelihood of tiles that scatter about a drift grows with the length of their mean phasor, the more the more
    tiles there are and the less they scatter.
    """
    turns = np.arange(-most, most + 1)
    lengths = np.abs(np.exp(1j * (angle_rad - turns[:, np.newaxis] * turn_rad)).mean(axis=1))
    best = float(lengths.max())
    if best <= max(least, lengths[most] + params.DRIFT_BETTER):
        return []
    near = lengths >= best - limits.LIKELIER * (1 - best) / turn_rad.size
    return [int(turn) for turn in turns[near]]


def _mean(angle_rad: Real) -> complex:
    return complex(np.exp(1j * angle_rad).mean())


def offsets_of(shape: Shape, shot: AnyShot, plan: Plan) -> Offsets:
    """Measure the offsets in bands of rows; B takes the place of IR if it has another fringe number than R."""
    first, second, third = plan.fringes.numbers
    count = min(params.BAND_ROWS, len(shape.phase_rad))
    tops = range(0, len(shape.phase_rad) - count + 1, max(count, len(shape.phase_rad) // params.BANDS // 2 * 2))
    rows = np.add.outer(np.array(tops), np.arange(0, count, params.ROW_STRIDE))
    phase_rad = shape.phase_rad[rows]
    light = _light_of_bands(shot, plan, tops, count)
    seen, third_rad = "blue", third / first * phase_rad
    if plan.fringes.infrared:
        per_px = np.float32(2 * np.pi * third / plan.projector_width_px)
        column_px = infrared_column(_rows(shape, rows.ravel()), plan).astype(np.float32)
        seen, third_rad = "ir", per_px * column_px.reshape(phase_rad.shape)
    of_red, of_green, of_third = (_tiled(wave_rad) for wave_rad in (phase_rad, second / first * phase_rad, third_rad))
    red, green, blue, other = (_tiled(light[name]) for name in ("red", "green", "blue", seen))
    brightness = _core.shared_brightness(red, blue, of_red) if plan.fringes.quadrature else None
    red_rad = _core.fringe_offsets(red, of_red)
    green_rad = _core.fringe_offsets(green, of_green, brightness)
    other_rad = _core.fringe_offsets(other, of_third, brightness)
    enough = np.count_nonzero(np.isfinite(of_red), axis=1) >= params.OFFSET_SHARE * of_red.shape[1]
    tiles = np.where(enough, np.array([red_rad, green_rad, other_rad, _means(phase_rad / first)]), np.nan)
    known = np.isfinite(tiles).all(axis=0)
    place = np.indices((len(tops), known.size // len(tops))).reshape(2, -1).T
    red_rad, green_rad, other_rad, turn_rad = tiles[:, known]
    return Offsets(red_rad, green_rad, other_rad, turn_rad, place[known])


def _light_of_bands(shot: AnyShot, plan: Plan, tops: range, count: int) -> dict[str, NDArray[np.float32]]:
    """Give the linear light of some rows of every band by channel, (bands, rows, columns)."""
    known, bands = plan.calibration, []
    for top in tops:
        # Only the registration depends on the rows, and plans take longer to make than light.
        if known is not None and known.ir_registration is not None:
            plan = replace(plan, calibration=rows_of_calibration(known, top, count))
        bands.append(linear_light_of(rows_of(shot, top, count), plan))
    return {name: np.stack([band[name][:: params.ROW_STRIDE] for band in bands]) for name in bands[0]}


def _rows(shape: Shape, rows: NDArray[np.intp]) -> Shape:
    xyz_mm = None if shape.xyz_mm is None else shape.xyz_mm[rows]
    return Shape(shape.phase_rad[rows], shape.column_px[rows], shape.modulation[rows], shape.quality[rows], xyz_mm)


def _tiled(bands: NDArray[Any]) -> NDArray[np.float32]:
    """Cut every second column of bands into tiles, (T, N)."""
    side = params.OFFSET_TILE_PX
    count, rows, columns = bands.shape
    parts = bands[:, :, : columns // side * side : 2].reshape(count, rows, -1, side // 2)
    return np.asarray(parts.swapaxes(1, 2).reshape(-1, rows * side // 2), np.float32)


def _means(bands: NDArray[Any]) -> Real:
    tiles = _tiled(bands)
    known = np.isfinite(tiles)
    sums = np.where(known, tiles, 0).sum(axis=1, dtype=np.float64)
    return np.asarray(sums / np.maximum(known.sum(axis=1), 1))
