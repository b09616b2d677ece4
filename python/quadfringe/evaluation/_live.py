"""Parts of measurements of the live view: a camera that repeats shots, and the first message of a browser."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import cycle
from typing import Any

from quadfringe.data import AnyShot, Stamp
from quadfringe.data.host_clock import HOST_CLOCK
from quadfringe.devices import CameraStatistics, Keep

__all__ = ["VIEWPOINT", "Carousel"]

# What the page sends when it opens. The server takes a client without a viewpoint as not there yet.
VIEWPOINT: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 0.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 800,
    "image_width": 1280,
    "look_at": (0.0, 0.0, 1.0),
    "up_direction": (0.0, -1.0, 0.0),
}


class Carousel:
    """A camera that repeats the same shots `rate_hz` times a second; `given` counts them."""

    name, paced, calibration = "carousel", True, None

    def __init__(self, shots: list[AnyShot], rate_hz: float) -> None:
        self._shots, self._rate_hz = shots, rate_hz
        self.given = 0

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:  # noqa: ARG002
        """Give the shots without end, each with another number and time."""
        due = time.monotonic()
        for shot in cycle(self._shots):
            due += 1 / self._rate_hz
            time.sleep(max(0.0, due - time.monotonic()))
            self.given += 1
            yield replace(shot, stamp=Stamp(self.given, HOST_CLOCK.now_ns() // 1000, self.name))

    def interrupt(self) -> None:
        """End nothing: no shot is waited for."""

    def statistics(self) -> CameraStatistics:
        """Count the shots that were given."""
        return CameraStatistics(shots=self.given)
