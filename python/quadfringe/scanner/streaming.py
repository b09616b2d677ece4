"""From camera to shape without pause: capture, decode and whoever looks each at a pace of its own.

Between two paces stands a queue that drops its oldest shot when full and counts it, so that a slow decoder or a slow
view costs shots and never time: what comes out is as fresh as it can be.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Self

from quadfringe.data import AnyShot, Shape
from quadfringe.devices import Camera, CameraStatistics, Keep
from quadfringe.devices._queue import DroppingQueue, EndOfQueue, QueueStatistics
from quadfringe.errors import CameraError, DecodeError

__all__ = ["LiveStream", "Measured", "StreamStatistics", "Tap"]

Tap = Callable[[AnyShot], object]
LENGTH = {"latest": 1, "all": 64}
TAP_LENGTH = 64
RATE_WINDOW_S = 2.0
RETRY_S = 0.5


@dataclass(frozen=True)
class Measured:
    """A shot and what came of it: a shape, or the reason why there is none."""

    shot: AnyShot
    result: Shape | DecodeError
    latency_ms: float

    @property
    def shape(self) -> Shape:
        """The shape; raises the `DecodeError` of a shot that cannot be trusted."""
        if isinstance(self.result, DecodeError):
            raise self.result
        return self.result

    @property
    def error(self) -> DecodeError | None:
        """Why there is no shape; None when there is one."""
        return self.result if isinstance(self.result, DecodeError) else None


@dataclass(frozen=True)
class StreamStatistics:
    """What a stream did until now: its camera, its queues ("decode", "view" and the taps), and its rates.

    `refused` shots could not be trusted; `fault` is what the camera fails with while the stream tries to resume.
    """

    camera: CameraStatistics
    queues: Mapping[str, QueueStatistics]
    captured_per_s: float
    decoded_per_s: float
    refused: int
    fault: str | None


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


class LiveStream:
    """Iterates over `Measured`; close it, or use it in a `with` block. Made by `Scanner.stream`.

    Every tap gets every shot that was captured, in a thread of its own behind a queue of its own. What a tap raises
    ends the stream. A camera that makes shots when asked (`paced` is False) waits for the others, and loses none.
    `decode` is called from as many threads as shots are decoded `at_once`; results come in the order of the shots.
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
    ) -> None:
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

    def _capture(self) -> None:
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
                    self._end(error)
                    return
                self._fault = str(error)
                self._stop.wait(RETRY_S)
            except BaseException as error:
                self._end(error)
                return
        self._end(None)

    def _end(self, error: BaseException | None) -> None:
        """End the queues behind the camera; what waits in them is still worked off."""
        for queue in (self._shots, *(queue for _, queue in self._taps.values())):
            queue.end(error)

    def _decode_all(self) -> None:
        """Decode shots as they come; others may do the same, and every result waits for those of earlier shots."""
        while True:
            try:
                with self._taking:
                    shot, turn = self._shots.get(), self._taken
                    self._taken += 1
            except BaseException as error:
                self._leave(error)
                return
            try:
                result = self._decoded_or_refused(shot)
            except BaseException as error:
                self._fail(error)
                return
            with self._order:
                while self._given != turn and not self._stop.is_set():
                    self._order.wait()
                self._refused += isinstance(result, DecodeError)
                self._decoded.tick()
                latency_ms = (time.time_ns() - _arrival_ns(shot)) / 1e6
                self._results.put(Measured(shot, result, latency_ms), wait=self._wait)
                self._given += 1
                self._order.notify_all()

    def _decoded_or_refused(self, shot: AnyShot) -> Shape | DecodeError:
        try:
            return self._decode(shot)
        except DecodeError as error:
            return error

    def _leave(self, reason: BaseException) -> None:
        """Nothing more is to decode: the last one to leave ends the results."""
        with self._order:
            self._decoders -= 1
            if not self._decoders:
                self._results.end(None if isinstance(reason, EndOfQueue) else reason)

    def _feed(self, tap: Tap, queue: DroppingQueue[AnyShot]) -> None:
        try:
            while True:
                tap(queue.get())
        except EndOfQueue:
            pass
        except CameraError:
            pass  # the camera's own error reaches the caller with the last result
        except BaseException as error:
            self._fail(error)

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
        own = {"decode": self._shots.statistics(), "view": self._results.statistics()}
        return StreamStatistics(
            camera=self._camera.statistics(),
            queues=own | {name: queue.statistics() for name, (_, queue) in self._taps.items()},
            captured_per_s=self._captured.per_s(),
            decoded_per_s=self._decoded.per_s(),
            refused=self._refused,
            fault=self._fault,
        )

    def close(self) -> None:
        """Stop capturing, let the taps have what was captured, and forget the rest; closing twice is allowed."""
        self._stop.set()
        self._results.end(discard=True)
        self._shots.end(discard=True)
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _arrival_ns(shot: AnyShot) -> int:
    """Give when the last frame of a shot was in, in ns of the host's clock."""
    if shot.stamp is None:
        return time.time_ns()
    frames = shot.stamp.frames.values()
    return max((frame.arrival_ns for frame in frames), default=shot.stamp.time_us * 1000)
