"""One stream channel of a camera, and the buffers that Aravis fills."""

from __future__ import annotations

import ctypes
import logging
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import FrameStamp
from quadfringe.devices.aravis._binding import aravis_binding

__all__ = ["Buffer", "Stream"]

logger = logging.getLogger(__name__)


class Announced(NamedTuple):
    """Pixel format code and size that a frame announces."""

    code: int
    width: int
    height: int


@dataclass(frozen=True)
class Buffer:
    """A buffer that the stream has filled, or failed to fill."""

    held: Any
    array: NDArray[np.uint8]

    @property
    def status(self) -> str:
        """The word success, or the reason of the failure."""
        return str(self.held.get_status().value_nick)

    @property
    def received(self) -> int:
        """Received bytes; read through C, because the binding would copy all of them to count them."""
        size = ctypes.c_size_t()
        _library().arv_buffer_get_data(_pointer(self.held), ctypes.byref(size))
        return size.value

    @property
    def stamp(self) -> FrameStamp:
        """Frame id of the device, device clock, and UTC of the host at the arrival of the first packet, ns."""
        held = self.held
        return FrameStamp(held.get_frame_id(), held.get_timestamp(), held.get_system_timestamp())

    @property
    def announced(self) -> Announced:
        """What the frame says about its image."""
        held = self.held
        return Announced(held.get_image_pixel_format(), held.get_image_width(), held.get_image_height())


class Stream:
    """One stream channel: a thread of Aravis fills the buffers that this class pushes and pops."""

    def __init__(self, stream: Any, payload: int, buffers: int, period_us: float, ethernet: bool) -> None:
        self._stream = stream
        if ethernet:
            self._keep_packets(payload, period_us)
        for _ in range(buffers):
            array = np.empty(payload, np.uint8)
            held = aravis_binding().Buffer.new(payload, array.ctypes.data)
            held.array = array  # keeps the memory alive as long as the buffer
            stream.push_buffer(held)

    def _keep_packets(self, payload: int, period_us: float) -> None:
        aravis = aravis_binding()
        wanted = min(max(4 * payload, 1 << 20), 32 << 20)
        self._stream.set_property("packet-resend", aravis.GvStreamPacketResend.ALWAYS)
        self._stream.set_property("frame-retention", round(max(period_us, 50_000)))
        self._stream.set_property("socket-buffer", aravis.GvStreamSocketBuffer.FIXED)
        self._stream.set_property("socket-buffer-size", wanted)
        allowed = int(Path("/proc/sys/net/core/rmem_max").read_text())
        if allowed < 2 * payload:
            logger.warning(
                "the kernel limits socket buffers to %d kB, but two frames need %d kB, so frames will be lost; "
                "run as root: sysctl -w net.core.rmem_max=%d",
                allowed >> 10,
                2 * payload >> 10,
                wanted,
            )

    def pop(self, timeout_s: float) -> Buffer | None:
        """Take the next buffer, filled or failed; None when none comes in time. Waits without the interpreter lock."""
        held = self._stream.timeout_pop_buffer(round(timeout_s * 1e6))
        return None if held is None else Buffer(held, held.array)

    def push(self, buffer: Buffer) -> None:
        """Return a buffer to be filled again; after the stream has closed, the buffer is freed instead."""
        stream = self.__dict__.get("_stream")
        if stream is not None:
            stream.push_buffer(buffer.held)

    def give_up(self) -> list[Any]:
        """Return the objects to drop to end the stream; buffers that are pushed later are freed."""
        return [self.__dict__.pop("_stream")] if "_stream" in self.__dict__ else []


@cache
def _library() -> Any:
    library = ctypes.CDLL("libaravis-0.8.so.0")
    library.arv_buffer_get_data.restype = ctypes.c_void_p
    library.arv_buffer_get_data.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    return library


@cache
def _unwrap() -> Any:
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return get


def _pointer(held: Any) -> int:
    address: int = _unwrap()(held.__gpointer__, None)
    return address
