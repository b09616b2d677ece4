"""Continuous measurement: dropped shots are counted, failures are reported, and no call blocks for ever."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from types import TracebackType
from typing import Self

import numpy as np
import pytest

from quadfringe.config import SystemConfig, load_system
from quadfringe.data import AnyShot, Shape, Shot, Stamp
from quadfringe.devices import CameraStatistics, ExternalLight, Keep, open_camera
from quadfringe.devices._queue import DroppingQueue, EndOfQueue
from quadfringe.errors import CameraLostError, DecodeError
from quadfringe.scanner import Scanner, open_system
from quadfringe.scanner.streaming import LiveStream

BLANK = np.zeros((2, 2), np.uint8)
FLAT = Shape(*[np.zeros((2, 2), np.float32)] * 4)


class ScriptedCamera:
    """A camera that gives shots at a fixed rate and raises the errors of a script."""

    name = "scripted"
    calibration = None

    def __init__(self, script: list[int | Exception], *, paced: bool = True, period_s: float = 0.0) -> None:
        self.script, self.paced, self.period_s = script, paced, period_s
        self.closed = False

    def snap(self, timeout_s: float | None = None) -> AnyShot:  # noqa: ARG002
        return next(self.stream(1))

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:  # noqa: ARG002
        while self.script and count != 0:
            one = self.script.pop(0)
            if isinstance(one, Exception):
                raise one
            time.sleep(self.period_s)
            count = None if count is None else count - 1
            yield Shot(BLANK, BLANK, BLANK, BLANK, stamp=Stamp(one, time.time_ns() // 1000, self.name))

    def interrupt(self) -> None:
        pass

    def statistics(self) -> CameraStatistics:
        return CameraStatistics()

    def close(self) -> None:
        self.closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def numbered(shot: AnyShot) -> Shape:
    assert shot.id is not None
    if shot.id < 0:
        raise DecodeError("dark")
    return replace(FLAT, config={"id": shot.id})


def ids(stream: LiveStream) -> list[int]:
    return [measured.shape.config["id"] for measured in stream]


def test_a_camera_that_is_asked_loses_nothing() -> None:
    def slow(shot: AnyShot) -> Shape:
        time.sleep(0.005)
        return numbered(shot)

    taken: list[int | None] = []
    camera = ScriptedCamera(list(range(30)), paced=False)
    with LiveStream(camera, slow, taps={"record": lambda shot: taken.append(shot.id)}) as stream:
        assert ids(stream) == list(range(30))
        queues = stream.statistics().queues
    assert taken == list(range(30))
    assert [queue.dropped for queue in queues.values()] == [0, 0, 0]


def test_a_slow_decoder_gets_the_newest_and_a_tap_gets_all() -> None:
    def slow(shot: AnyShot) -> Shape:
        time.sleep(0.05)
        return numbered(shot)

    taken: list[int | None] = []
    camera = ScriptedCamera(list(range(50)), period_s=0.004)
    with LiveStream(camera, slow, taps={"record": lambda shot: taken.append(shot.id)}) as stream:
        came = ids(stream)
        queues = stream.statistics().queues
    assert came == sorted(set(came))
    assert came[-1] == 49, "the newest is never dropped"
    assert queues["decode"].dropped + len(came) == 50
    assert queues["decode"].dropped > 0
    assert queues["record"].dropped == 0
    assert taken == list(range(50))


def test_a_slow_viewer_gets_the_newest() -> None:
    with LiveStream(ScriptedCamera(list(range(50)), period_s=0.004), numbered) as stream:
        time.sleep(0.5)
        came = ids(stream)
        assert came == [49]
        assert stream.statistics().queues["view"].dropped + stream.statistics().queues["decode"].dropped == 49


def test_a_shot_that_cannot_be_trusted_does_not_end_the_stream() -> None:
    with LiveStream(ScriptedCamera([1, -2, 3], paced=False), numbered) as stream:
        first, second, third = stream
        assert stream.statistics().refused == 1
    assert (first.error, third.error) == (None, None)
    assert second.error is not None
    with pytest.raises(DecodeError, match="dark"):
        second.result()


def test_a_lost_camera_ends_the_stream_with_its_error_after_what_was_taken() -> None:
    stream = LiveStream(ScriptedCamera([1, 2, CameraLostError("gone")], paced=False), numbered, keep="all")
    came = []
    with pytest.raises(CameraLostError, match="gone"):
        came.extend(measured.shot.id for measured in stream)
    assert came == [1, 2]


def test_a_lost_camera_is_asked_again() -> None:
    script: list[int | Exception] = [1, CameraLostError("gone"), 2, 3]
    with LiveStream(ScriptedCamera(script, paced=False), numbered, 3, resume=True) as stream:
        assert next(stream).shot.id == 1
        deadline = time.monotonic() + 5
        while stream.statistics().fault is None and time.monotonic() < deadline:
            time.sleep(0.01)
        assert stream.statistics().fault == "gone"
        assert ids(stream) == [2, 3]
        assert stream.statistics().fault is None


def test_shots_decoded_at_once_come_out_in_their_order() -> None:
    inside, most = 0, 0
    lock = threading.Lock()

    def uneven(shot: AnyShot) -> Shape:
        nonlocal inside, most
        assert shot.id is not None
        with lock:
            inside += 1
            most = max(most, inside)
        time.sleep(0.02 if shot.id % 3 == 0 else 0.001)
        with lock:
            inside -= 1
        return numbered(shot)

    script: list[int | Exception] = [*range(1, 30), CameraLostError("gone")]
    came = []
    with (
        LiveStream(ScriptedCamera(script, paced=False), uneven, keep="all", at_once=2) as stream,
        pytest.raises(CameraLostError, match="gone"),
    ):
        came.extend(measured.shape.config["id"] for measured in stream)
    assert came == list(range(1, 30)), "also what was being decoded when the camera was lost"
    assert most == 2


@pytest.mark.parametrize("at_once", [1, 2])
@pytest.mark.parametrize("where", ["decode", "tap"])
def test_what_goes_wrong_in_a_thread_reaches_the_caller(where: str, at_once: int) -> None:
    def fails(_: AnyShot) -> Shape:
        raise OSError("disk full")

    camera = ScriptedCamera(list(range(1000)), paced=False)
    taps = {"record": fails} if where == "tap" else {}
    with (
        LiveStream(camera, fails if where == "decode" else numbered, taps=taps, at_once=at_once) as stream,
        pytest.raises(OSError, match="disk full"),
    ):
        ids(stream)


def test_closing_ends_every_thread() -> None:
    before = threading.active_count()
    camera = ScriptedCamera(list(range(10**6)), paced=False)
    stream = LiveStream(camera, numbered, taps={"x": lambda _: None}, at_once=2)
    next(stream)
    stream.close()
    stream.close()
    assert threading.active_count() == before
    with pytest.raises(StopIteration):
        next(stream)


def test_a_second_stream_ends_the_first_and_the_scanner_ends_all() -> None:
    camera = ScriptedCamera(list(range(10**6)), paced=False)
    with Scanner(SystemConfig(), ExternalLight(), camera, None) as scanner:
        scanner.decode = numbered  # type: ignore[method-assign]
        first = scanner.stream()
        next(first)
        second = scanner.stream()
        with pytest.raises(StopIteration):
            next(first)
        next(second)
        assert scanner.calibration is None
    assert camera.closed
    with pytest.raises(StopIteration):
        next(second)


SMALL = """
capture = { kind = "virtual", frame_rate_hz = 30 }
camera = { width_px = 256, height_px = 192, focal_px = [645.0, 645.0], centre_px = [127.5, 95.5] }
scene = { surface = "hand", noise = 0.01 }
"""


def test_a_moving_hand_on_the_virtual_bench(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "system.toml").write_text(SMALL)
    with open_system(load_system(tmp_path / "system.toml")) as scanner, scanner.stream(3, keep="all") as stream:
        shots = [measured.shot for measured in stream]
    assert [shot.id for shot in shots] == [1, 2, 3]
    truths = [shot.truth.xyz_mm for shot in shots if shot.truth is not None]
    assert not np.array_equal(truths[0], truths[1], equal_nan=True), "the hand moves"


def test_a_virtual_camera_alone() -> None:
    with open_camera("virtual:") as camera:
        assert camera.snap().id == 1
        assert camera.statistics().shots == 1
    with pytest.raises(ValueError, match="closed"):
        camera.snap()


def test_a_queue_ends_with_its_error_after_what_waits() -> None:
    queue: DroppingQueue[int] = DroppingQueue(3)
    for number in range(5):
        queue.put(number)
    queue.end(OSError("cut"))
    queue.put(9)
    assert [queue.get(), queue.get(), queue.get()] == [2, 3, 4]
    with pytest.raises(OSError, match="cut"):
        queue.get()
    assert (queue.statistics().passed, queue.statistics().dropped) == (3, 2)
    empty: DroppingQueue[int] = DroppingQueue(1)
    with pytest.raises(TimeoutError, match=r"within 0\.01 s"):
        empty.get(0.01)
    empty.end()
    with pytest.raises(EndOfQueue):
        empty.get()
