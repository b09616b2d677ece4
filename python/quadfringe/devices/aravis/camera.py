"""The camera classes for users: snap, stream, counts, and errors that name the likely cause."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count as numbers
from typing import Generic, Literal, Self, TypeVar

from quadfringe.config import SystemConfig
from quadfringe.config.cameras import AravisConfig
from quadfringe.data import AnyShot, Calibration, ChipImage
from quadfringe.data.host_clock import HOST_CLOCK
from quadfringe.devices import CameraStatistics, ChipStatistics, Devices, Keep, open_projector
from quadfringe.devices._queue import DroppingQueue
from quadfringe.devices.aravis._link import Link
from quadfringe.devices.aravis._profiles import CHIPS
from quadfringe.errors import CameraError, CameraLostError, ShotTimeoutError, UnpairedError, WrongFrameError

__all__ = ["AravisCamera", "ChipCamera", "open_devices"]

LENGTH = {"latest": 1, "all": 64}  # shots that wait: with "all" two seconds at 30 Hz
# How long a busy or missing camera is retried, s: at first briefly, after a loss longer than the 3 s heartbeat
# for which the camera still holds the lost connection.
FIRST_PATIENCE_S, AGAIN_PATIENCE_S = 1.0, 5.0
LOOK_S = 0.25  # interval at which a waiting call checks that the camera still answers
SILENT_S = 0.5  # a chip that has sent nothing for this time is pinged
Item = TypeVar("Item", bound=AnyShot | ChipImage)


class _Running(Generic[Item]):
    """What a camera of two chips and a single chip have in common: everything except the type of the result."""

    paced = True

    def __init__(self, config: AravisConfig | None, chips: tuple[str, ...], *, shots: bool) -> None:
        self._asked_for = config or AravisConfig()
        self._shots = shots
        self._link: Link | None = Link(self._asked_for, chips, patience_s=FIRST_PATIENCE_S, shots=shots)
        self._chip_names = self._link.chips
        self.config = self._link.config
        self.name = self._link.name
        self._in_use = threading.Lock()
        self._closed = self._interrupted = False
        self._last_id = 0
        self._queue: DroppingQueue[Item] = DroppingQueue(1)
        self._earlier = (0, 0)  # delivered and dropped shots of earlier runs
        self._before = {chip: ChipStatistics() for chip in self._chip_names}  # of lost connections

    def snap(self, timeout_s: float | None = None, *, borrow: bool = False) -> Item:
        """Take one shot that is exposed after this call; raises a `CameraError` when none arrives in time."""
        self._interrupted = False
        with self._run("all", borrow) as (link, queue):  # the first shot and no later one
            shot = self._next(link, queue, timeout_s)
        if shot is None:
            raise ShotTimeoutError(f"camera at {self.name}: interrupted before a shot came; call again")
        return shot

    def stream(self, count: int | None = None, *, keep: Keep = "latest", borrow: bool = False) -> Iterator[Item]:
        """Yield `count` shots, or until the iterator is closed; raises `CameraError` when none arrives in time."""
        self._interrupted = False
        with self._run(keep, borrow) as (link, queue):
            for _ in numbers() if count is None else range(count):
                shot = None if self._interrupted else self._next(link, queue, None)
                if shot is None:
                    return
                yield shot

    def interrupt(self) -> None:
        """End a stream that waits for a shot in another thread; do nothing without a stream."""
        self._interrupted = True

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name})"

    @contextmanager
    def _run(self, keep: Keep, borrow: bool) -> Iterator[tuple[Link, DroppingQueue[Item]]]:
        if not self._in_use.acquire(blocking=False):
            raise ValueError(f"camera at {self.name} already streams; close that stream first")
        try:
            link = self._connected()
            length = min(LENGTH[keep], max(link.config.buffers // 3, 1)) if borrow else LENGTH[keep]
            self._earlier = self._counts()
            self._queue, self._first_id = DroppingQueue(length), self._last_id + 1
            try:
                _check_connected(link, 0.0)
                with HOST_CLOCK.held():
                    link.start(self._queue.put, borrow=borrow)
                    yield link, self._queue
            except ShotTimeoutError:
                raise  # the camera is still connected
            except CameraError as error:
                lost = isinstance(error, CameraLostError)
                link.stop(lost=lost)
                self._disconnect(lost=lost)
                raise
            finally:
                link.stop()
        finally:
            self._in_use.release()

    def _connected(self) -> Link:
        if self._closed:
            raise ValueError(f"camera at {self.name} is closed")
        if self._link is None:
            self._link = Link(self._asked_for, self._chip_names, patience_s=AGAIN_PATIENCE_S, shots=self._shots)
        return self._link

    def _disconnect(self, *, lost: bool = False) -> None:
        if self._link is not None:
            self._before = self._chips()
            self._link.forget(lost=lost)
            self._link = None

    def _next(self, link: Link, queue: DroppingQueue[Item], timeout_s: float | None) -> Item | None:
        """Wait for a shot; None after an interruption."""
        timeout_s = link.config.timeout_s if timeout_s is None else timeout_s
        before = self._chips()
        if link.config.trigger == "software":
            link.trigger()
        deadline = time.monotonic() + timeout_s
        while True:
            left_s = deadline - time.monotonic()
            try:
                shot = queue.get(min(max(left_s, 0.0), LOOK_S))
            except TimeoutError:
                if self._interrupted:
                    return None
                if self._closed:
                    raise ValueError(f"camera at {self.name} was closed during a wait for a shot") from None
                _check_connected(link, SILENT_S)
                if left_s <= 0:
                    raise self._diagnosis(link, before, timeout_s) from None
                continue
            assert shot.stamp is not None
            self._last_id = self._first_id + shot.stamp.id
            return replace(shot, stamp=replace(shot.stamp, id=self._last_id))

    def _diagnosis(self, link: Link, before: dict[str, ChipStatistics], timeout_s: float) -> CameraError:
        """Return the error that names the likely reason why no shot arrived in time."""
        now = self._chips()
        chips = self._chip_names
        came = {chip: now[chip].frames - before[chip].frames for chip in chips}
        head = f"camera at {self.name}: no shot within {timeout_s:g} s: "
        for n, (chip, reader) in enumerate(zip(chips, link.readers, strict=True)):
            if not came[chip] and now[chip].damaged > before[chip].damaged:
                fault = reader.fault
                hint = _packet_hint(link, n) if reader.incomplete else ""
                return WrongFrameError(f"{head}frames of the {chip} chip were rejected, the last one: {fault}{hint}")
        if all(came.values()):
            return UnpairedError(
                f"{head}frames of both chips arrived, but none of the same instant; synchronise the chips"
            )
        if any(came.values()):
            there, missing = sorted(chips, key=lambda chip: -came[chip])
            return UnpairedError(
                f"{head}frames of the {there} chip arrived, but none of the {missing} chip; check its cable"
            )
        trigger = link.config.trigger
        cause = "it runs freely" if trigger == "free" else f"it waits for trigger {trigger}"
        return ShotTimeoutError(
            f"{head}it answers but sends no frames ({cause}); check trigger, firewall and packet size"
        )

    def _chips(self) -> dict[str, ChipStatistics]:
        link = self._link
        if link is None or not link.readers:
            return self._before
        chips = {}
        for n, (chip, reader) in enumerate(zip(self._chip_names, link.readers, strict=True)):
            so_far = self._before[chip]
            chips[chip] = ChipStatistics(
                so_far.frames + reader.frames,
                so_far.damaged + reader.damaged,
                so_far.missed + link.matcher.missed[n],
                so_far.unpaired + link.matcher.unpaired[n],
            )
        return chips

    def statistics(self) -> CameraStatistics:
        """Return the counts since the camera was opened; safe to call from any thread."""
        return CameraStatistics(*self._counts(), self._chips())

    def _counts(self) -> tuple[int, int]:
        now = self._queue.statistics()
        return self._earlier[0] + now.passed + now.dropped, self._earlier[1] + now.dropped

    def close(self) -> None:
        """Stop and release the camera; further calls do nothing."""
        self._closed = True
        if self._link is not None:
            self._link.stop()
        self._disconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


class AravisCamera(_Running[AnyShot]):
    """A GenICam camera with two chips, or with one colour chip; close it, or use it in a `with` block.

    Shots hold copies of the pixels. With `borrow` (of `snap` and `stream`), shots in unpacked formats are read-only
    views of the receive buffers; a buffer returns to the stream when its last array is dropped, so keeping many such
    shots stalls the stream. Raises `CameraNotFoundError`, `CameraBusyError`, or another `CameraError` that says what
    the camera rejected.
    """

    def __init__(self, config: AravisConfig | None = None) -> None:
        one = config is not None and config.chips == 1
        super().__init__(config, CHIPS[:1] if one else CHIPS, shots=True)

    @property
    def calibration(self) -> Calibration | None:
        """None: a real camera does not know its bench."""
        return None


class ChipCamera(_Running[ChipImage]):
    """One chip of a GenICam camera, or a GenICam camera with one chip; settings and errors as `AravisCamera`.

    Use it to focus, while the other chip is missing, or for an ordinary camera. `chip` selects the settings, and the
    device or stream channel where a name fits both chips.

    >>> from quadfringe.config.cameras import AravisConfig
    >>> from quadfringe.devices.aravis import ChipCamera
    >>> with ChipCamera(AravisConfig(device="acA1300", exposure_us=5000)) as camera:  # doctest: +SKIP
    ...     camera.snap().pixels.shape
    (1024, 1280)
    """

    def __init__(self, config: AravisConfig | None = None, chip: Literal["visible", "infrared"] = "visible") -> None:
        super().__init__(config, (chip,), shots=False)


def _check_connected(link: Link, silent_s: float) -> None:
    lost = link.lost(silent_s)
    if lost is not None:
        raise lost from None


def _packet_hint(link: Link, chip: int) -> str:
    """Return what to do about packets that are too large for the network; nothing if they arrive."""
    size = link.too_large(chip)
    if size is None:
        return ""
    if size.carried is None:
        return (
            f"; packets have {size.agreed} bytes, and this camera sends no test packets: if network card or switch "
            "carry less (MTU), set packet_size to that"
        )
    if link.config.packet_size:
        cure = f"set packet_size to at most {size.carried}, or leave it out"
    else:
        cure = "call again, which agrees on a size that arrives"
    return (
        f"; packets of {size.agreed} bytes do not arrive, only those up to {size.carried}: {cure}, or raise the MTU of "
        "network card, switch and camera (jumbo frames)"
    )


def open_devices(config: SystemConfig) -> Devices:
    """Open the camera of `capture`, and the projectors of the system."""
    assert isinstance(config.capture, AravisConfig)
    camera = AravisCamera(config.capture)
    try:
        found = config.model_copy(update={"capture": camera.config})
        return Devices(camera, open_projector(config), found, camera.config.visible.offset_px)
    except BaseException:
        camera.close()
        raise
