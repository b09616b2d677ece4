"""Continuous measurement: capture, decoding and the caller run at different speeds.

A queue between two of them drops its oldest shot when it is full, and counts it. A slow decoder or a slow view
therefore loses shots and does not delay them.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Self

from quadfringe.config import ResponseChoice, shortened
from quadfringe.data import AnyShot, Shape
from quadfringe.data.host_clock import HOST_CLOCK
from quadfringe.devices import Camera, CameraStatistics, Keep
from quadfringe.devices._queue import DroppingQueue, EndOfQueue, QueueStatistics
from quadfringe.errors import CameraError, DecodeError

__all__ = ["LiveStream", "Measured", "StreamStatistics", "Tap"]

Tap = Callable[[AnyShot], object]
LENGTH = {"latest": 1, "all": 64}
TAP_LENGTH = 64
RATE_WINDOW_S = 2.0
RETRY_S, INTERRUPT_S = 0.5, 0.1  # pauses between attempts to reach a camera, and to end its wait for a shot
FORKED = (
    "the stream measures in the process that opened it, not in this forked one; open the scanner here, in processes "
    'that multiprocessing starts with "spawn"'
)


@dataclass(frozen=True)
class Measured:
    """A shot and its shape, or the reason why it has none.

    Either `shape` or `error` is None. `latency_ms` is the time from the arrival of the last frame to the shape.
    """

    shot: AnyShot
    shape: Shape | None
    error: DecodeError | None
    latency_ms: float

    def result(self) -> Shape:
        """Give the shape; raises the `DecodeError` of a shot that cannot be trusted."""
        if self.error is not None:
            raise self.error
        assert self.shape is not None, "a shot has a shape or an error"
        return self.shape


@dataclass(frozen=True, repr=False)
class StreamStatistics:
    """The state of a stream: its camera, its queues ("decode", "view" and the taps), and its rates.

    `refused` is the number of shots that could not be trusted; `fault` the error of the camera while the stream tries
    to resume; `response` the response that is corrected, "auto" until a sound shot was decoded.
    """

    camera: CameraStatistics
    queues: Mapping[str, QueueStatistics]
    captured_per_s: float
    decoded_per_s: float
    refused: int
    fault: str | None
    response: ResponseChoice

    def __repr__(self) -> str:
        dropped = {name: queue.dropped for name, queue in self.queues.items()}
        rates = f"captured_per_s={self.captured_per_s:.1f}, decoded_per_s={self.decoded_per_s:.1f}"
        state = f"refused={self.refused}, dropped={dropped}, fault={self.fault!r}, response={self.response!r}"
        return shortened(f"StreamStatistics({rates}, {state})")


class _Rate:
    """Events per second over the last two seconds."""

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=4096)

    def tick(self) -> None:
        self._times.append(time.monotonic())

    def per_s(self) -> float:
        since = time.monotonic() - RATE_WINDOW_S
        recent = [moment for moment in tuple(self._times) if moment > since]
        return (len(recent) - 1) / (recent[-1] - recent[0]) if len(recent) > 1 else 0.0


class _ErrorsTo:
    """Passes an error that ends its block to `receive`; an error that ended a thread would be lost."""

    def __init__(self, receive: Callable[[BaseException], None]) -> None:
        self._receive = receive

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: object, error: BaseException | None, _traceback: object) -> bool:
        if error is not None:
            self._receive(error)
        return error is not None


class LiveStream:
    """Iterates over `Measured`; close it, or use it in a `with` block. Made by `Scanner.stream`.

    Every tap gets the captured shots, in a thread with a queue of 64 shots before it; a tap that is slower than the
    camera for longer, such as a recorder on a slow disk, loses the oldest of them, and `statistics().queues` counts
    those. An error of a tap ends the stream. A camera that makes shots on request (`paced` is False) waits for the
    others, so that no shot is lost. `decode` is called from `at_once` threads; results come in the order of the shots.
    While `response()` is "auto", shots are decoded one after another, and their order decides the estimate.
    """

    def __init__(
        self,
        camera: Camera,
        decode: Callable[[AnyShot], Shape],
        count: int | None = None,
        *,
        keep: Keep = "latest",
        taps: Mapping[str, Tap] | None = None,
        resume: bool = False,
        at_once: int = 1,
        response: Callable[[], ResponseChoice] = lambda: "linear",
    ) -> None:
        self._response, self._process = response, os.getpid()
        self._camera, self._decode, self._count, self._resume = camera, decode, count, resume
        self._wait = not camera.paced
        self._stop = threading.Event()
        self._fault: str | None = None
        self._refused = 0
        self._captured, self._decoded = _Rate(), _Rate()
        self._shots: DroppingQueue[AnyShot] = DroppingQueue(LENGTH[keep])
        self._results: DroppingQueue[Measured] = DroppingQueue(LENGTH[keep])
        self._taps = {name: (tap, DroppingQueue[AnyShot](TAP_LENGTH)) for name, tap in (taps or {}).items()}
        self._taking, self._order = threading.Lock(), threading.Condition()
        self._taken = self._given = 0
        self._decoders = at_once
        self._threads = [threading.Thread(target=self._capture, name="capture", daemon=True)]
        self._threads += [threading.Thread(target=self._decode_all, name="decode", daemon=True) for _ in range(at_once)]
        self._threads += [
            threading.Thread(target=self._feed, args=pair, name=name, daemon=True) for name, pair in self._taps.items()
        ]
        for thread in self._threads:
            thread.start()

    def __repr__(self) -> str:
        ended = ", ended" if self._stop.is_set() else ""
        return shortened(f"LiveStream({self._camera!r}, {self._given} shots decoded{ended})")

    def _capture(self) -> None:
        with _ErrorsTo(self._end), HOST_CLOCK.held():
            self._capture_all()
        self._end(None)

    def _capture_all(self) -> None:
        left = self._count
        while not self._stop.is_set() and left != 0:
            try:
                for shot in self._camera.stream(left, keep="all"):
                    self._fault = None
                    self._captured.tick()
                    for queue in (self._shots, *(queue for _, queue in self._taps.values())):
                        queue.put(shot, wait=self._wait)
                    left = None if left is None else left - 1
                    if self._stop.is_set():
                        break
                else:
                    break
            except CameraError as error:
                if not self._resume:
                    raise
                self._fault = str(error)
                self._stop.wait(RETRY_S)

    def _end(self, error: BaseException | None) -> None:
        """End the queues behind the camera; shots that wait in them are still processed."""
        for queue in (self._shots, *(queue for _, queue in self._taps.values())):
            queue.end(error)

    def _decode_all(self) -> None:
        """Decode shots as they come; other threads do the same, and every result waits for all earlier ones."""
        while True:
            with self._taking:
                shot = None
                with _ErrorsTo(self._leave):
                    shot, turn = self._shots.get(), self._taken
                    self._taken += 1
                if shot is None:
                    return
                one_by_one = self._response() == "auto"
                result = self._result_of(shot) if one_by_one else None
            if not one_by_one:
                result = self._result_of(shot)
            if result is None:
                return
            self._give(shot, result, turn)

    def _result_of(self, shot: AnyShot) -> Shape | DecodeError | None:
        """Give the shape of a shot or why it has none; None after any other error, which ends the stream."""
        with _ErrorsTo(self._fail):
            try:
                return self._decode(shot)
            except DecodeError as error:
                return error
        return None

    def _give(self, shot: AnyShot, result: Shape | DecodeError, turn: int) -> None:
        """Hand over a result after the results of all earlier shots."""
        shape, error = (None, result) if isinstance(result, DecodeError) else (result, None)
        with self._order:
            while self._given != turn and not self._stop.is_set():
                self._order.wait()
            self._refused += error is not None
            self._decoded.tick()
            latency_ms = (HOST_CLOCK.now_ns() - _arrival_ns(shot)) / 1e6
            self._results.put(Measured(shot, shape, error, latency_ms), wait=self._wait)
            self._given += 1
            self._order.notify_all()

    def _leave(self, reason: BaseException) -> None:
        """End this thread because no shots are left; the last thread ends the results."""
        with self._order:
            self._decoders -= 1
            if not self._decoders:
                self._results.end(None if isinstance(reason, EndOfQueue) else reason)

    def _feed(self, tap: Tap, queue: DroppingQueue[AnyShot]) -> None:
        # The error of the camera reaches the caller with the last result.
        with _ErrorsTo(self._fail), suppress(EndOfQueue, CameraError):
            while True:
                tap(queue.get())

    def _fail(self, error: BaseException) -> None:
        self._stop.set()
        self._results.end(error)
        self._shots.end()
        for _, queue in self._taps.values():
            queue.end()
        with self._order:
            self._order.notify_all()

    def __iter__(self) -> Iterator[Measured]:
        return self

    def __next__(self) -> Measured:
        if os.getpid() != self._process:
            raise RuntimeError(FORKED)
        try:
            return self._results.get()
        except EndOfQueue:
            self.close()
            raise StopIteration from None
        except BaseException:
            self.close()
            raise

    def statistics(self) -> StreamStatistics:
        """Give rates, queues and counts, at any time and from any thread."""
        queues = {"decode": self._shots.statistics(), "view": self._results.statistics()}
        return StreamStatistics(
            camera=self._camera.statistics(),
            queues=queues | {name: queue.statistics() for name, (_, queue) in self._taps.items()},
            captured_per_s=self._captured.per_s(),
            decoded_per_s=self._decoded.per_s(),
            refused=self._refused,
            fault=self._fault,
            response=self._response(),
        )

    def close(self) -> None:
        """Stop capturing, let the taps finish, and drop other waiting shots; closing twice is allowed."""
        self._stop.set()
        self._results.end(discard=True)
        self._shots.end(discard=True)
        for thread in self._threads:
            while thread is not threading.current_thread() and thread.is_alive():
                self._camera.interrupt()  # again and again: the thread may only now begin to wait for a shot
                thread.join(INTERRUPT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _arrival_ns(shot: AnyShot) -> int:
    """Give the time at which the last frame of a shot arrived, in ns of the host's clock."""
    if shot.stamp is None:
        return HOST_CLOCK.now_ns()
    frames = shot.stamp.frames.values()
    return max((frame.arrival_ns for frame in frames), default=shot.stamp.time_us * 1000)
