"""Verdict on a decoded shot: it is refused when its orders collapse, with the likeliest cause by a test of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import params
from quadfringe.decoding._kernel import KernelDecoder
from quadfringe.decoding._offsets import channels_agree
from quadfringe.decoding.cause import ORDERS, Cause
from quadfringe.decoding.causes import (
    NUMBERS_FIX,
    after_order,
    along_rows,
    before_order,
    channels_fit,
    listed,
    other_numbers,
    period_fix,
    strange,
    vanishing,
    wrong_bits,
)
from quadfringe.decoding.channel_offsets import drifting
from quadfringe.decoding.given import blind_channels, same_images
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.plausibility import mirrored
from quadfringe.decoding.readings import Reading, band_of, other_readings, rows_of
from quadfringe.decoding.symptoms import Closure, closure_of, saturation
from quadfringe.decoding.trusted import is_scattered, take_out, trusted_part
from quadfringe.errors import DecodeError

__all__ = ["judge", "order_margin"]

CHECK_ALL = (
    "check that the channels are red, green, blue (and ir) in this order, and that the fringe numbers, the projector "
    "width and the response are those of this shot"
)
# Reasons that may hold for a part of a shot. Others, as wrong fringe numbers or crosstalk, hold for all of it.
IN_PART = (ORDERS, "infrared registration", "infrared projector", "saturation", "no fringes")
# Share of the returned pixels from which a trusted part is the object, and the rest are pixels lit by chance around it,
# which is not told. The wall around an object of 2 % of the frame has a tenth of them (`pytest tests/test_trusted.py`).
KEPT_MIN = 0.7
STRIDE, MARGIN_ROWS = 4, 48  # pixels between samples of the light; least rows and columns of samples of the margin
RETURNED_MIN = 0.05  # least share of the lit pixels that must be returned
# Median order margin of the lit pixels. Sound shots have more than 0.75, by the published method more than 0.4 when the
# response is not corrected. Exchanged channels have at most 0.44 (joint) and 0.49 (published), other fringe numbers 0.5
# (joint) and 0.3 (published). `pytest tests/test_verdict.py` tests both limits.
COLLAPSED = {"joint": 0.55, "published": 0.35}
# The same for shots whose channels do not have the ratios of the fringe numbers. Five of 1,000 shots of other numbers
# have 0.35 to 0.37 by the published method: `python -m hostile --shots 1000` in the folder tests.
COLLAPSED_UNFIT = {"joint": 0.55, "published": 0.4}
DOUBTFUL = 0.6
# From this margin up to the collapsed one, shots are kept whose channels agree. Below, other fringe numbers on coloured
# patches agree by chance. `pytest tests/test_real_objects.py` decodes shots of both kinds.
AGREEING_MIN = 0.3
# From this margin on, a shot is returned without further tests. Shots without one channel have at most 0.69, shots of
# other fringe numbers at most 0.70 (joint) and 0.42 (published), in images of a dozen fringes: `python -m hostile
# --shots 100` in the folder tests. Sound shots by the published method may have less, and other numbers are costly to
# try, so that these are tried below DOUBTFUL only.
SURE = 0.75
NUMBERS_SURE = {"joint": SURE, "published": DOUBTFUL}
CLEARLY_BETTER = 1.2  # ratio of margins from which channels count as exchanged, or fringe numbers as others
# Without infrared the frequency of green tells exchanged channels: sound shots are off by at most 0.002, white or with
# coloured patches, exchanged channels by 0.08 or more (`pytest tests/test_rgb.py`). Neighbouring fringe numbers are off
# by less than this.
GREEN_OFF = 0.05
# The same for another order of the channels to be named. Other orders are off by 0.03 or more.
GREEN_EXACT = 0.01
# Least share of lit pixels in an image: objects may fill 0.02 of it, and fewer than this are chance in noise. In an
# image that is mostly saturated more of them are chance, at the edges of clipped fringes.
LIT_MIN, UNSATURATED_MIN = 0.005, 0.05
# Least share of lit pixels among those that are as bright as they. Seven of 1,000 images of noise have 0.006 to 0.045
# lit pixels by chance (published): `python -m hostile --shots 1000` in the folder tests.
CHANCE_MAX = 0.1

# Margin in the band, as a share of the margin at which channels count as exchanged, from which the whole image is
# decoded. The band of the right channels must reach this share of the margin of their whole image: `pytest
# tests/test_verdict.py -k band -s` prints it for scenes of the virtual bench, at least 0.65 (joint) and 0.93
# (published). A larger number decodes fewer whole images and misses exchanges; a smaller one saves no time.
NEAR = {"joint": 0.6, "published": 0.85}


def judge(shape: Shape, shot: AnyShot, decoder: KernelDecoder | None) -> Cause | None:
    """Raise `DecodeError` that names the likely cause unless orders of `shape` can be trusted.

    When the median margin is below 0.6, `decoder` decodes the shot with each pair of channels exchanged, or as each
    other Bayer pattern, to name them; with None these and all further tests are left out. A shot with a margin from
    0.3, as of a photograph, is kept if its channels agree on the phase and no exchange comes near to its margin.
    If a part can be trusted, the rest becomes no data, in place, and its likely cause is given.
    """
    try:
        _refuse_whole(shape, shot, decoder)
    except DecodeError as refused:
        part = None if decoder is None or refused.reason not in IN_PART else trusted_part(shape, shot, decoder.plan)
        if part is None:
            raise
        # Orders of quality 0, which the decoder has taken out, belong to the shot as a whole too.
        few = np.count_nonzero(part) < KEPT_MIN * np.count_nonzero(shape.returned | (shape.quality == 0))
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
    enough = lit > 0 and returned >= RETURNED_MIN * lit and not _by_chance(shape, shot, margin, share)
    if enough and margin >= SURE:
        return
    blind, twice = blind_channels(shot), same_images(shot)
    if twice:
        raise twice.error
    if decoder is not None and enough and not blind and margin < NUMBERS_SURE[method]:
        _refuse_numbers(shape, shot, decoder)
    if enough and margin >= DOUBTFUL and not blind:
        return
    closure = None if decoder is None or blind else closure_of(shot, decoder.plan, np.isfinite(shape.quality))
    collapsed = (COLLAPSED if closure is None or channels_fit(closure) else COLLAPSED_UNFIT)[method]
    collapse = not enough or blind or (margin < collapsed and not _agrees(shape, shot, margin, decoder))
    if collapse:
        _refuse_shown(shot, shape, None if decoder is None else decoder.plan, closure)
    if decoder is not None and not channels_fit(closure):
        _refuse_exchanged(shape, shot, max(collapsed, CLEARLY_BETTER * margin), decoder)
    if collapse:
        cause = decoder and (after_order(shot, shape, decoder.plan, closure) or mirrored(shape))
        cause = cause or (decoder and drifting(shape, shot, decoder))
        raise (cause or (_collapsed(margin, _lit_share(shape)) if enough else _too_few(_lit_share(shape)))).error


def _refuse_shown(shot: AnyShot, shape: Shape, plan: Plan | None, closure: Closure | None) -> None:
    """Raise `DecodeError` for a cause that shows without fringe orders."""
    if (bits := wrong_bits(shot)) and bits.fatal:
        raise bits.error
    if blind := blind_channels(shot):
        raise blind.error
    if plan is not None and (cause := before_order(shot, plan, closure)):
        raise cause.error
    if (share := _lit_share(shape)) < LIT_MIN:
        if plan is not None and (vanished := vanishing(shot, plan)):
            raise vanished.error
        words = f"{'hardly a' if share else 'no'} pixel carries fringes in all channels"
        fix = "check focus and exposure, and that every channel is given once" + period_fix(share)
        raise Cause("no fringes", words, fix).error


def _collapsed(margin: float, share: float) -> Cause:
    words = f"the order margin has collapsed: below {margin:.2f} of 1 for half of the lit pixels"
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
    stride = max(1, min(shape.quality.shape) // MARGIN_ROWS)
    quality = shape.quality[::stride, ::stride]
    lit = quality[np.isfinite(quality)]
    returned = np.count_nonzero(np.isfinite(shape.phase_rad[::stride, ::stride]))
    return float(np.median(lit)) if lit.size else 0.0, lit.size, int(returned), lit.size / quality.size


def _lit_share(shape: Shape) -> float:
    return float(np.isfinite(shape.quality[::STRIDE, ::STRIDE]).mean())


def _lit_share_of_bright(shape: Shape, shot: AnyShot) -> float:
    """Return the share of lit pixels among those at least half as bright as lit ones usually are.

    A small object on a dark ground has nearly all of them; in noise, pixels that are lit by chance are like all others.
    """
    lit = np.isfinite(shape.quality[::STRIDE, ::STRIDE])
    light = np.mean([image[::STRIDE, ::STRIDE] for image in shot.channels.values()], axis=0)
    return float(lit.sum() / np.count_nonzero(light >= 0.5 * np.median(light[lit])))


def _by_chance(shape: Shape, shot: AnyShot, margin: float, share: float) -> bool:
    """Say whether so few pixels carry fringes, or so many are saturated, that the margin may be chance.

    `share` is the lit share of a few thousand samples, which is close enough unless it is small.
    """
    if share < 2 * CHANCE_MAX:
        share = _lit_share(shape)
    few = share < CHANCE_MAX and _lit_share_of_bright(shape, shot) < CHANCE_MAX
    if share < LIT_MIN or (few and is_scattered(shape)):
        return True
    doubtful = share < UNSATURATED_MIN or margin < DOUBTFUL
    return doubtful and max(saturation(shot).values()) > params.REFUSED_SHARE


def _refuse_numbers(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> None:
    """Raise `DecodeError` if fringes run along the rows, or if other numbers raise the margin of a band of rows."""
    if cause := along_rows(shot, decoder.plan):
        raise cause.error
    part, band = _band(shape, shot, decoder)
    closure = closure_of(band, part.plan)
    if closure is None or channels_fit(closure):
        return
    given = order_margin(part.shape(band))
    for numbers in other_numbers(part.plan, closure):
        found = order_margin(part.with_numbers(numbers).shape(band))
        if found > max(CLEARLY_BETTER * given, DOUBTFUL):
            words = f"the fringe numbers {listed(decoder.plan.fringes.numbers)} are not those of this shot: with the "
            words += f"ratios of its channels the median order margin is {found:.2f} in place of {given:.2f}, "
            words += f"which fits {listed(numbers)}"
            raise Cause("fringe numbers", words, NUMBERS_FIX).error


def _refuse_green(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> None:
    """Raise `DecodeError` if green does not have its frequency in a band of rows.

    Without infrared every pair of phases has an order, so that exchanged channels leave the margin as it is.
    """
    part, band = _band(shape, shot, decoder)
    closure = closure_of(band, part.plan)
    if closure is None or abs(closure.green - 1) < GREEN_OFF:
        return
    if twice := same_images(shot):
        raise twice.error
    orders = [] if abs(closure.green + 1) < GREEN_OFF else _with_green(other_readings(band), part.plan)
    if orders:
        words = " or ".join(one.found for one in orders)
    elif abs(closure.green + 1) < GREEN_OFF:
        words = "red and blue seem to be swapped, or the images mirrored: green runs against them"
    else:
        seen = "red and blue" if decoder.plan.fringes.quadrature else "red"
        words = f"green has {abs(closure.green):.2f} of the fringes that it should have for those of {seen}"
    fix = (
        "check that the channels are red, green, blue in this order, and that the fringe numbers are those of this shot"
    )
    raise Cause(ORDERS, words, fix).error


def _with_green(readings: list[Reading], plan: Plan) -> list[Reading]:
    """Give the readings in which green has its frequency and runs along with the others."""
    closures = [(one, closure_of(one.shot, plan)) for one in readings]
    return [one for one, closure in closures if closure is not None and abs(closure.green - 1) < GREEN_EXACT]


def _refuse_exchanged(shape: Shape, shot: AnyShot, least: float, decoder: KernelDecoder) -> None:
    """Raise `DecodeError` if another order of the channels raises the median margin above `least`."""
    suspects = _plausible(other_readings(shot), shape, least, decoder)
    found = [(_margin(decoder.shape(one.shot))[0], one) for one in suspects]
    margin, best = max(found, key=lambda each: each[0], default=(0.0, None))
    if best and margin > least:
        words = f"{best.found}: the median order margin is {_margin(shape)[0]:.2f} as given and {margin:.2f} if so"
        raise Cause(ORDERS, words, best.fix).error


def _agrees(shape: Shape, shot: AnyShot, margin: float, decoder: KernelDecoder | None) -> bool:
    """Tell whether the channels agree on the phase, and in a band of rows no other order comes near to the margin."""
    if decoder is None or margin < AGREEING_MIN or not channels_agree(shape, shot, decoder.plan):
        return False
    part, band = _band(shape, shot, decoder)
    others = [order_margin(part.shape(one.shot)) for one in _possible(other_readings(band), part)]
    return order_margin(part.shape(band)) > CLEARLY_BETTER * max(others, default=0.0)


def _plausible(suspects: list[Reading], shape: Shape, least: float, decoder: KernelDecoder) -> list[Reading]:
    """Give the suspects that a band of rows allows, which takes a fraction of the time.

    Their margin comes near to `least` there, and their channels have about the frequencies of the fringe numbers.
    """
    first, count = band_of(shape)
    if 2 * count > len(shape.quality):
        return suspects
    part, near = decoder.for_rows(first, count), NEAR[decoder.settings["method"]] * least
    bands = {one.found: replace(one, shot=rows_of(one.shot, first, count)) for one in suspects}
    found = {one.found for one in _possible([*bands.values()], part) if order_margin(part.shape(one.shot)) >= near}
    return [one for one in suspects if one.found in found]


def _possible(readings: list[Reading], decoder: KernelDecoder) -> list[Reading]:
    """Give the readings whose channels have about the frequencies of the fringe numbers."""
    return [one for one in readings if not strange(closure_of(one.shot, decoder.plan))]


def _band(shape: Shape, shot: AnyShot, decoder: KernelDecoder) -> tuple[KernelDecoder, AnyShot]:
    """Give the decoder and the shot of the band of rows with most light."""
    first, count = band_of(shape)
    return decoder.for_rows(first, count), rows_of(shot, first, count)
