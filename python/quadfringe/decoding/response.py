"""The automatic response (gamma): estimated from a shot when neither settings nor calibration give one."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from quadfringe.config import Response
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding._kernel import KernelDecoder, check_shot, size_of
from quadfringe.decoding.plan import Plan, check_plan, stated_response
from quadfringe.decoding.shot_response import ShotResponse, shot_response
from quadfringe.decoding.stages import linear_light
from quadfringe.decoding.verdict import order_margin
from quadfringe.errors import InputError

__all__ = ["SHOTS_TRIED", "decode_straightened", "estimate_response", "response_in_place_of", "response_left"]

# Rounds of decoding and estimating. Each takes a part of the distortion out of the phase: on faces and steps of the
# virtual bench, gammas of 1.2 to 2.6 settle in one to three rounds. The limit bounds the time of a shot whose estimates
# do not settle; it is more than twice the rounds of any of these scenes, so that it stops none that would settle.
ROUNDS_MAX = 8
# Relative change of the exponents, a ratio, at which the rounds end. In the scenes above the change of a round is at
# most about a fifth of the change before, so that later rounds would change an exponent by less than 0.5 %.
SETTLED = 0.02
# One shot that shows a response decides: between shots with 3 % noise the exponent scatters by less than 0.3 %, a small
# part of SETTLED (`python evaluation/auto_response.py`). A shot may show none because little of it has fringes; this
# many sound shots without any mean that the light is linear. A larger number costs a linear bench further estimates at
# the start, a smaller one trusts one shot that shows little.
SHOTS_TRIED = 3


def estimate_response(shot: AnyShot, plan: Plan) -> Response | Literal["linear"]:
    """Estimate the response (gamma) of the channels from one shot; "linear" when the shot shows none.

    Any object that fills a good part of the image will do: the pixels of a tile, sorted by their phase, serve as a
    stack of phase steps serves in `quadfringe calibrate response`. The shot is decoded and the response estimated
    in turn until the estimate settles. The result can be put into a `Plan`. Raises `InputError` when the plan has a
    response already, and otherwise as `Decoder`.

    >>> import quadfringe as qf
    >>> from dataclasses import replace
    >>> camera = qf.Device(width_px=512, height_px=384, focal_px=(1290, 1290), centre_px=(255.5, 191.5))
    >>> gamma = qf.SystemConfig(camera=camera, scene=qf.SceneConfig(projector_exponent=1.8))
    >>> with qf.open(gamma) as scanner:
    ...     shot = scanner.grab()
    >>> plan = qf.Plan(projector_width_px=912)
    >>> response = qf.estimate_response(shot, plan)
    >>> print(f"{response.red.exponent:.1f}")
    0.6
    >>> decoder = qf.Decoder(shot, replace(plan, response=response))
    """
    check_shot(shot)
    check_plan(plan)
    if stated_response(plan.response, plan.calibration) != "auto":
        raise InputError('this plan has a response, from `response` or its calibration; make one with response="auto"')
    return decode_straightened(KernelDecoder(*size_of(shot, None), plan), shot)[0].response


def decode_straightened(as_captured: KernelDecoder, shot: AnyShot) -> tuple[KernelDecoder, Shape]:
    """Decode with the response that the shot shows, if that raises the margin of the fringe orders; else as captured.

    Gives the decoder that was used, whose response is the estimate, and the shape.
    """
    linear = as_captured.with_response("linear")
    first = linear.shape(shot)
    found = _estimate(shot, first, as_captured.plan)
    if found.response == "linear":
        return linear, first
    # The joint method also finds a response that is too strong for the published method to decode.
    finder = as_captured.with_method("joint")
    for _ in range(ROUNDS_MAX):
        before = found
        again = _estimate(shot, finder.with_response(before.response).shape(shot), as_captured.plan)
        found = before if again.response == "linear" else again
        if _settled(found, before):
            break
    straight = as_captured.with_response(found.response, found.described)
    shape = straight.shape(shot)
    return (straight, shape) if order_margin(shape) > order_margin(first) else (linear, first)


def response_in_place_of(stated: KernelDecoder, shot: AnyShot) -> KernelDecoder:
    """Give a decoder with the response that a shot shows, in place of the one that plan or calibration state."""
    plan, calibration = stated.plan, stated.plan.calibration
    if calibration is not None:
        plan = replace(plan, calibration=calibration.model_copy(update={"response": None}))
    found = decode_straightened(stated.with_plan(replace(plan, response="linear")), shot)[0]
    return stated.with_response(found.response, found.evidence)


def response_left(shot: AnyShot, shape: Shape, plan: Plan) -> ShotResponse:
    """Estimate the response that a shot shows beyond the one that its shape was decoded with; linear when it is right.

    The light tells it, whatever form the shape has.
    """
    used = shape.config["response"]
    return _estimate(shot, shape, plan, "linear" if used is None else Response(**used))


def _estimate(
    shot: AnyShot, shape: Shape, plan: Plan, undone: Response | Literal["calibration", "linear"] = "calibration"
) -> ShotResponse:
    light, fringes = linear_light(shot, plan.calibration, undone), plan.fringes
    return shot_response(light, shape.phase_rad, fringes.code, plan.projector_width_px, fringes.columns_px)


def _settled(one: ShotResponse, other: ShotResponse) -> bool:
    assert isinstance(one.response, Response)
    assert isinstance(other.response, Response)
    pairs = zip(one.response.rows, other.response.rows, strict=True)
    return all(abs(a[1] - b[1]) <= SETTLED * b[1] for a, b in pairs)
