"""The reference measurement of a system: every step is shown and captured in turn, and all images give one shape."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, BayerShot, Calibration, Shape
from quadfringe.decoding import Plan, StepSettings, decode_steps, stages
from quadfringe.decoding.reference import Channel
from quadfringe.devices import Camera, Projector
from quadfringe.devices.light import Step
from quadfringe.errors import InputError

__all__ = ["REFERENCE_STEPS", "measure_reference"]

# With 12 steps, harmonics of the response up to the tenth do not change the phase, so that none need be known.
REFERENCE_STEPS = 12


def measure_reference(
    projector: Projector, camera: Camera, plan: Plan, steps: int, beam: Literal["visible", "infrared"]
) -> Shape:
    """Show and take `steps` phase shifts of each fringe number of the plan with one projector, and decode them."""
    if steps < 3:
        raise InputError(f"steps: expected at least 3, got {steps}")
    channel: Channel = "ir" if beam == "infrared" else "green"
    numbers = list(dict.fromkeys(plan.fringes.numbers))
    stacks, full_scale = [], 1.0
    for number in numbers:
        images = []
        for step in range(steps):
            projector.show(Step(number, 2 * np.pi * step / steps, "columns", beam, plan.fringes.layout))
            shot = camera.snap()
            images.append(_image(shot, channel, plan.calibration))
            full_scale = 1.0 if images[0].dtype.kind == "f" else shot.full_scale_value
        stacks.append(np.stack(images))
    return decode_steps(
        stacks,
        numbers,
        plan.projector_width_px,
        calibration=plan.calibration,
        response="linear" if _is_registered(channel, plan.calibration) else plan.response,
        settings=StepSettings(channel, full_scale, plan.decode.modulation_min),
    )


def _is_registered(channel: Channel, calibration: Calibration | None) -> bool:
    """Say whether images of the channel are moved to the visible pixels, as light whose response is corrected."""
    return channel == "ir" and calibration is not None and calibration.ir_registration is not None


def _image(shot: AnyShot, channel: Channel, calibration: Calibration | None) -> NDArray[Any]:
    """Give the channel at every pixel of the visible chip: as captured, else interpolated or registered, as float32.

    Green of a mosaic is interpolated. Infrared is moved to the visible pixels where the calibration registers the chips;
    pixels that the infrared chip does not see become dark.
    """
    if _is_registered(channel, calibration):
        return np.nan_to_num(stages.linear_light(shot, calibration)[channel], nan=0.0)
    if isinstance(shot, BayerShot) and channel != "ir":
        return stages.linear_light(shot)[channel]
    return np.asarray(getattr(shot, channel))
