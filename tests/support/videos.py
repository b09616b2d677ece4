"""A lossless video as the source of a camera, and a camera that OpenCV would open, with the habits of real drivers."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from quadfringe.devices.uvc import _source


def write_video(path: Path, shape: tuple[int, int], frames: int, codec: str = "FFV1", rate_hz: float = 30.0) -> Path:
    """Write frames of this shape (H, W) whose red, green and blue tell the number of the frame."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), rate_hz, shape[::-1])
    assert writer.isOpened()
    for number in range(frames):
        frame = np.empty((*shape, 3), np.uint8)
        frame[...] = (number // 256 + 2, 1, number % 256)  # blue, green, red
        writer.write(frame)
    writer.release()
    return path


def let_opencv_open(fake: FakeCapture, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let OpenCV open this camera, whichever is named."""

    def opened(*_: object) -> FakeCapture:
        fake.released = False
        return fake

    monkeypatch.setattr(cv2, "VideoCapture", opened)
    monkeypatch.setattr(_source, "_check_present", lambda *_: None)


class FakeCapture:
    """A `cv2.VideoCapture` on V4L2 whose controls have the values and the faults that a test gives them.

    `controls` are by property; a control that is not there reads -1. `stuck` ones accept a value and keep another.
    """

    formats = ("MJPG", "YUYV")
    controls: dict[int, float]
    stuck: set[int]

    def __init__(self, formats: tuple[str, ...] = ("MJPG", "YUYV"), backend: str = "V4L2") -> None:
        self.formats, self.format, self.backend = formats, formats[0], backend
        self.controls = {
            cv2.CAP_PROP_FRAME_WIDTH: 32,
            cv2.CAP_PROP_FRAME_HEIGHT: 24,
            cv2.CAP_PROP_FPS: 30,
            cv2.CAP_PROP_BUFFERSIZE: 4,
            cv2.CAP_PROP_AUTO_EXPOSURE: 3,
            cv2.CAP_PROP_EXPOSURE: 156,
            cv2.CAP_PROP_GAIN: 10,
            cv2.CAP_PROP_AUTO_WB: 1,
            cv2.CAP_PROP_WB_TEMPERATURE: 4600,
            cv2.CAP_PROP_SHARPNESS: 3,
        }
        self.stuck: set[int] = set()
        self.raw: np.ndarray[Any, Any] | None = None
        self.grabbed = 0
        self.ends_after: int | None = None
        self.released = False

    def isOpened(self) -> bool:  # noqa: N802 - the name is that of OpenCV
        return not self.released

    def getBackendName(self) -> str:  # noqa: N802
        return self.backend

    def get(self, prop: int) -> float:
        if prop == cv2.CAP_PROP_FOURCC:
            return float(cv2.VideoWriter.fourcc(*self.format.ljust(4)))
        return float(self.controls.get(prop, -1))

    def set(self, prop: int, value: float) -> bool:
        if prop == cv2.CAP_PROP_FOURCC:
            name = int(value).to_bytes(4, "little").decode().strip()
            self.format = name if name in self.formats else self.format
            return name in self.formats
        if prop not in self.controls:
            return False
        if prop not in self.stuck:
            self.controls[prop] = value
        return True

    def grab(self) -> bool:
        time.sleep(0.02)
        self.grabbed += 1
        return self.ends_after is None or self.grabbed <= self.ends_after

    def retrieve(self) -> tuple[bool, np.ndarray[Any, Any]]:
        return True, np.full((24, 32, 3), self.grabbed % 256, np.uint8) if self.raw is None else self.raw

    def release(self) -> None:
        self.released = True
