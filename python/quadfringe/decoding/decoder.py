"""From a shot to a shape: the kernel's decoder planned once, and a verdict on what came out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from quadfringe import _core
from quadfringe.config import DecodeConfig, Fringes, Response
from quadfringe.data import AnyShot, BayerShot, Calibration, Shape, conditioning
from quadfringe.data.optics import core_device
from quadfringe.decoding.stages import response_of_shot
from quadfringe.decoding.verdict import judge, order_margin
from quadfringe.errors import InputError

__all__ = ["Decoder", "Plan", "decode", "estimate_response", "kernel_decoder"]

ROUNDS_MAX = 8  # of decoding and estimating: each takes a part of the bend out of the phase
SETTLED = 0.02  # change of the exponents, as a share, at which the rounds end


@dataclass(frozen=True)
class Plan:
    """What a decoder is made from: the fringes, the calibration, and settings of the method.

    `response` stands in for the calibration's own when both are given. Where neither says a word of it, `decode`
    estimates it from the shot; `Response()` says that the light is linear.
    """

    projector_width_px: int
    fringes: Fringes = Fringes()
    calibration: Calibration | None = None
    response: Response | None = None
    decode: DecodeConfig = DecodeConfig()

    def described(self) -> dict[str, Any]:
        """Describe what is decoded, as plain data for a saved file; the decoder adds the settings in force."""
        response = self.response.model_dump(include=set(Response.model_fields)) if self.response else None
        return {
            "projector_width_px": self.projector_width_px,
            "fringes": self.fringes.model_dump(mode="json"),
            "response": response,
        }


class Decoder:
    """Decodes shots of one size; planned and checked when made.

    The first shot is looked at for exchanged channels too, which do not come and go afterwards.
    Raises `InputError` or ValueError when the plan cannot work: fringes that do not cover the field, a
    calibration for another size.
    """

    def __init__(self, like: AnyShot, plan: Plan) -> None:
        self.plan = plan
        self._channels_known = False
        self._core = kernel_decoder(like, plan)
        self._described = plan.described() | {"decode": self._core.settings()}

    def decode(self, shot: AnyShot) -> Shape:
        """Give the shape; raises `DecodeError` when the orders cannot be trusted, naming the likely cause."""
        return self.judged(self.shape(shot), shot)

    def judged(self, shape: Shape, shot: AnyShot) -> Shape:
        """Give the shape of this shot back; raises `DecodeError` as `decode` does."""
        judge(shape, shot, None if self._channels_known else self.shape)
        self._channels_known = True
        return shape

    def shape(self, shot: AnyShot) -> Shape:
        """Give the shape without a verdict."""
        if isinstance(shot, BayerShot):
            maps = self._core.decode_bayer(shot.raw, shot.bayer, shot.ir)
        else:
            maps = self._core.decode(shot.red, shot.green, shot.blue, shot.ir)
        return Shape(**maps, config=self._described, calibration=self.plan.calibration)


def kernel_decoder(like: AnyShot, plan: Plan) -> _core.Decoder:
    """Plan the kernel's decoder for shots like this one, which passes no verdict; errors as `Decoder`."""
    _check_sizes(like, plan)
    return _core.Decoder(
        next(iter(like.images.values())).shape,
        plan.fringes.numbers,
        plan.projector_width_px,
        full_scale=like.full_scale_value,
        **conditioning(plan.calibration, plan.response),
        **_geometry(plan),
        **plan.decode.model_dump(exclude_none=True, exclude={"unwrapping"}),
    )


def decode(shot: AnyShot, plan: Plan) -> Shape:
    """Decode one shot: plan, decode, judge. For many shots make one `Decoder`.

    Where neither plan nor calibration know a response, the one that the shot itself shows is undone
    (`estimate_response`); `config` of the shape then has it, and "response_of_shot" true. Errors as `Decoder`.
    """
    if _response_known(plan):
        return Decoder(shot, plan).decode(shot)
    decoder, shape = _straightened(shot, plan)
    own = {"response_of_shot": decoder.plan.response is not None}
    return decoder.judged(shape, shot).with_settings({**shape.config, **own}, plan.calibration)


