"""Where frames come from: a camera, or a video file that is played at its rate."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.config.cameras import UvcConfig
from quadfringe.devices._shots import split_colours
from quadfringe.devices.uvc._controls import VALUES, Capture, Controls, Outcome, compression, fourcc_of
from quadfringe.errors import CameraBusyError, CameraError, CameraNotFoundError, ConfigError

__all__ = ["FoundDevice", "Source", "found"]

SYSFS = Path("/sys/class/video4linux")
FILE_RATE_HZ = 30.0  # of a file that does not say


@dataclass(frozen=True)
class FoundDevice:
    """A camera of the operating system: the word behind "uvc:" that opens it, and its name."""

    where: str
    name: str


def found() -> list[FoundDevice]:
    """List the cameras that Linux has; an empty list on other systems, which do not tell."""
    if not SYSFS.is_dir():
        return []
    devices = []
    for place in sorted(SYSFS.iterdir(), key=lambda place: (len(place.name), place.name)):
        index = place / "index"
        # A camera has several entries; the others than the first carry data about the images.
        if place.name.startswith("video") and (not index.exists() or index.read_text().strip() == "0"):
            name = (place / "name").read_text().strip() if (place / "name").exists() else ""
            devices.append(FoundDevice(place.name.removeprefix("video"), name))
    return devices


class Source:
    """An opened camera or video file, and its settings; raises `CameraError` that says what to check."""

    def __init__(self, config: UvcConfig) -> None:
        self._config = config
        number = config.device.isdigit()
        self.is_file = not number and Path(config.device).is_file()
        self.name = f"{'video' if self.is_file else 'camera'} {config.device}"
        if not self.is_file:
            _check_present(config.device, number)
        self._capture = _opened(config.device, number, self.is_file)
        if not self._capture.isOpened():
            self._capture.release()
            raise _not_opened(self.name, self.is_file)
        self.backend = self._capture.getBackendName()
        self.controls = Controls(self._capture, self.name)

    def set_up(self) -> Outcome:
        """Apply the settings of a camera; a file has none, and stating some is a `ConfigError`."""
        if not self.is_file:
            return self.controls.apply(self._config)
        names = (*VALUES, "pixel_format", "size_px", "frame_rate_hz")
        if given := [name for name in names if getattr(self._config, name) is not None]:
            raise ConfigError(f"{', '.join(given)}: {self.name} is a file, which has no settings; leave it out")
        codec = fourcc_of(self._capture)
        return Outcome({"pixel_format": codec or None}, compression(codec))

    @property
    def period_s(self) -> float:
        """Time from one frame of a file to the next; 0 for a camera, which sets the pace itself."""
        if not self.is_file:
            return 0.0
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        return 1 / rate_hz if 0.1 < rate_hz < 1000 else 1 / FILE_RATE_HZ

    @property
    def stale(self) -> int:
        """Number of frames that may wait in the driver from before a run."""
        if self.is_file:
            return 0
        waiting = self._capture.get(cv2.CAP_PROP_BUFFERSIZE)
        return int(waiting) if waiting > 0 else 4

    def grab(self) -> bool:
        """Wait for the next frame; False at the end of a file, or when the camera is lost."""
        return bool(self._capture.grab())

    def images(self) -> dict[str, NDArray[Any]]:
        """Give the images of the frame that was grabbed: red, green, blue, or raw; raises `CameraError`."""
        done, frame = self._capture.retrieve()
        if not done or frame is None:
            raise CameraError(f"{self.name}: a frame cannot be decoded")
        image = np.asarray(frame)
        if self._config.bayer is not None:
            return {"raw": self._mosaic(image)}
        if image.ndim != 3 or image.shape[2] != 3:
            raise CameraError(
                f"{self.name}: expected colour images, got shape {image.shape}; name a colour camera, or set bayer for "
                "one that sends raw mosaics"
            )
        return split_colours(image[:, :, ::-1])

    def _mosaic(self, image: NDArray[Any]) -> NDArray[Any]:
        height, width = (int(self._capture.get(getattr(cv2, f"CAP_PROP_FRAME_{side}"))) for side in ("HEIGHT", "WIDTH"))
        if image.ndim == 3 and image.shape[2] == 3 and (image == image[:, :, :1]).all():
            return np.ascontiguousarray(image[:, :, 0])
        if image.size == height * width and image.dtype in (np.uint8, np.uint16):
            return image.reshape(height, width).copy()
        raise CameraError(
            f"{self.name}: expected a raw mosaic of {width} x {height} pixels, got shape {image.shape} {image.dtype}; "
            "set pixel_format to a Bayer format of the camera, or leave bayer out"
        )

    def release(self) -> None:
        """Close the camera or the file."""
        self._capture.release()


def _opened(device: str, number: bool, is_file: bool) -> Capture:
    opened: Capture
    if number or not is_file:
        backend = cv2.CAP_V4L2 if sys.platform.startswith("linux") else cv2.CAP_ANY
        opened = cv2.VideoCapture(int(device) if number else device, backend)
    else:
        opened = cv2.VideoCapture(device)
    return opened


def _check_present(device: str, number: bool) -> None:
    """Raise the error that names the reason; OpenCV alone says nothing."""
    if not sys.platform.startswith("linux"):
        return
    path = Path(f"/dev/video{device}") if number else Path(device)
    listed = ", ".join(f"uvc:{one.where} ({one.name})" for one in found()) or "none"
    if not path.exists():
        raise CameraNotFoundError(
            f"camera {device}: no {path}; check cable and power, or name another. Cameras of this machine: {listed}"
        )
    if not os.access(path, os.R_OK | os.W_OK):
        raise CameraError(
            f"camera {device}: no permission for {path}; add this user to the group video, and log in anew"
        )


def _not_opened(name: str, is_file: bool) -> CameraError:
    if is_file:
        return CameraError(f"{name}: OpenCV cannot read this file; check that it is a video")
    return CameraBusyError(f"{name}: cannot be opened; close other programs that use it, or plug it in again")
