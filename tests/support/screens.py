"""Screens of the computer that keep what they show, and a webcam that looks at the first of them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from quadfringe.config import HdmiProjectorConfig
from support.videos import FakeCapture, let_opencv_open

SIZE_PX = (1280, 720)
GAMMA = 2.2
SYSTEM = """
capture = "uvc:0"

[projectors.visible]
kind = "hdmi"
output = "HDMI-1"
size_px = [1280, 720]
settle_s = 0.0
frame_rate_hz = 60
"""


class FakeWindow:
    """A screen of the computer, which keeps what it shows."""

    opened: list[FakeWindow]

    def __init__(self, output: str | None, size_px: tuple[int, int]) -> None:
        self.output, self.size_px = output or "HDMI-1", size_px
        self.image = np.zeros((*size_px[::-1], 3), np.uint8)
        self.lit, self.closed = 1.0, False
        self.follows = 0.0  # how much the lamp follows the image before, as an automatic iris does
        FakeWindow.opened.append(self)

    def show(self, image: NDArray[np.uint8]) -> None:
        assert image.shape == self.image.shape
        assert image.flags.c_contiguous
        self.lit = 1 - self.follows * float(self.image.mean()) / 255
        self.image = image

    def close(self) -> None:
        self.closed = True

    def __enter__(self) -> FakeWindow:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def photograph(self) -> NDArray[np.uint8]:
        """What a linear camera sees of it on a white wall: blue, green, red of 8 bit."""
        small = cv2.resize(self.image, (320, 180), interpolation=cv2.INTER_AREA).astype(np.float64) / 255
        light = 0.02 + 0.85 * self.lit * small**GAMMA
        noise = np.random.default_rng(int(1e6 * small.sum()) % 2**32).normal(0, 0.004, light.shape)
        return np.clip(np.round(255 * (light + noise)), 0, 255).astype(np.uint8)[:, :, ::-1]


def screen(**settings: object) -> HdmiProjectorConfig:
    return HdmiProjectorConfig(**({"size_px": SIZE_PX, "frame_rate_hz": 60.0, "settle_s": 0.0} | settings))  # type: ignore[arg-type]


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> list[FakeWindow]:
    FakeWindow.opened = []
    monkeypatch.setattr("quadfringe.devices.hdmi.PatternWindow", FakeWindow)
    return FakeWindow.opened


@pytest.fixture
def capture(monkeypatch: pytest.MonkeyPatch, windows: list[FakeWindow]) -> FakeCapture:
    """A webcam that looks at the first screen."""

    class Looking(FakeCapture):
        def retrieve(self) -> tuple[bool, NDArray[np.uint8]]:
            return True, windows[0].photograph()

    fake = Looking(("YUYV",))
    fake.controls[cv2.CAP_PROP_EXPOSURE] = 167  # a frame
    let_opencv_open(fake, monkeypatch)
    return fake
