"""Verdict on a decoded shot: it is refused when its orders collapse, with the likeliest cause by a test of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import params
from quadfringe.decoding import verdict_params as limits
from quadfringe.decoding._kernel import KernelDecoder
from quadfringe.decoding.agreement import Agreement
from quadfringe.decoding.blur import vanishing
from quadfringe.decoding.cause import ORDERS, Cause
from quadfringe.decoding.causes import after_order, along_rows, before_order, period_fix, wrong_bits
from quadfringe.decoding.channel_offsets import drifting
from quadfringe.decoding.closure_params import RATIO_SD
from quadfringe.decoding.closures import Closure, closure_of
from quadfringe.decoding.given import blind_channels, copied, same_images
from quadfringe.decoding.number_ratios import NUMBERS_FIX, agree, channels_fit, listed, other_numbers, strange
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.plausibility import mirrored
from quadfringe.decoding.readings import Reading, band_of, other_readings, rows_of
from quadfringe.decoding.rivals import outdoes_rivals
from quadfringe.decoding.symptoms import saturation
from quadfringe.decoding.trusted import is_scattered, take_out, trusted_part
from quadfringe.errors import DecodeError

__all__ = ["judge", "order_margin"]

CHECK_ALL = (
    "check that the channels are red, green, blue (and ir) in this order, and that the fringe numbers, the projector "
    "width and the response are those of this shot"
)
# Reasons that may hold for a part of a shot. Others, as wrong fringe numbers or crosstalk, hold for all of it.
IN_PART = (ORDERS, "infrared registration", "infrared projector", "saturation", "no fringes")


def judge(shape: Shape, shot: AnyShot, decoder: KernelDecoder | None) -> Cause | None:
    """Raise `DecodeError` that names the likely cause unless orders of `shape` can be trusted.

    When the median margin is below 0.6, `decoder` decodes the shot with each pair of channels exchanged, or as each
    other Bayer pattern, to name them; with None these and all further tests are left out. A shot of any margin, as of a
    photograph or of an object as narrow as a fringe, is kept if its channels agree on the phase. A shot below the sure
    margin is refused if they contradict it.
    If a part can be trusted, the rest becomes no data, in place, and its likely cause is given. All is kept where
    doubtful orders have no other cause and no other reading explains the light nearly as well.
    """
    try:
        _refuse_whole(shape, shot, decoder)
    except DecodeError as refused:
        part = None if decoder is None or refused.reason not in IN_PART else trusted_part(shape, shot, decoder.plan)
        # Orders of quality 0, which the decoder has taken out, belong to the shot as a whole too.
        whole = limits.KEPT_MIN * np.count_nonzero(shape.returned | (shape.quality == 0))
        few = part is None or np.count_nonzero(part) < whole
        if few and decoder is not None and refused.reason == ORDERS and outdoes_rivals(shape, shot, decoder):
            return None
        if part is None:
            raise
        take_out(shape, shape.returned & ~part)
        words = f"only {part.mean():.0%} of the image can be trusted, and the rest is no data; of the shot as a whole"
        return Cause.doubt(refused, words) if few else None
    return None


def _refuse_whole(shape: Shape, shot: AnyShot, decoder: KernelDecoder | None) -> None:
    """Raise `DecodeError` unless the orders of most lit pixels can be trusted."""
    margin, lit, returned, share = _margin(shape)
    if decoder is not None and not decoder.plan.fringes.infrared and lit > 0:
        _refuse_green(shape, shot, decoder)
    method = shape.config["decode"]["method"]
    enough = lit > 0 and returned >= limits.RETURNED_MIN * lit and not _by_chance(shape, shot, margin, share)
    if enough and margin >= limits.SURE and not copied(shot):
        return
    blind, twice = blind_channels(shot), same_images(shot)
    if twice:
        raise twice.error
    if decoder is not None and enough and not blind and margin < limits.NUMBERS_SURE[method]:
        _refuse_numbers(shape, shot, decoder)
    agreement = Agreement(shape, shot, decoder.plan) if decoder is not None and enough and not blind else None
    contradicted = agreement is not None and agreement.contradicted
    if enough and margin >= limits.DOUBTFUL and not blind and not contradicted:
        return
    closure = None if decoder is None or blind else closure_of(shot, decoder.plan, np.isfinite(shape.quality))
    collapsed = (limits.COLLAPSED if closure is None or channels_fit(closure) else limits.COLLAPSED_UNFIT)[method]
    agree = decoder is not None and agreement is not None and _agrees(agreement, shape, shot, margin, decoder)
    collapse = not enough or blind or contradicted or (margin < collapsed and not agree)
    if collapse:
        _refuse_shown(shot, shape, None if decoder is None else decoder.plan, closure)
    if decoder is not None and not channels_fit(closure):
        _refuse_exchanged(shape, shot, max(collapsed, limits.CLEARLY_BETTER * margin), decoder)
    if collapse:
        cause = decoder and (after_order(shot, shape, decoder.plan, closure) or mirrored(shape))
        cause = cause or (decoder and drifting(shape, shot, decoder))
        share = _lit_share(shape)
        unknown = _scattered(share) if contradicted else _collapsed(margin, share) if enough else _too_few(share)
        raise (cause or unknown).error


def _refuse_shown(shot: AnyShot, shape: Shape, plan: Plan | None, closure: Closure | None) -> None:
    """Raise `DecodeError` for a cause that shows without fringe orders."""
    if (bits := wrong_bits(shot)) and bits.fatal:
        raise bits.error
    if blind := blind_channels(shot):
        raise blind.error
    if plan is not None and (cause := before_order(shot, plan, closure)):
        raise cause.error
    if (share := _lit_share(shape)) < limits.LIT_MIN:
        if plan is not None and (vanished := vanishing(shot, plan)):
            raise vanished.error
        words = f"{'hardly a' if share else 'no'} pixel carries fringes in all channels"
        fix = "check focus and exposure, and that every channel is given once" + period_fix(share)
        raise Cause("no fringes", words, fix).error


def _collapsed(margin: float, share: float) -> Cause:
    words = f"the order margin has collapsed: below {margin:.2f} of 1 for half of the lit pixels"
    return Cause(ORDERS, f"{words}; no test names the cause", CHECK_ALL + period_fix(share))


def _scattered(share: float) -> Cause:
    words = "green and infrared lie off the phase by angles that differ from place to place"
    return Cause(ORDERS, f"{words}; no test names the cause", CHECK_ALL + period_fix(share))


def _too_few(share: float) -> Cause:
    words = "pixels with fringes in all channels are scattered as in noise, or hardly any of them could be decoded"
    return Cause(ORDERS, f"{words}; no test names the cause", CHECK_ALL + period_fix(share))


def order_margin(shape: Shape) -> float:
    """Give the median order margin of the lit pixels, in [0, 1]; 0 without any."""
    return _margin(shape)[0]


def _margin(shape: Shape) -> tuple[float, int, int, float]:
    """Give the median order margin of the lit pixels, their number, that of the returned ones, and the lit share.

    They are those of a few thousand samples.
    """
    stride = max(1, min(shape.quality.shape) // limits.MARGIN_ROWS)
    quality = shape.quality[::stride, ::stride]
    lit = quality[np.isfinite(quality)]
    returned = np.count_nonzero(np.isfinite(shape.phase_rad[::stride, ::stride]))
    return float(np.median(lit)) if lit.size else 0.0, lit.size, int(returned), lit.size / quality.size


def _lit_share(shape: Shape) -> float:
    return float(np.isfinite(shape.quality[:: limits.STRIDE, :: limits.STRIDE]).mean())


def _lit_share_of_bright(shape: Shape, shot: AnyShot) -> float:
    """Return the share of lit pixels among those at least half as bright as lit ones usually are.

    A small object on a dark ground has nearly all of them; in noise, pixels that are lit by chance are like all others.
    """
    lit = np.isfinite(shape.quality[:: limits.STRIDE, :: limits.STRIDE])
    light = np.mean([image[:: limits.STRIDE, :: limits.STRIDE] for image in shot.channels.values()], axis=0)
    return float(lit.sum() / np.count_nonzero(light >= 0.5 * np.median(light[lit])))


def _by_chance(shape: Shape, shot: AnyShot, margin: float, share: float) -> bool:
    """Say whether so few pixels carry fringes, or so many are saturated, that the margin may be chance.

    `share` is the lit share of a few thousand samples, which is close enough unless it is small.
    """
    if share < 2 * limits.CHANCE_MAX:
        share = _lit_share(shape)
    few = share < limits.CHANCE_MAX and _lit_share_of_bright(shape, shot) < limits.CHANCE_MAX
    if share < limits.LIT_MIN or (few and is_scattered(shape)):
        return True
    doubtful = share < limits.UNSATURATED_MIN or margin < limits.DOUBTFUL
    return doubtful and max(saturation(shot).values()) > params.REFUSED_SHARE


def _refuse_numbers(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> None:
    """Raise `DecodeError` if fringes run along the rows, or if other numbers raise the margin of a band of rows."""
    if cause := along_rows(shot, decoder.plan):
        raise cause.error
    part, band = _band(shape, shot, decoder)
    closure = closure_of(band, part.plan, _lit_band(shape))
    others = [] if closure is None else other_numbers(part.plan, closure)
    if closure is not None and channels_fit(closure):
        others = [one for one in others if agree(one, part.plan, closure, RATIO_SD)]  # over few fringes, several do
    if not others:
        return
    given = order_margin(part.shape(band))
    margins = {one: order_margin(part.with_numbers(one).shape(band)) for one in others}
    numbers, found = max(margins.items(), key=lambda each: each[1], default=(None, 0.0))
    if numbers and found > max(limits.CLEARLY_BETTER * given, limits.DOUBTFUL):
        words = f"the fringe numbers {listed(decoder.plan.fringes.numbers)} are not those of this shot: with the "
        words += f"ratios of its channels the median order margin is {found:.2f} in place of {given:.2f}, "
        words += f"which fits {listed(numbers)}"
        raise Cause("fringe numbers", words, NUMBERS_FIX).error


def _refuse_green(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> None:
    """Raise `DecodeError` if green does not have its frequency in a band of rows.

    Without infrared every pair of phases has an order, so that exchanged channels leave the margin as it is.
    """
    part, band = _band(shape, shot, decoder)
    lit = _lit_band(shape)
    closure = closure_of(band, part.plan, lit)
    if closure is None or abs(closure.green - 1) < limits.GREEN_OFF:
        return
    if twice := same_images(shot):
        raise twice.error
    orders = [] if abs(closure.green + 1) < limits.GREEN_OFF else _with_green(other_readings(band), part.plan, lit)
    if orders:
        words = " or ".join(one.found for one in orders)
    elif abs(closure.green + 1) < limits.GREEN_OFF:
        words = "red and blue seem to be swapped, or the images mirrored: green runs against them"
    else:
        seen = "red and blue" if decoder.plan.fringes.quadrature else "red"
        words = f"green has {abs(closure.green):.2f} of the fringes that it should have for those of {seen}"
    fix = (
        "check that the channels are red, green, blue in this order, and that the fringe numbers are those of this shot"
    )
    raise Cause(ORDERS, words, fix).error


def _with_green(readings: list[Reading], plan: Plan, lit: NDArray[np.bool_]) -> list[Reading]:
    """Give the readings in which green has its frequency and runs along with the others."""
    closures = [(one, closure_of(one.shot, plan, lit)) for one in readings]
    return [one for one, closure in closures if closure is not None and abs(closure.green - 1) < limits.GREEN_EXACT]


def _refuse_exchanged(shape: Shape, shot: AnyShot, least: float, decoder: KernelDecoder) -> None:
    """Raise `DecodeError` if another order of the channels raises the median margin above `least`."""
    suspects = _plausible(other_readings(shot), shape, least, decoder)
    found = [(_margin(decoder.shape(one.shot))[0], one) for one in suspects]
    margin, best = max(found, key=lambda each: each[0], default=(0.0, None))
    if best and margin > least:
        words = f"{best.found}: the median order margin is {_margin(shape)[0]:.2f} as given and {margin:.2f} if so"
        raise Cause(ORDERS, words, best.fix).error


def _agrees(agreement: Agreement, shape: Shape, shot: AnyShot, margin: float, decoder: KernelDecoder) -> bool:
    """Tell whether the channels agree on the phase; in the mean alone, no other order may come near to the margin."""
    if agreement.beyond_chance:
        return True
    if margin < limits.AGREEING_MIN or not agreement.in_the_mean:
        return False
    part, band = _band(shape, shot, decoder)
    readings = _possible(other_readings(band), part, _lit_band(shape))
    others = [order_margin(part.shape(one.shot)) for one in readings]
    return order_margin(part.shape(band)) > limits.CLEARLY_BETTER * max(others, default=0.0)


def _plausible(suspects: list[Reading], shape: Shape, least: float, decoder: KernelDecoder) -> list[Reading]:
    """Give the suspects that a band of rows allows, which takes a fraction of the time.

    Their margin comes near to `least` there, and their channels have about the frequencies of the fringe numbers.
    """
    first, count = band_of(shape)
    if 2 * count > len(shape.quality):
        return suspects
    part, near = decoder.for_rows(first, count), limits.NEAR[decoder.settings["method"]] * least
    bands = {one.found: replace(one, shot=rows_of(one.shot, first, count)) for one in suspects}
    possible = _possible([*bands.values()], part, _lit_band(shape))
    found = {one.found for one in possible if order_margin(part.shape(one.shot)) >= near}
    return [one for one in suspects if one.found in found]


def _possible(readings: list[Reading], decoder: KernelDecoder, lit: NDArray[np.bool_]) -> list[Reading]:
    """Give the readings whose channels have about the frequencies of the fringe numbers where it is `lit`."""
    return [one for one in readings if not strange(closure_of(one.shot, decoder.plan, lit))]


def _band(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> tuple[KernelDecoder, AnyShot]:
    """Give the decoder and the shot of the band of rows with most light."""
    first, count = band_of(shape)
    return decoder.for_rows(first, count), rows_of(shot, first, count)


def _lit_band(shape: Shape) -> NDArray[np.bool_]:
    """Say which pixels of that band are lit: dark ground around an object has any frequencies, by chance."""
    first, count = band_of(shape)
    return np.isfinite(shape.quality[first : first + count])
