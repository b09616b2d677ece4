"""The response (gamma) of channels, from images of one fringe pattern at equal phase steps: files, or taken here.

>>> import numpy as np
>>> from quadfringe.calibration.response import *
>>> phase_rad = 2 * np.pi * np.arange(256) / 32 + 2 * np.pi * np.arange(12)[:, None] / 12
>>> light = np.tile((0.5 + 0.4 * np.cos(phase_rad))[:, None, :], (1, 24, 1))
>>> stacks = {name: (light**0.5).astype(np.float32) for name in ("red", "green", "blue")}  # a gamma of 2
>>> dark = {name: np.zeros((24, 256), np.float32) for name in stacks}
>>> found = estimate_from_steps(StepsTaken(stacks, dark, steadiness=0.0, camera="example"))
>>> isinstance(found, EstimatedResponse), round(found.calibration.red.exponent, 1)
(True, 2.0)
>>> from pathlib import Path
>>> saved = estimate_from_files(sorted(Path("steps").glob("*.png")), steps=12)  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import ChannelResponse, Response
from quadfringe.data import AnyShot, ResponseCalibration
from quadfringe.devices import Camera, Projector
from quadfringe.devices.light import Levels, Light, Step
from quadfringe.errors import InputError
from quadfringe.io.images import full_scale, read_grey

__all__ = ["EstimatedResponse", "StepsTaken", "WalkThrough", "estimate_from_files", "estimate_from_steps", "take_steps"]

BEAMS = {"visible": ("red", "green", "blue"), "infrared": ("ir",)}
# Not measured: a lamp drifts by less within seconds, and an iris that follows the image changes the light by far more.
STEADY = 0.02
# Harmonic error that three numbers leave, rad; not measured: with the pictures of a camera of 8 bit it is a tenth.
LEFT_RAD = 0.05


@dataclass(frozen=True)
class EstimatedResponse:
    """An estimated response, and figures by name: its parameters, and the harmonic error before and after.

    `doubts` says in words what the images show of automatic functions; empty for files.
    """

    calibration: ResponseCalibration
    figures: Mapping[str, float]
    doubts: tuple[str, ...] = ()


def estimate_from_files(
    files: Sequence[Path],
    steps: int,
    channels: Sequence[str] | None = None,
    base: ResponseCalibration | None = None,
) -> EstimatedResponse:
    """Estimate the response of `channels` (default: all) from consecutive stacks of `steps` images.

    The other channels are taken from `base` (default: linear). Raises `InputError` when the number of files is not a
    multiple of `steps` or when the images differ in size or type, and ValueError when the stacks show no fringes, are
    out of order, too dark or saturated.
    """
    if not files or len(files) % steps:
        raise InputError(
            f"expected a multiple of {steps} files (steps of a stack), got {len(files)}; give the images of each stack "
            "in the order of their shifts, and no others"
        )
    images = _read_alike(files)
    figures = _core.estimate_response([np.stack(images[i : i + steps]) for i in range(0, len(files), steps)])
    response = ChannelResponse(**{name: figures[name] for name in ChannelResponse.model_fields})
    known = {name: getattr(base or Response(), name) for name in Response.model_fields}
    calibration = ResponseCalibration(
        **{**known, **dict.fromkeys(channels or known, response)},
        steps=steps,
        inputs=tuple(path.name for path in files),
    )
    return EstimatedResponse(calibration, figures)


def _read_alike(files: Sequence[Path]) -> list[NDArray[np.float32]]:
    """Read images, share of full scale; raises `InputError` unless all have one size and type."""
    first = read_grey(files[0])
    found = []
    for path in files:
        image = read_grey(path)
        if (image.shape, image.dtype) != (first.shape, first.dtype):
            raise InputError(
                f"{path}: {image.shape} {image.dtype}, but {files[0]} is {first.shape} {first.dtype}; "
                "all images of a capture must have one size and type"
            )
        found.append(image.astype(np.float32) / full_scale(image))
    return found


@dataclass(frozen=True)
class WalkThrough:
    """What a walk-through shows: `number` fringes at `steps` phase shifts, with the projectors named by `beams`."""

    steps: int = 16
    number: float = 8.0
    beams: tuple[str, ...] = ("visible",)


@dataclass(frozen=True)
class StepsTaken:
    """The images of a walk-through by channel, fractions of full scale: `stacks` (steps, H, W), `dark` (H, W) of black.

    `steadiness` is the largest difference between the brightness of one image after black and after white, as a share.
    """

    stacks: Mapping[str, NDArray[np.float32]]
    dark: Mapping[str, NDArray[np.float32]]
    steadiness: float
    camera: str


def take_steps(
    projector: Projector, camera: Camera, plan: WalkThrough, say: Callable[[str], None] = lambda _: None
) -> StepsTaken:
    """Show black and every step, and take a shot of each; show one of the steps again after black and after white.

    `say` gets a line before each shot, for cameras that a person triggers. Nothing may move meanwhile. Raises
    `ConfigError` when the projector cannot show single steps.

    >>> from quadfringe.devices import open_devices
    >>> from quadfringe.config import Device, SystemConfig
    >>> camera = Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
    >>> devices = open_devices(SystemConfig(camera=camera))
    >>> taken = take_steps(devices.projector, devices.camera, WalkThrough(steps=4))
    >>> taken.stacks["green"].shape
    (4, 192, 256)
    """
    images = plan.steps * len(plan.beams) + 2  # and black, and one step again after white
    counter = count(1)

    def taken(light: Light) -> AnyShot:
        projector.show(light)
        say(f"image {next(counter)} of {images}")
        return camera.snap()

    black = taken(Levels((0.0,) * 4))
    beams = [beam for beam in plan.beams if black.channels.keys() >= set(BEAMS[beam])]  # the camera may see no infrared
    channels = [channel for beam in beams for channel in BEAMS[beam]]
    dark = {channel: _fraction(black, channel) for channel in channels}
    stacks: dict[str, list[NDArray[np.float32]]] = {channel: [] for channel in channels}
    for beam in beams:
        for n in range(plan.steps):
            shot = taken(Step(plan.number, 2 * np.pi * n / plan.steps, "columns", beam))
            for channel in BEAMS[beam]:
                stacks[channel].append(_fraction(shot, channel))
    first = beams[0]
    projector.show(Levels((1.0,) * 4))
    again = taken(Step(plan.number, 0.0, "columns", first))
    steadiness = max(_difference(stacks[channel][0], _fraction(again, channel)) for channel in BEAMS[first])
    return StepsTaken({name: np.stack(each) for name, each in stacks.items()}, dark, steadiness, camera.name)


def _difference(after_black: NDArray[np.float32], after_white: NDArray[np.float32]) -> float:
    """Return the difference between the brightness of two images, as a share."""
    return abs(float(after_white.mean()) / max(float(after_black.mean()), 1e-6) - 1)


def _fraction(shot: AnyShot, channel: str) -> NDArray[np.float32]:
    return (shot.channels[channel] / shot.full_scale_value).astype(np.float32)


def estimate_from_steps(taken: StepsTaken, base: ResponseCalibration | None = None) -> EstimatedResponse:
    """Estimate the response of each channel that was taken; the others are those of `base` (default: linear).

    The light without projector is subtracted first, because on a white surface the estimate would mistake it for a
    part of the response.
    Doubts about the projector, from what was measured, stand in `doubts`. Raises `InputError` that names the channel
    whose images show no fringes, or are too dark or saturated.
    """
    figures: dict[str, float] = {}
    found = {}
    for channel, stack in taken.stacks.items():
        try:
            # Averaged over neighbours, so that its noise does not count in every step.
            dark = cv2.blur(taken.dark[channel], (5, 5))
            one = _core.estimate_response([np.maximum(stack - dark, 0)])
        except ValueError as error:
            raise InputError(
                f"{channel}: {error}; light a matt white surface that fills the image, and expose so that its "
                "brightest parts reach 80 % of full scale"
            ) from error
        one["offset"] += float(np.median(taken.dark[channel]))
        found[channel] = ChannelResponse(**{name: one[name] for name in ChannelResponse.model_fields})
        figures |= {f"{channel}_{name}": value for name, value in one.items()}
    known = {name: getattr(base or Response(), name) for name in Response.model_fields}
    steps = len(next(iter(taken.stacks.values())))
    calibration = ResponseCalibration(**{**known, **found}, steps=steps, inputs=(taken.camera,))
    figures["steadiness_percent"] = 100 * taken.steadiness
    return EstimatedResponse(calibration, figures, tuple(_doubts(taken, figures)))


def _doubts(taken: StepsTaken, figures: Mapping[str, float]) -> list[str]:
    """Say what the images show of picture modes that a projector should not have."""
    doubts = []
    if taken.steadiness > STEADY:
        doubts.append(
            f"the same image is {100 * taken.steadiness:.1f} % brighter or darker after white than after black: switch "
            "off dynamic contrast, auto iris and eco mode of the projector, and automatic functions of the camera"
        )
    for channel in taken.stacks:
        left_rad = figures[f"{channel}_two_step_rms_after_rad"]
        if left_rad > LEFT_RAD:
            doubts.append(
                f"{channel}: {left_rad:.3f} rad of harmonics are left, so that no smooth response explains the images: "
                "choose the picture mode sRGB or standard, switch off sharpness and colour enhancement, and expose "
                "whole frames"
            )
    return doubts
