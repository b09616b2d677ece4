"""A recording as a camera: the same shots with the same stamps, at the pace of their day or at full speed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from threading import Event
from typing import Literal, Self

import numpy as np

from quadfringe.config import SystemConfig
from quadfringe.config.cameras import ReplayConfig
from quadfringe.data import AnyShot, Calibration
from quadfringe.devices import CameraStatistics, Devices, ExternalLight, Keep
from quadfringe.errors import ConfigError, ShotTimeoutError
from quadfringe.recording import Recording

__all__ = ["ReplayCamera", "open_devices"]

MAY_WAIT = {"latest": 1, "all": 64}  # overdue shots that a real camera's queue would still hold


class ReplayCamera:
    """Plays a take once, from its first shot; opening it again begins anew.

    At original speed shots come as far apart as they were exposed, and those that nobody takes in time are dropped as
    those of a camera are. At full speed none is dropped.
    """

    def __init__(self, take: Recording, speed: Literal["original", "full"] = "original") -> None:
        self._take = take
        self._next = self._shots = self._dropped = 0
        self._streaming = False
        self._closed = Event()
        self.paced = speed == "original"

    @property
    def name(self) -> str:
        """The name of the file."""
        return self._take.path.name

    @property
    def calibration(self) -> Calibration | None:
        """The calibration that was recorded."""
        return self._take.calibration

    def snap(self, timeout_s: float | None = None) -> AnyShot:  # noqa: ARG002 - a file keeps nobody waiting
        """Give the next shot, at once; raises `ShotTimeoutError` after the last."""
        self._check_free()
        if self._next == len(self._take):
            raise ShotTimeoutError(f"{self.name}: all {len(self._take)} shots were played; open it again to begin anew")
        return self._read()

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:
        """Give the next shots, until `count` of them came or the take ends."""
        self._check_free()
        return self._play(count, MAY_WAIT[keep])

    def _play(self, count: int | None, may_wait: int) -> Iterator[AnyShot]:
        self._check_free()
        self._streaming = True
        end = len(self._take) if count is None else min(len(self._take), self._next + count)
        due_s = self._take.times_us / 1e6
        due_s += time.monotonic() - (due_s[self._next] if self._next < end else 0.0)
        try:
            while self._next < end and not self._closed.is_set():
                if self.paced and (wait_s := due_s[self._next] - time.monotonic()) > 0:
                    self._closed.wait(wait_s)
                    continue
                if self.paced:
                    overdue = int(np.searchsorted(due_s[self._next : end], time.monotonic(), side="right"))
                    self._drop(overdue - may_wait)
                yield self._read()
        finally:
            self._streaming = False

    def _drop(self, shots: int) -> None:
        if shots > 0:
            self._next += shots
            self._shots += shots
            self._dropped += shots

    def _read(self) -> AnyShot:
        shot = self._take[self._next]
        self._next += 1
        self._shots += 1
        return shot

    def _check_free(self) -> None:
        if self._closed.is_set():
            raise ValueError(f"the replay of {self.name} is closed")
        if self._streaming:
            raise ValueError(f"{self.name} streams already; end that stream first")

    def statistics(self) -> CameraStatistics:
        """Give how many shots were played, and how many of them nobody took in time."""
        return CameraStatistics(shots=self._shots, dropped=self._dropped)

    def close(self) -> None:
        """Close the file; closing twice is allowed."""
        self._closed.set()
        self._take.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def open_devices(config: SystemConfig) -> Devices:
    """Open a take; its recorded settings hold wherever `config` says nothing.

    Raises `InputError` for a file that cannot be read, `ConfigError` for projectors, which a recording cannot see.
    """
    if not isinstance(config.capture, ReplayConfig):
        raise ConfigError(f"capture: expected a replay, got {config.capture.kind}")
    if config.projectors is not None:
        raise ConfigError("projectors: a recording does not see them; leave them out")
    take = Recording(config.capture.file)
    recorded = take.config or SystemConfig()
    # A calibration in another file and the projectors belong to the place of the recording; the take has their result.
    elsewhere = {"calibration": None, "projectors": None}
    said = {name: getattr(config, name) for name in config.model_fields_set}
    merged = recorded.model_copy(update={**elsewhere, **said, "capture": config.capture})
    return Devices(ReplayCamera(take, config.capture.speed), ExternalLight(), merged)
