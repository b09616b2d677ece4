"""A recording as a camera: the same shots with the same stamps, at their original pace or at full speed."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from threading import TIMEOUT_MAX, Event
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import SystemConfig
from quadfringe.config.cameras import AravisConfig, ReplayConfig
from quadfringe.data import AnyShot, Calibration
from quadfringe.devices import CameraStatistics, ChipStatistics, Devices, ExternalLight, Keep
from quadfringe.errors import ConfigError, InputError, RecordingWarning, ShotTimeoutError
from quadfringe.recording import Recording

__all__ = ["ReplayCamera", "open_devices"]

MAY_WAIT = {"latest": 1, "all": 64}  # overdue shots that the queue of a real camera would hold


class ReplayCamera:
    """Plays a recording once from its first shot; open it again to play it again.

    At original speed, shots come at the intervals of their exposures, and shots that are not taken in time are dropped
    as by a real camera. At full speed, no shot is dropped. A damaged shot is an `InputError` of `snap`; a stream warns
    of it with `RecordingWarning` and goes on. Both count it as a damaged frame of the chip "recording".
    A shot that cannot be read now, damaged or not, is a `RecordingError` of both.
    """

    def __init__(self, recording: Recording, speed: Literal["original", "full"] = "original") -> None:
        self._recording = recording
        self._next = self._shots = self._dropped = self._damaged = 0
        self._streaming = False
        self._closed, self._interrupted = Event(), Event()
        self.paced = speed == "original"

    def __repr__(self) -> str:
        return f"ReplayCamera({self._recording!r}, {self._next} played)"

    @property
    def name(self) -> str:
        """Name of the file."""
        return self._recording.path.name

    @property
    def calibration(self) -> Calibration | None:
        """The calibration in the recording."""
        return self._recording.calibration

    def snap(self, timeout_s: float | None = None) -> AnyShot:  # noqa: ARG002 - a file never waits
        """Return the next shot at once; raises `ShotTimeoutError` after the last."""
        self._check_free()
        if self._next == len(self._recording):
            raise ShotTimeoutError(
                f"{self.name}: all {len(self._recording)} shots were played; open the recording again to play it again"
            )
        return self._read()

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:
        """Yield the next shots, up to `count`, until the recording ends."""
        self._check_free()
        return self._play(count, MAY_WAIT[keep])

    def _play(self, count: int | None, may_wait: int) -> Iterator[AnyShot]:
        self._check_free()
        self._streaming = True
        self._interrupted.clear()
        end = len(self._recording) if count is None else min(len(self._recording), self._next + count)
        due_s = self._due_s()
        due_s += time.monotonic() - (due_s[self._next] if self._next < end else 0.0)
        try:
            while self._next < end and not self._interrupted.is_set():
                if self.paced and (wait_s := due_s[self._next] - time.monotonic()) > 0:
                    self._interrupted.wait(min(wait_s, TIMEOUT_MAX))
                    continue
                if self.paced:
                    overdue = int(np.searchsorted(due_s[self._next : end], time.monotonic(), side="right"))
                    self._drop(overdue - may_wait)
                try:
                    shot = self._read()
                except InputError as error:
                    warnings.warn(str(error), RecordingWarning, stacklevel=2)
                else:
                    yield shot
        finally:
            self._streaming = False

    def interrupt(self) -> None:
        """End a stream that waits for the time of its next shot."""
        self._interrupted.set()

    def _due_s(self) -> NDArray[np.float64]:
        """Return the time of every exposure, s; of a shot without a sound stamp, that between its neighbours."""
        times_us, stamped = self._recording.times_us, np.flatnonzero(self._recording.stamped)
        if not len(stamped):
            return np.zeros(len(times_us))
        due_s: NDArray[np.float64] = np.interp(np.arange(len(times_us)), stamped, times_us[stamped]) / 1e6
        return due_s

    def _drop(self, shots: int) -> None:
        if shots > 0:
            self._next += shots
            self._shots += shots
            self._dropped += shots

    def _read(self) -> AnyShot:
        index = self._next
        self._next += 1
        try:
            shot = self._recording[index]
        except InputError:
            self._damaged += 1
            raise
        self._shots += 1
        return shot

    def _check_free(self) -> None:
        if self._closed.is_set():
            raise ValueError(f"the replay of {self.name} is closed")
        if self._streaming:
            raise ValueError(f"{self.name} already streams; close that stream first")

    def statistics(self) -> CameraStatistics:
        """Return how many shots were played, how many of them were dropped, and how many others were damaged."""
        chips = {"recording": ChipStatistics(damaged=self._damaged)} if self._damaged else {}
        return CameraStatistics(shots=self._shots, dropped=self._dropped, chips=chips)

    def close(self) -> None:
        """Close the file; further calls do nothing."""
        self._closed.set()
        self._interrupted.set()
        self._recording.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def open_devices(config: SystemConfig) -> Devices:
    """Open a recording; its recorded settings apply wherever `config` sets nothing.

    Raises `InputError` for an unreadable file, and `ConfigError` for projectors, which a recording cannot use.
    """
    if not isinstance(config.capture, ReplayConfig):
        raise ConfigError(f"capture: expected a replay, got {config.capture.kind}")
    if config.projectors is not None:
        raise ConfigError("projectors: a recording cannot use them; leave them out")
    recording = Recording(config.capture.file)
    recorded = recording.config or SystemConfig()
    # The recorded paths of projectors and calibration file are void here; the recording contains the calibration. The
    # size of a projector that was a screen still says how many columns the fringes cover; nothing opens it.
    screens = recorded.projectors if recorded.projectors is not None and not recorded.projectors.lightcrafters else None
    elsewhere = {"calibration": None, "projectors": screens}
    said = {name: getattr(config, name) for name in config.model_fields_set}
    merged = recorded.model_copy(update={**elsewhere, **said, "capture": config.capture})
    seen = recorded.capture.visible.offset_px if isinstance(recorded.capture, AravisConfig) else None
    return Devices(ReplayCamera(recording, config.capture.speed), ExternalLight(), merged, seen)
