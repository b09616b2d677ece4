"""The reference measurement of a system: every step is shown and captured in turn, and all images give one shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, BayerShot, Calibration, Shape
from quadfringe.decoding import Plan, StepSettings, decode_steps, stages
from quadfringe.decoding.reference import Channel
from quadfringe.devices import Camera, Projector
from quadfringe.devices.light import Step
from quadfringe.errors import InputError

__all__ = ["REFERENCE_STEPS", "Beam", "StepsTaken", "measure_reference", "take_steps"]

Beam = Literal["visible", "infrared"]
STEPS_MIN = 3  # background, modulation and phase are three unknowns
# With 12 steps, harmonics of the response up to the tenth do not change the phase, so that none need be known.
REFERENCE_STEPS = 12


@dataclass(frozen=True)
class StepsTaken:
    """The images of a reference measurement: one stack (steps, H, W) for each fringe number, and how they are read."""

    stacks: list[NDArray[Any]]
    numbers: list[float]
    settings: StepSettings


def take_steps(projector: Projector, camera: Camera, plan: Plan, steps: int, beam: Beam) -> StepsTaken:
    """Show `steps` phase shifts of each fringe number of the plan with one projector, and take a shot of each."""
    if steps < STEPS_MIN:
        raise InputError(f"steps: expected at least {STEPS_MIN}, got {steps}")
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
    settings = StepSettings(channel, full_scale, plan.decode.modulation_min, depth_range_mm=plan.decode.depth_range_mm)
    return StepsTaken(stacks, numbers, settings)


def measure_reference(projector: Projector, camera: Camera, plan: Plan, steps: int, beam: Beam) -> Shape:
    """Take the steps and decode them to one shape."""
    taken = take_steps(projector, camera, plan, steps, beam)
    return decode_steps(
        taken.stacks,
        taken.numbers,
        plan.projector_width_px,
        calibration=plan.calibration,
        response="linear" if _is_registered(taken.settings.channel, plan.calibration) else plan.response,
        settings=taken.settings,
    )


def _is_registered(channel: Channel, calibration: Calibration | None) -> bool:
    """Say whether images of the channel are moved to the visible pixels, as light whose response is corrected."""
    return channel == "ir" and calibration is not None and calibration.ir_registration is not None


def _image(shot: AnyShot, channel: Channel, calibration: Calibration | None) -> NDArray[Any]:
    """Give the channel at every pixel of the visible chip: as captured, else interpolated or registered, as float32.

    Green of a mosaic is interpolated. Infrared is moved to the visible pixels where the calibration registers the
    chips; pixels that the infrared chip does not see become dark.
    """
    if _is_registered(channel, calibration):
        return np.nan_to_num(stages.linear_light(shot, calibration)[channel], nan=0.0)
    if isinstance(shot, BayerShot) and channel != "ir":
        return stages.linear_light(shot)[channel]
    return np.asarray(getattr(shot, channel))
