"""The reference measurement: N-step phase shifting at several fringe numbers, from many images of a still object.

>>> import numpy as np
>>> import quadfringe as qf
>>> from quadfringe.decoding.reference import decode_steps
>>> column_px = np.arange(912) + np.zeros((16, 1))
>>> shifts_rad = np.arange(4)[:, None, None] * np.pi / 2
>>> stacks = [0.5 + 0.3 * np.cos(2 * np.pi * n * column_px / 912 + shifts_rad) for n in (36, 35, 30)]
>>> shape = decode_steps([stack.astype(np.float32) for stack in stacks], (36, 35, 30), 912)
>>> bool(np.abs(shape.column_px - column_px).max() < 0.01)
True
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import Response, ResponseChoice, brief
from quadfringe.config.memory import require_memory
from quadfringe.data import Calibration, Shape
from quadfringe.data.optics import core_device
from quadfringe.decoding._kernel import rounded
from quadfringe.decoding.params import CONTRADICTED_SHARE, STEP_BYTES_PER_PX
from quadfringe.decoding.plan import calibration_of, response_of
from quadfringe.decoding.plausibility import mirrored, within_depths
from quadfringe.errors import DecodeError, DecodeWarning, InputError

__all__ = ["Channel", "StepSettings", "decode_steps"]

Channel = Literal["red", "green", "blue", "ir"]


@dataclass(frozen=True)
class StepSettings:
    """How step images are read; an absent setting takes the default of the kernel.

    `channel` is the one that the images show: "ir" for the infrared projector, else the visible one. `full_scale` is
    the intensity of a saturated pixel (default: the largest value of the dtype, 1 for float32). `modulation_min`, a
    fraction of full scale, is the least fringe amplitude that counts as light; samples from `saturation` on, a fraction
    too, are left out of the fit. `columns_px` are the first and the last projector column that the camera can see: with
    it, fringe numbers that repeat over the whole projector may be used. Points outside `depth_range_mm` are no data; it
    needs a calibration.
    """

    channel: Channel = "green"
    full_scale: float | None = None
    modulation_min: float | None = None
    saturation: float | None = None
    columns_px: tuple[float, float] | None = None
    depth_range_mm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.channel not in get_args(Channel):
            raise InputError(f"channel: expected {', '.join(get_args(Channel))}, got {self.channel!r}")


def decode_steps(
    stacks: Sequence[NDArray[Any]],
    fringe_numbers: Sequence[float],
    projector_width_px: int,
    *,
    calibration: Calibration | Path | str | None = None,
    response: Response | Literal["auto", "linear"] | Path | str = "auto",
    settings: StepSettings = StepSettings(),
) -> Shape:
    """Decode one stack of step images (N, H, W) for each fringe number, uint8, uint16 or float32 all alike.

    Image s of a stack shows the fringes shifted by s / N of a period; each stack has 3 steps or more, and may have
    another number than the others. The phase of the shape is that of the first fringe number. `response` "auto" is that
    of the calibration, else linear; it is never estimated, and harmonics up to the order N - 2 do not need it.

    Raises `InputError` or ValueError for stacks that do not fit, and for fringe numbers that repeat over the projector;
    `DecodeError` when no pixel is lit, or when the phases contradict each other as they do with images in another
    order.
    """
    numbers = [float(number) for number in fringe_numbers]
    images = _stacks(stacks, len(numbers))
    known, steps, size = calibration_of(calibration), [len(stack) for stack in images], images[0].shape[1:]
    require_memory("decoding", size, STEP_BYTES_PER_PX)
    choice = _response(response, known)
    devices: dict[str, Any] = _devices(known, settings.channel, size, projector_width_px)
    core = _core.StepDecoder(size, numbers, steps, projector_width_px, **_given(settings, choice), **devices)
    described = {
        "projector_width_px": projector_width_px,
        "fringes": {"numbers": numbers},
        "steps": steps,
        "channel": settings.channel,
        **_described(choice, response, known),
        "decode": rounded(core.settings()),
    }
    return _trusted(Shape(**core.decode(images), config=described, calibration=known), settings)


def _described(response: Response | Literal["linear"], asked: object, known: Calibration | None) -> dict[str, Any]:
    """Describe the response that was corrected; "auto" without a calibration that states one corrects none."""
    stated = known is not None and known.response is not None
    source = ("calibration" if stated else None) if asked == "auto" else "plan"
    corrected = None if response == "linear" else response.model_dump(include=set(Response.model_fields))
    return {"quadfringe_version": _core.__version__, "response": corrected, "response_from": source}


def _stacks(stacks: Sequence[Any], count: int) -> list[NDArray[Any]]:
    """Give the stacks; raise `InputError` unless there is one for each fringe number."""
    if count == 0:
        raise InputError("fringe_numbers: expected at least one, with its stack of images")
    if len(stacks) != count:
        raise InputError(
            f"stacks: expected {count}, one for each fringe number, got {len(stacks)}; a stack is (steps, H, W)"
        )
    for k, stack in enumerate(stacks):
        if not isinstance(stack, np.ndarray) or stack.ndim != 3:
            got = f"an array of shape {stack.shape}" if isinstance(stack, np.ndarray) else brief(stack)
            raise InputError(f"stack {k}: expected an array (steps, H, W), got {got}")
    return list(stacks)


def _response(response: Any, calibration: Calibration | None) -> Response | Literal["linear"]:
    found: ResponseChoice = response_of(response)
    if found != "auto":
        return found
    stated = None if calibration is None else calibration.response
    return "linear" if stated is None else stated


def _given(settings: StepSettings, response: Response | Literal["linear"]) -> dict[str, Any]:
    """Give the settings and the response of the channel as the kernel's keywords."""
    given = {name: getattr(settings, name) for name in ("full_scale", "modulation_min", "saturation", "columns_px")}
    if response != "linear":
        channel = getattr(response, settings.channel)
        given["response"] = (channel.offset, channel.exponent, channel.knee)
    return {name: value for name, value in given.items() if value is not None}


