"""Checks of the camera of a system: opened, read back, and looked through for some frames."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import closing

import numpy as np

from quadfringe.config import FilesConfig, SystemConfig, UvcConfig, VirtualConfig
from quadfringe.data import AnyShot
from quadfringe.devices import open_devices
from quadfringe.devices.uvc import UvcCamera, compression
from quadfringe.doctor._params import FRAMES, RATE_SHARE, SLOW_RATIO, STEADY_PERCENT
from quadfringe.doctor.finding import Finding, graded
from quadfringe.errors import CameraError, CameraWarning, InputError, MissingExtraError

__all__ = ["examine_camera"]


def examine_camera(config: SystemConfig) -> list[Finding]:
    """Open the camera of a system, and check its settings; a webcam also by its frames. No light is shown."""
    capture = config.capture
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CameraWarning)  # they become findings
        try:
            if isinstance(capture, UvcConfig):
                with UvcCamera(capture) as camera:
                    return list(_webcam(capture, camera))
            devices = open_devices(config.model_copy(update={"projectors": None, "calibration": None}))
        except (CameraError, InputError, MissingExtraError) as error:
            found, _, fix = str(error).partition("; ")
            return [Finding("camera", "fault", found, fix)]
    with closing(devices.projector), devices.camera:
        return [Finding("camera", "good", _words(config, devices.camera.name))]


def _words(config: SystemConfig, name: str) -> str:
    if isinstance(config.capture, FilesConfig):
        return (
            f"{name}: its program must write PNG or TIFF, not JPEG, with a fixed exposure of whole frames of the "
            "projector, fixed white balance, and a gamma of 1 if it has one"
        )
    if isinstance(config.capture, VirtualConfig):
        return "the virtual bench"
    return f"{name} answers"


def _webcam(asked: UvcConfig, camera: UvcCamera) -> Iterator[Finding]:
    took = camera.config
    size = "x".join(str(side) for side in took.size_px or ())
    words = f"{camera.name}: {size or 'a video'}, {took.pixel_format or 'format not told'}"
    yield Finding("camera", "good", words)
    yield _format(took)
    yield from _settings(asked, took)
    for doubt in camera.doubts:
        if doubt not in compression(took.pixel_format or ""):
            yield Finding(
                "camera automatic",
                "fault" if "exposure" in doubt else "warning",
                doubt,
                "switch it off in the program of the camera, which may keep it; on Linux v4l2-ctl --list-ctrls-menus "
                "names the control, and v4l2-ctl --set-ctrl=NAME=VALUE sets it",
            )
    try:
        shots = list(camera.stream(FRAMES, keep="all"))
    except CameraError as error:
        yield Finding("camera frames", "fault", str(error), "plug the camera in again, at a port without other devices")
        return
    if len(shots) == FRAMES:
        yield _rate(took, shots)
        yield _steadiness(shots)


def _format(took: UvcConfig) -> Finding:
    doubts = compression(took.pixel_format or "")
    if not doubts:
        return Finding("camera format", "good", f"{took.pixel_format or 'not told'}, no compression known")
    found, _, fix = doubts[0].partition("; ")
    return Finding("camera format", "warning", found, fix)


def _settings(asked: UvcConfig, took: UvcConfig) -> Iterator[Finding]:
    if took.exposure_us is None:
        words, fix = (
            "the exposure cannot be read",
            "fix it in the program of the camera, at whole frames of the projector",
        )
        yield Finding("camera exposure", "warning", words, fix)
    elif asked.exposure_us is None:
        words = (
            f"exposure_us is not stated, so that it stays at {took.exposure_us:g} us only until a program changes it"
        )
        fix = "set whole frames of the projector, such as 66667 at 60 Hz; a calibration needs it"
        yield Finding("camera exposure", "warning", words, fix)
    else:
        yield Finding("camera exposure", "good", f"{took.exposure_us:g} us")
    if took.gamma is None:
        words = "the camera has no control of it, so that calibrate response must measure it"
        yield Finding("camera gamma", "good", words)
    elif asked.gamma is None:
        words = f"gamma is not stated, and is {took.gamma:g} in the device"
        fix = "set the value of linear light, 100 for most cameras, or measure it with calibrate response"
        yield Finding("camera gamma", "warning", words, fix)
    else:
        yield Finding("camera gamma", "good", f"{took.gamma:g}")


def _rate(took: UvcConfig, shots: list[AnyShot]) -> Finding:
    """Compare the time between frames with the exposure, and with the rate that the camera states."""
    times_us = [shot.time_us for shot in shots if shot.time_us is not None]
    period_us = float(np.median(np.diff(times_us)))
    words = f"a frame comes every {period_us / 1000:.1f} ms"
    exposure_us, stated_us = took.exposure_us or 0.0, 1e6 / (took.frame_rate_hz or np.inf)
    if period_us < exposure_us * (1 - RATE_SHARE):
        return Finding(
            "camera rate",
            "fault",
            f"{words}, so that it cannot be exposed for {exposure_us / 1000:.1f} ms",
            f"set frame_rate_hz to {1e6 / exposure_us:.3g} or less, or let the exposure lower the rate: on Linux "
            "v4l2-ctl --set-ctrl=exposure_dynamic_framerate=1",
        )
    slow = stated_us > 0 and period_us > SLOW_RATIO * max(stated_us, exposure_us)
    fix = "use a USB port without other devices, a smaller size_px, or a lower frame_rate_hz" if slow else ""
    stated = f", {stated_us / 1000:.1f} ms are stated" if stated_us > 0 else ""
    return Finding("camera rate", "warning" if slow else "good", f"{words}{stated}", fix)


def _steadiness(shots: list[AnyShot]) -> Finding:
    """Say by how much the brightness of still frames differs, in per cent of the mean."""
    means = [float(np.mean([np.mean(image) for image in shot.images.values()])) for shot in shots]
    floor = 0.02 * shots[0].full_scale_value  # of a dark image, noise is all there is
    percent = 100 * (max(means) - min(means)) / max(float(np.mean(means)), floor)
    words = f"the brightness of {len(shots)} frames differs by {percent:.1f} %"
    fix = (
        "switch off automatic exposure and gain, light the scene by the projector alone, and expose whole periods of "
        "lamps (10 ms at 50 Hz, 8.3 ms at 60 Hz) and of the projector"
    )
    return graded("camera steadiness", percent, STEADY_PERCENT, words, fix)
