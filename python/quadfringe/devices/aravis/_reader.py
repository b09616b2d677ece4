"""One chip's frames: a thread that takes buffers from the wire, refuses what is not as agreed, and gives them back."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import FrameStamp
from quadfringe.devices.aravis._formats import PixelFormat
from quadfringe.devices.aravis._gi import Buffer, Stream

__all__ = ["Agreed", "ChipReader", "Frame"]

POP_S = 0.05
DRAIN_S = 0.02


@dataclass(frozen=True)
class Agreed:
    """What every frame of a chip has to be."""

    format: PixelFormat
    width: int
    height: int

    @property
    def payload(self) -> int:
        """Bytes of a frame."""
        return self.format.payload(self.width, self.height)

    def fault(self, buffer: Buffer) -> str | None:
        """Say what is wrong with a buffer. "Success" alone says little: it may be short, of another size, or both."""
        if buffer.status != "success":
            return f"incomplete ({buffer.status})"
        code, width, height = buffer.image
        if (width, height) != (self.width, self.height):
            return f"{width} x {height} pixels instead of {self.width} x {self.height}"
        if code != self.format.code:
            return f"pixel format {code:#x} instead of {self.format.name}"
        if buffer.received < self.payload:
            return f"{buffer.received} bytes instead of {self.payload}"
        return None


@dataclass(frozen=True)
class Frame:
    """A whole frame: pixels (H, W) or (H, W, 3)."""

    stamp: FrameStamp
    pixels: NDArray[Any]


class _Loan:
    """A buffer's memory as the base of arrays; when the last of them is gone the buffer is filled again."""

    def __init__(self, stream: Stream, buffer: Buffer) -> None:
        self._stream, self._buffer = stream, buffer
        self.__array_interface__ = buffer.array.__array_interface__ | {
            "data": (buffer.array.ctypes.data, True)  # read-only
        }

    def __del__(self) -> None:
        self._stream.push(self._buffer)


class ChipReader:
    """Reads one chip; every whole frame goes to `deliver`, in the reader's thread.

    Pixels are the caller's own, or, borrowed, the memory of a buffer that goes back to the wire with its last array.
    """

    def __init__(self, stream: Stream, agreed: Agreed) -> None:
        self.agreed = agreed
        self.frames = self.damaged = 0
        self.fault: str | None = None  # of the last frame that was refused
        self.heard = 0.0  # when the last frame came, whole or not
        self._stream = stream
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

    def start(self, deliver: Callable[[Frame], None], *, borrow: bool) -> None:
        """Begin a run; frames of an earlier one are thrown away."""
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
                self.fault = fault
                self.damaged += 1
                return None
            self.frames += 1
            agreed = self.agreed
            if borrow and not agreed.format.packed:
                data = np.asarray(_Loan(self._stream, buffer))
                lent = True
            else:
                data = buffer.array
            pixels = agreed.format.pixels(data, agreed.width, agreed.height)
            stamp = FrameStamp(*buffer.times)
            return Frame(stamp, pixels if lent or agreed.format.packed else pixels.copy())
        finally:
            if not lent:
                self._stream.push(buffer)

    def quit(self) -> None:
        """Let the thread end; `stop` waits for it."""
        self._stopping.set()

    def stop(self) -> None:
        """End the run, with the frames that were on their way."""
        self.quit()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._drain()

    def _drain(self) -> None:
        while (buffer := self._stream.pop(DRAIN_S)) is not None:
            self._stream.push(buffer)

    def give_up(self) -> list[Any]:
        """Give what has to be dropped for the stream to end; borrowed arrays stay valid."""
        return self._stream.give_up()
