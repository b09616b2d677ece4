"""From a shot to a shape: the kernel's decoder planned once, and a verdict on what came out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from quadfringe import _core
from quadfringe.config import DecodeConfig, Fringes, Response
from quadfringe.data import AnyShot, BayerShot, Calibration, Shape, conditioning
from quadfringe.errors import InputError
from quadfringe.optics import core_device, device_model
from quadfringe.verdict import judge

__all__ = ["Plan", "ShotDecoder", "core_device", "decode", "device_model", "kernel_decoder"]


@dataclass(frozen=True)
class Plan:
    """What a decoder is made from: the fringes, the calibration, and settings of the method.

    `response` stands in for the calibration's own when both are given.
    """

    projector_width_px: int
    fringes: Fringes = Fringes()
    calibration: Calibration | None = None
    response: Response | None = None
    settings: DecodeConfig = DecodeConfig()

    def described(self) -> dict[str, Any]:
        """Describe what is decoded, as plain data for a saved file; the decoder adds the settings in force."""
        response = self.response.model_dump(include=set(Response.model_fields)) if self.response else None
        return {
            "projector_width_px": self.projector_width_px,
            "fringes": self.fringes.model_dump(mode="json"),
            "response": response,
        }


class ShotDecoder:
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
        shape = self._shape(shot)
        judge(shape, shot, None if self._channels_known else self._shape)
        self._channels_known = True
        return shape

    def _shape(self, shot: AnyShot) -> Shape:
        if isinstance(shot, BayerShot):
            maps = self._core.decode_bayer(shot.raw, shot.bayer, shot.ir)
        else:
            maps = self._core.decode(shot.red, shot.green, shot.blue, shot.ir)
        return Shape(**maps, config=self._described, calibration=self.plan.calibration)


def kernel_decoder(like: AnyShot, plan: Plan) -> _core.Decoder:
    """Plan the kernel's decoder for shots like this one, which passes no verdict; errors as `ShotDecoder`."""
    _check_sizes(like, plan)
    return _core.Decoder(
        next(iter(like.images.values())).shape,
        plan.fringes.numbers,
        plan.projector_width_px,
        full_scale=like.full_scale_value,
        **conditioning(plan.calibration, plan.response),
        **_geometry(plan),
        **plan.settings.model_dump(exclude_none=True, exclude={"unwrapping"}),
    )


def decode(shot: AnyShot, plan: Plan) -> Shape:
    """Decode one shot: plan, decode, judge. For many shots make one `ShotDecoder`."""
    return ShotDecoder(shot, plan).decode(shot)


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
    searched = plan.settings.unwrapping == "pair"
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
