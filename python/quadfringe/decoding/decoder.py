"""`Decoder`: from shots to shapes, planned once, with a verdict on every shape; `decode` for a single shot."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from quadfringe.config import ResponseChoice
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import params
from quadfringe.decoding._kernel import KernelDecoder, Size, check_channels, check_shot, size_of
from quadfringe.decoding.black import below_black, too_black, too_dark
from quadfringe.decoding.cause import ORDERS, Cause
from quadfringe.decoding.causes import too_bright, wrong_bits
from quadfringe.decoding.channel_offsets import contradiction, taken_out
from quadfringe.decoding.light_border import borders_of, checked_rows
from quadfringe.decoding.plan import Plan, check_plan, stated_response
from quadfringe.decoding.plausibility import implausible, within_depths
from quadfringe.decoding.response import SHOTS_TRIED, decode_straightened, response_in_place_of
from quadfringe.decoding.verdict import CHECK_ALL, judge
from quadfringe.errors import DecodeWarning, InputError
from quadfringe.io.images import full_scale
from quadfringe.io.locks import ForkedLock

__all__ = ["Decoder", "decode", "judged"]


class Decoder:
    """Decodes shots of one size; planned and checked when made. Every shot is judged by the same rule.

    `like` is a shot, or a size (rows, columns); `full_scale` defaults to the full scale of the shot, or for a size to
    the largest value of the dtype. Threads may decode at the same time: each then uses separate buffers. A forked child
    may go on with the decoder of its parent. Ctrl-C ends a long call at once; its work ends in the background.

    With `plan.response` "auto" and no response in the calibration, the response is estimated from the first sound
    shots: each of up to three shots is decoded with the estimate from itself, the first estimate that shows a response
    is held from then on, and if none of them shows any, the light is taken as linear. `response` is the one in use.
    A shot that is refused does not count.

    Raises `InputError` or ValueError when the plan cannot work: fringes that do not cover the field, a calibration for
    another size.

    >>> import quadfringe as qf
    >>> camera = qf.Device(width_px=512, height_px=384, focal_px=(1290, 1290), centre_px=(255.5, 191.5))
    >>> with qf.open(qf.SystemConfig(camera=camera)) as scanner:
    ...     shots = [scanner.grab() for _ in range(2)]
    >>> decoder = qf.Decoder(shots[0], qf.Plan(912, calibration=scanner.calibration))
    >>> [decoder.decode(shot).xyz_mm.shape for shot in shots]
    [(384, 512, 3), (384, 512, 3)]
    """

    def __init__(self, like: AnyShot | Size, plan: Plan, *, full_scale: float | None = None) -> None:
        self._size, self._full_scale = size_of(like, full_scale)
        check_plan(plan)
        self.plan = plan
        self._kernel = KernelDecoder(self._size, self._full_scale, plan)
        self._known = stated_response(plan.response, plan.calibration) != "auto"
        self._other: KernelDecoder | None = None  # for shots that contradict the stated response
        self._tried = 0
        self._estimating = ForkedLock()

    def __repr__(self) -> str:
        method = self._kernel.settings["method"]
        response = self.response if isinstance(self.response, str) else "known"
        return f"Decoder({self._size[1]} x {self._size[0]}, method {method}, response {response})"

    @property
    def response(self) -> ResponseChoice:
        """The response that is corrected; "linear" for none, "auto" as long as no sound shot was decoded."""
        return self._kernel.response if self._known else "auto"

    def decode(self, shot: AnyShot) -> Shape:
        """Give the shape; raises `DecodeError` when its orders cannot be trusted, naming the likely cause.

        A shot that is darker than the black of the stated response is decoded with the response that it shows itself.
        With a calibration, a shape that it contradicts is refused too, and depths outside `depth_range_mm` are no data.
        What is doubtful and returned stands in `Shape.warnings`, and is warned of as `DecodeWarning`.
        A shot whose orders are doubtful is decoded with channels exchanged too, in part or as a whole, to name them.
        Raises `InputError` for a shot of another size or full scale.
        """
        self._check(shot)
        if not self._known:
            with self._estimating:
                if not self._known:
                    return self._decode_and_hold(shot)
        kernel, doubt = self._fitting(shot)
        return judged(kernel.shape(shot), shot, kernel.plan, kernel, doubt)

    def decode_without_verdict(self, shot: AnyShot) -> Shape:
        """Give the shape, wrong orders and all; a response that is still unknown is estimated and not held."""
        self._check(shot)
        return self._fitting(shot)[0].shape(shot) if self._known else decode_straightened(self._kernel, shot)[1]

    def _fitting(self, shot: AnyShot) -> tuple[KernelDecoder, Cause | None]:
        """Give the decoder with the stated response, or with an estimate and a doubt if the shot contradicts it."""
        doubt = _doubt(self._kernel, shot)
        if doubt is None:
            return self._kernel, None
        with self._estimating:
            if self._other is None or _doubt(self._other, shot):
                self._other = response_in_place_of(self._kernel, shot)
            return self._other, doubt

    def _decode_and_hold(self, shot: AnyShot) -> Shape:
        kernel, shape = decode_straightened(self._kernel, shot)
        shape = judged(shape, shot, kernel.plan, kernel)
        self._tried += 1
        if kernel.response != "linear" or self._tried == SHOTS_TRIED:
            self._kernel, self._known = kernel, True
        return shape

    def _check(self, shot: AnyShot) -> None:
        check_shot(shot)
        check_channels(shot, self.plan)
        planned, size = (self._size, self._full_scale or float(full_scale(shot.first))), shot.first.shape
        if (size, shot.full_scale_value) != planned:
            (rows, columns), full = planned
            raise InputError(
                f"this decoder is for {columns} x {rows} pixels up to {full:g}, the shot has {size[1]} x "
                f"{size[0]} up to {shot.full_scale_value:g}; make a Decoder from a shot like it"
            )


def _doubt(kernel: KernelDecoder, shot: AnyShot) -> Cause | None:
    return too_black(below_black(shot, kernel.response, kernel.plan.calibration))


def judged(shape: Shape, shot: AnyShot, plan: Plan, kernel: KernelDecoder | None, doubt: Cause | None = None) -> Shape:
    """Refuse what cannot be trusted, take depths outside the stated range out, and note what is doubtful.

    This is all that a decode does besides the kernel. `kernel` decodes a doubtful shot otherwise, None leaves that out.
    """
    rest = judge(shape, shot, kernel)
    borders = borders_of(shape)
    doubts = implausible(shape, borders)
    # The verdict has named what it took out, or only that no test explains it.
    unexplained = rest is not None and rest.fix.startswith(CHECK_ALL)
    looked = kernel if rest is None or unexplained else None
    cause = None if kernel is None else contradiction(shape, shot, plan) or _taken_out(shape, shot, looked)
    if unexplained:
        rest, cause = (None, cause) if cause and cause.name != ORDERS else (rest, None)
    dark = too_dark(shot, plan.calibration)
    light = [*filter(None, (rest, doubt, dark, wrong_bits(shot), too_bright(shot)))]
    # A wrong dark level cuts the fringes off, and their phases tell nothing else until it is right.
    if cause and not dark:
        # Light that is cut off at either end is named first, because it moves the phases of the channels too.
        if light:
            light.append(replace(cause, fatal=False))
        else:
            doubts.append(cause)
    if fatal := next((cause for cause in doubts if cause.fatal), None):
        raise fatal.error
    doubts = [*doubts, *light, *within_depths(shape, plan.decode.depth_range_mm)]
    if words := checked_rows(shape, borders):
        shape = replace(shape, config={**shape.config, "geometry": words})
    if not doubts:
        return shape
    told = [f"{cause.found}; {cause.fix}" for cause in doubts]
    for text in told:
        warnings.warn(text, DecodeWarning, stacklevel=4)
    return replace(shape, config={**shape.config, "warnings": told})


def _taken_out(shape: Shape, shot: AnyShot, kernel: KernelDecoder | None) -> Cause | None:
    """Name what the channels contradict in what the kernel took out, if that is much."""
    if kernel is None or kernel.settings["method"] == "published":
        return None
    quality = shape.quality[:: params.TAKEN_OUT_STRIDE, :: params.TAKEN_OUT_STRIDE]
    if np.count_nonzero(quality == 0) <= params.TAKEN_OUT_SHARE * np.count_nonzero(np.isfinite(quality)):
        return None
    return taken_out(shape, shot, kernel.plan, kernel.keeping_doubtful().shape(shot))


def decode(shot: AnyShot, plan: Plan) -> Shape:
    """Decode one shot: plan, decode, judge. For many shots make one `Decoder`, which gives the same shapes faster.

    `config` of the shape holds the settings in force, the response that was corrected, and where that comes from.
    Errors as `Decoder`.
    """
    check_shot(shot)
    return Decoder(shot, plan).decode(shot)