def _devices(
    calibration: Calibration | None, channel: Channel, size: tuple[int, int], width_px: int
) -> dict[str, _core.Device]:
    """Give the camera, and the projector that lights the channel; raise `InputError` when they do not fit."""
    if calibration is None:
        return {}
    camera, projector = calibration.camera, calibration.projector
    if channel == "ir" and calibration.infrared is not None:
        projector = calibration.infrared
    if size != (camera.height_px, camera.width_px):
        raise InputError(
            f"the calibration is for images of {camera.width_px} x {camera.height_px} pixels, "
            f"the images have {size[1]} x {size[0]}; calibrate at the size in use"
        )
    if projector.width_px != width_px:
        raise InputError(
            f"the calibration's projector has {projector.width_px} columns, "
            f"projector_width_px is {width_px}; the two must agree"
        )
    return {"camera": core_device(camera), "projector": core_device(projector)}


def _trusted(shape: Shape, settings: StepSettings) -> Shape:
    """Refuse a measurement without light, and one whose phases contradict each other or the calibration."""
    lit = np.isfinite(shape.quality)
    if not lit.any():
        least = shape.config["decode"]["modulation_min"]
        raise DecodeError(
            f"no pixel has fringes of an amplitude of at least {least:.3g} of full scale at every fringe number; "
            "check the exposure, and that every image shows its step"
        )
    contradicted = 1.0 - float((shape.returned & lit).sum() / lit.sum())
    if contradicted > CONTRADICTED_SHARE:
        raise DecodeError(
            f"the fringe numbers contradict each other on {contradicted:.0%} of the lit pixels; check the order of the "
            "images (steps of one fringe number after each other, or the numbers alternating), the fringe numbers, and "
            "the projector width"
        )
    # The check is for the visible projector.
    if settings.channel != "ir" and (cause := mirrored(shape)) is not None:
        raise cause.error
    words = [f"{cause.found}; {cause.fix}" for cause in within_depths(shape, settings.depth_range_mm)]
    for text in words:
        warnings.warn(text, DecodeWarning, stacklevel=3)
    return replace(shape, config={**shape.config, "warnings": words}) if words else shape