def estimate_response(shot: AnyShot, plan: Plan) -> Response | None:
    """Give the response (gamma) of the channels that one shot shows, None when it is linear as far as can be told.

    Any object does that fills a good part of the image: pixels of a tile sorted by their phase are what a stack of
    phase steps is to `quadfringe calibrate response`. The shot is decoded and the response estimated in turn until it
    stays. For many shots of one bench put it into the plan of a `Decoder`. Raises `InputError` when the plan knows
    a response already, otherwise as `Decoder`.

    >>> import quadfringe as qf
    >>> from dataclasses import replace
    >>> bent = qf.SystemConfig(scene=qf.SceneConfig(projector_exponent=1.8))
    >>> with qf.open(bent) as scanner:
    ...     shot = scanner.grab()
    >>> plan = qf.Plan(projector_width_px=912)
    >>> response = qf.estimate_response(shot, plan)
    >>> print(f"{response.red.exponent:.1f}")
    0.6
    >>> decoder = qf.Decoder(shot, replace(plan, response=response))
    """
    if _response_known(plan):
        raise InputError("this plan knows the response already, from its `response` or its calibration; leave both out")
    return _straightened(shot, plan)[0].plan.response


def _straightened(shot: AnyShot, plan: Plan) -> tuple[Decoder, Shape]:
    """Decode, with the response that the shot shows if the orders are the surer for it."""
    first = Decoder(shot, plan)
    as_captured = first.shape(shot)
    found = _response_of(shot, as_captured, plan)
    if found is None:
        return first, as_captured
    # The published method needs a response more than it can help to find one.
    best = replace(plan, decode=plan.decode.model_copy(update={"method": "best"}))
    for _ in range(ROUNDS_MAX):
        shape = Decoder(shot, replace(best, response=found)).shape(shot)
        before, found = found, _response_of(shot, shape, plan) or found
        if _close(found, before):
            break
    decoder = Decoder(shot, replace(plan, response=found))
    shape = decoder.shape(shot)
    better = order_margin(shape) > order_margin(as_captured)
    return (decoder, shape) if better else (first, as_captured)


def _response_known(plan: Plan) -> bool:
    """Tell whether anything is said of how intensities follow the light; that they are linear is something too."""
    said = conditioning(plan.calibration, plan.response)
    return not said.keys().isdisjoint(("response", "crosstalk", "projector_response"))


def _response_of(shot: AnyShot, shape: Shape, plan: Plan) -> Response | None:
    return response_of_shot(shot, shape.phase_rad, plan.fringes.numbers, plan.projector_width_px, plan.calibration)


def _close(one: Response, other: Response) -> bool:
    pairs = zip(one.rows(), other.rows(), strict=True)
    return all(abs(a[1] - b[1]) <= SETTLED * b[1] for a, b in pairs)


def _check_sizes(shot: AnyShot, plan: Plan) -> None:
    name, image = next(iter(shot.images.items()))
    if image.ndim != 2:
        raise InputError(f"{name}: expected one grey image (H, W), got an array of shape {image.shape}")
    if plan.calibration is None:
        return
    camera, projector = plan.calibration.camera, plan.calibration.projector
    if image.shape != (camera.height_px, camera.width_px):
        raise InputError(
            f"the calibration is for images of {camera.width_px} x {camera.height_px} pixels, "
            f"the shot has {image.shape[1]} x {image.shape[0]}; calibrate at the size in use"
        )
    if projector.width_px != plan.projector_width_px:
        raise InputError(
            f"the calibration's projector has {projector.width_px} columns, "
            f"the fringes are said to cover {plan.projector_width_px}; the two must agree"
        )


def _geometry(plan: Plan) -> dict[str, Any]:
    calibration = plan.calibration
    searched = plan.decode.unwrapping == "pair"
    if searched and (calibration is None or calibration.infrared is None):
        raise InputError(
            'unwrapping = "pair" needs a calibration with both projectors: one that has an `infrared` device'
        )
    if calibration is None:
        return {}
    known = {"camera": core_device(calibration.camera), "projector": core_device(calibration.projector)}
    if not searched or calibration.infrared is None:
        return known
    return known | {
        "infrared": core_device(calibration.infrared),
        "predeformed_z_mm": plan.fringes.predeformed_z_mm,
    }
