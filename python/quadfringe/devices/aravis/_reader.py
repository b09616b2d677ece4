"""The frames of one chip: a thread takes buffers from the stream, rejects faulty frames and returns the buffers."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import FrameStamp
from quadfringe.devices.aravis._arrival import ArrivalTimes
from quadfringe.devices.aravis._formats import PixelFormat
from quadfringe.devices.aravis._stream import Buffer, Stream

__all__ = ["Agreed", "ChipReader", "Frame"]

POP_S = 0.05  # wait for a buffer: the longest time that stopping takes
DRAIN_S = 0.02  # wait for late buffers at the end of a run


@dataclass(frozen=True)
class Agreed:
    """Format and size that every frame of a chip must have."""

    format: PixelFormat
    width: int
    height: int

    @property
    def payload(self) -> int:
        """Number of bytes of a frame."""
        return self.format.payload(self.width, self.height)

    def fault(self, buffer: Buffer) -> str | None:
        """Return what is wrong with a buffer, or None; one with status "success" may still be short."""
        if buffer.status != "success":
            return f"incomplete ({buffer.status})"
        code, width, height = buffer.announced
        if (width, height) != (self.width, self.height):
            return f"{width} x {height} pixels instead of {self.width} x {self.height}"
        if code != self.format.code:
            return f"pixel format {code:#x} instead of {self.format.name}"
        if buffer.received < self.payload:
            return f"{buffer.received} bytes instead of {self.payload}"
        return None


@dataclass(frozen=True)
class Frame:
    """A complete frame: pixels (H, W) or (H, W, 3). The arrival time in its stamp is that of the monotonic clock."""

    stamp: FrameStamp
    pixels: NDArray[Any]


class _Loan:
    """The memory of a buffer as the base of arrays; the buffer returns to the stream when the last one is dropped."""

    def __init__(self, stream: Stream, buffer: Buffer) -> None:
        self._stream, self._buffer = stream, buffer
        self.__array_interface__ = buffer.array.__array_interface__ | {
            "data": (buffer.array.ctypes.data, True)  # read-only
        }

    def __del__(self) -> None:
        self._stream.push(self._buffer)


class ChipReader:
    """Reads one chip; passes every complete frame to `deliver` in the thread of the reader.

    The pixels are a copy, or with `borrow` a read-only view of a receive buffer.
    """

    def __init__(self, stream: Stream, agreed: Agreed) -> None:
        self.agreed = agreed
        self.frames = self.damaged = 0
        self.fault: str | None = None  # of the last rejected frame
        self.incomplete = False  # whether that frame lacked packets
        self.heard = 0.0  # when the last frame arrived, complete or not
        self._stream = stream
        self._arrivals = ArrivalTimes()
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

    def start(self, deliver: Callable[[Frame], None], *, borrow: bool) -> None:
        """Start a run; discard frames of an earlier one."""
        self._drain()
        self.heard = time.monotonic()
        self._stopping.clear()
        self._thread = threading.Thread(target=self._read, args=(deliver, borrow), name="camera", daemon=True)
        self._thread.start()

    def _read(self, deliver: Callable[[Frame], None], borrow: bool) -> None:
        while not self._stopping.is_set():
            buffer = self._stream.pop(POP_S)
            if buffer is None:
                continue
            self.heard = time.monotonic()
            frame = self._frame(buffer, borrow)
            if frame is not None:
                deliver(frame)

    def _frame(self, buffer: Buffer, borrow: bool) -> Frame | None:
        lent = False
        try:
            fault = self.agreed.fault(buffer)
            if fault is not None:
                self.fault, self.incomplete = fault, buffer.status != "success"
                self.damaged += 1
                return None
            self.frames += 1
            stamp = buffer.stamp
            stamp = replace(stamp, arrival_ns=self._arrivals.monotonic_ns(stamp.arrival_ns))
            agreed = self.agreed
            if borrow and not agreed.format.packed:
                data = np.asarray(_Loan(self._stream, buffer))
                lent = True
            else:
                data = buffer.array
            pixels = agreed.format.pixels(data, agreed.width, agreed.height)
            return Frame(stamp, pixels if lent or agreed.format.packed else pixels.copy())
        finally:
            if not lent:
                self._stream.push(buffer)

    def quit(self) -> None:
        """Ask the thread to end; `stop` waits for it."""
        self._stopping.set()

    def stop(self) -> None:
        """End the run and discard frames that still arrive."""
        self.quit()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._drain()

    def _drain(self) -> None:
        while (buffer := self._stream.pop(DRAIN_S)) is not None:
            self._stream.push(buffer)

    def give_up(self) -> list[Any]:
        """Return the objects to drop to end the stream; borrowed arrays stay valid."""
        return self._stream.give_up()
