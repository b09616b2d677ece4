"""The camera class: a thread takes every frame from the driver, so that none waits there and becomes old."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count as numbers
from typing import Any, Self

from numpy.typing import NDArray

from quadfringe.config import SystemConfig
from quadfringe.config.cameras import UvcConfig
from quadfringe.data import AnyShot, Calibration, FrameStamp, Stamp
from quadfringe.data.host_clock import HOST_CLOCK
from quadfringe.devices import CameraStatistics, ChipStatistics, Devices, Keep, open_projector
from quadfringe.devices._queue import DroppingQueue, EndOfQueue
from quadfringe.devices._shots import shot_of
from quadfringe.devices.uvc._source import Source
from quadfringe.errors import CameraError, CameraLostError, CameraWarning, ShotTimeoutError
from quadfringe.io.images import full_scale

__all__ = ["UvcCamera", "open_devices"]

LENGTH = {"latest": 1, "all": 64}  # shots that wait
LOOK_S = 0.1  # interval at which a waiting call looks whether it was interrupted
END_S = 2.0  # wait for the thread of a camera that hangs; OpenCV itself gives up after 10 s


@dataclass(frozen=True)
class _Frame:
    """The images of a frame, and when it came: number since the camera was opened, ns of the monotonic clock."""

    number: int
    arrival_ns: int
    images: dict[str, NDArray[Any]]


class UvcCamera:
    """A colour camera through OpenCV, or a video file; close it, or use it in a `with` block.

    Doubts about its settings, such as compression or an automatic exposure, are a `CameraWarning` and stand in
    `doubts`. Raises `CameraNotFoundError`, `CameraBusyError`, or another `CameraError` that says what the camera
    did not take.
    """

    paced = True

    def __init__(self, config: UvcConfig | None = None) -> None:
        self._asked_for = config or UvcConfig()
        self._source: Source | None = None
        self.config = self._asked_for
        self.doubts: tuple[str, ...] = ()
        self._in_use = threading.Lock()
        self._closed = self._interrupted = False
        self._number = self._damaged = self._passed = self._dropped = 0
        self._queue: DroppingQueue[_Frame] = DroppingQueue(1)
        self._stop, self._reader = threading.Event(), threading.Thread()
        self._connected()

    def __repr__(self) -> str:
        return f"UvcCamera({self.name})"

    @property
    def name(self) -> str:
        """Name of the camera or of the file."""
        return f"uvc:{self._asked_for.device}"

    @property
    def calibration(self) -> Calibration | None:
        """None: a real camera does not know its bench."""
        return None

    def snap(self, timeout_s: float | None = None) -> AnyShot:
        """Take one shot that is exposed after this call; raises a `CameraError` when none arrives in time."""
        self._interrupted = False
        with self._run("all") as queue:  # the first shot and no later one
            shot = self._next(queue, timeout_s)
        if shot is None:
            raise ShotTimeoutError(
                f"{self.name}: no more frames: the video ended, or the call was interrupted; open it again"
            )
        return shot

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:
        """Yield `count` shots, or shots until the iterator is closed, or the file ends."""
        self._interrupted = False
        with self._run(keep) as queue:
            for _ in numbers() if count is None else range(count):
                shot = None if self._interrupted else self._next(queue, None)
                if shot is None:
                    return
                yield shot

    def interrupt(self) -> None:
        """End a stream that waits for a shot in another thread; do nothing without a stream."""
        self._interrupted = True

    @contextmanager
    def _run(self, keep: Keep) -> Iterator[DroppingQueue[_Frame]]:
        """Take frames in a thread, within the block; close a camera that fails, so that the next call opens it."""
        if not self._in_use.acquire(blocking=False):
            raise ValueError(f"{self.name} already streams; close that stream first")
        queue: DroppingQueue[_Frame] = DroppingQueue(LENGTH[keep])
        self._stop = stop = threading.Event()
        try:
            source = self._connected()
            for words in source.controls.changed():
                self._warn(f"{words}; another program or an automatic control changed it")
            reader = threading.Thread(target=self._read, args=(source, queue, stop), name="camera", daemon=True)
            self._queue, self._reader = queue, reader
            with HOST_CLOCK.held():
                reader.start()
                try:
                    yield queue
                except CameraError as error:
                    if not isinstance(error, ShotTimeoutError):
                        self._source = None
                    raise
                finally:
                    stop.set()
                    reader.join(END_S)
                    self._settle(source, queue, hanging=reader.is_alive())
        finally:
            self._in_use.release()

    def _settle(self, source: Source, queue: DroppingQueue[_Frame], *, hanging: bool) -> None:
        """Add up the counts of a run, and close a camera that failed; one that hangs is left to its thread."""
        counts = queue.statistics()
        self._passed += counts.passed
        self._dropped += counts.dropped
        self._queue = DroppingQueue(1)
        if hanging:
            self._source = None
        elif self._source is None:
            source.release()

    def _read(self, source: Source, queue: DroppingQueue[_Frame], stop: threading.Event) -> None:
        """Pass the frames of a camera or file to the queue until the run ends."""
        skip = 0 if source.is_file else source.stale + self._asked_for.skip_frames
        due_s = time.monotonic()
        while not stop.is_set():
            if source.is_file:
                due_s += source.period_s
                if stop.wait(max(due_s - time.monotonic(), 0.0)):
                    return
            if not source.grab():
                queue.end(None if source.is_file else _lost(self.name))
                return
            if skip:
                skip -= 1
                continue
            arrival_ns = time.monotonic_ns()
            try:
                images = source.images()
            except CameraError as error:
                self._damaged += 1
                queue.end(error)
                return
            self._number += 1
            queue.put(_Frame(self._number, arrival_ns, images))

    def _next(self, queue: DroppingQueue[_Frame], timeout_s: float | None) -> AnyShot | None:
        """Wait for a shot; None after an interruption, and at the end of a file."""
        timeout_s = self._asked_for.timeout_s if timeout_s is None else timeout_s
        deadline_s = time.monotonic() + timeout_s
        while True:
            left_s = deadline_s - time.monotonic()
            try:
                return self._shot(queue.get(min(max(left_s, 0.0), LOOK_S)))
            except EndOfQueue:
                return None
            except TimeoutError:
                if self._closed:
                    raise ValueError(f"{self.name} was closed during a wait for a shot") from None
                if self._interrupted:
                    return None
                if left_s <= 0:
                    raise ShotTimeoutError(
                        f"{self.name}: no shot within {timeout_s:g} s; plug it in again, or lower its frame rate"
                    ) from None

    def _shot(self, frame: _Frame) -> AnyShot:
        utc_ns = HOST_CLOCK.utc_ns(frame.arrival_ns)
        stamps = {"visible": FrameStamp(frame.number, frame.arrival_ns, utc_ns)}
        stamp = Stamp(frame.number, utc_ns // 1000, self.name, stamps)
        full = float(full_scale(next(iter(frame.images.values()))))
        return shot_of(frame.images, full, bayer=self._asked_for.bayer, stamp=stamp)

    def _connected(self) -> Source:
        if self._closed:
            raise ValueError(f"{self.name} is closed")
        if self._source is None:
            source = Source(self._asked_for)
            try:
                outcome = source.set_up()
            except BaseException:
                source.release()
                raise
            self._source, self.doubts = source, outcome.doubts
            self.config = self._asked_for.model_copy(update=dict(outcome.accepted))
            for words in outcome.doubts:
                self._warn(words)
        return self._source

    def _warn(self, words: str) -> None:
        warnings.warn(f"{self.name}: {words}", CameraWarning, stacklevel=2)

    def statistics(self) -> CameraStatistics:
        """Return the counts since the camera was opened; safe to call from any thread."""
        now = self._queue.statistics()
        passed, dropped = self._passed + now.passed, self._dropped + now.dropped
        chips = {"visible": ChipStatistics(frames=self._number, damaged=self._damaged)}
        return CameraStatistics(passed + dropped, dropped, chips)

    def close(self) -> None:
        """Release the camera; further calls do nothing."""
        self._closed = True
        self._stop.set()
        if self._reader.is_alive():
            self._reader.join(END_S)
        source, self._source = self._source, None
        if source is not None and not self._reader.is_alive():
            source.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _lost(name: str) -> CameraLostError:
    return CameraLostError(f"{name}: the camera no longer sends frames: check its cable; the next call opens it again")


def open_devices(config: SystemConfig) -> Devices:
    """Open the camera of `capture`, and the projectors of the system."""
    assert isinstance(config.capture, UvcConfig)
    camera = UvcCamera(config.capture)
    try:
        return Devices(camera, open_projector(config), config.model_copy(update={"capture": camera.config}))
    except BaseException:
        camera.close()
        raise
