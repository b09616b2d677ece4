"""The only module that calls Aravis, through GObject introspection.

Two rules: no Python runs in a thread of Aravis (no signals, no callbacks), because that thread would wait for the
interpreter while frames are lost; and every call that can fail turns a GLib error into a `CameraError`.
"""

from __future__ import annotations

import ctypes
import logging
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import CameraError, CameraLostError, CameraNotFoundError, MissingExtraError

__all__ = ["Buffer", "Device", "Found", "Stream", "found"]

INSTALL = (
    "cameras need Aravis and its Python binding:\n"
    "  apt-get install --no-install-recommends gir1.2-aravis-0.8 libgirepository1.0-dev libcairo2-dev pkg-config gcc\n"
    '  pip install "quadfringe[aravis]"'
)
GVCP_PORT = 3956  # GigE Vision standard
CONTROL_PRIVILEGE = 0x0A00  # address of the control privilege register, GigE Vision standard
PING_S, PINGS = 0.3, 5  # wait for an answer, s, and attempts: 1.5 s, well below the 5 s after which Aravis gives up
logger = logging.getLogger(__name__)


@cache
def _aravis() -> Any:
    """Import Aravis once; raises `MissingExtraError` with what to install."""
    try:
        import gi

        gi.require_version("Aravis", "0.8")
        from gi.repository import Aravis
    except (ImportError, ValueError) as error:
        raise MissingExtraError(f"{INSTALL}\n({error})") from error
    return Aravis


@contextmanager
def _translated(what: str) -> Iterator[None]:
    """Turn a GLib error into a `CameraError` that says what was attempted."""
    from gi.repository import GLib

    try:
        yield
    except GLib.Error as error:
        errors = _aravis().DeviceError
        kinds = {errors.TIMEOUT: CameraLostError, errors.NOT_FOUND: CameraNotFoundError}
        quark = _aravis().device_error_quark()
        raised = next((kind for code, kind in kinds.items() if error.matches(quark, code)), CameraError)
        raise raised(f"{what}: {error.message}") from error


@dataclass(frozen=True)
class Found:
    """A device that answered: `where` opens it; vendor, model and serial number are for messages."""

    where: str
    vendor: str
    model: str
    serial: str

    @property
    def name(self) -> str:
        """Name of the camera that the device belongs to, without the chip suffix of the model."""
        return f"{self.vendor} {self.model.partition('_#')[0]} {self.serial}".strip() or self.where

    def __str__(self) -> str:
        return f"{self.vendor} {self.model} {self.serial} at {self.where}"


def found() -> list[Found]:
    """Search every network interface and USB for devices."""
    aravis = _aravis()
    aravis.update_device_list()
    devices = []
    for n in range(aravis.get_n_devices()):
        ethernet = aravis.get_device_protocol(n) == "GigEVision"
        where = aravis.get_device_address(n) if ethernet else aravis.get_device_id(n)
        texts = (aravis.get_device_vendor(n), aravis.get_device_model(n), aravis.get_device_serial_nbr(n))
        devices.append(Found(where, *(text or "" for text in texts)))
    return sorted(set(devices), key=str)


class Device:
    """One device and its features; close its streams before it."""

    def __init__(self, where: str) -> None:
        aravis = _aravis()
        self.where = where
        with _translated(f"camera at {where}"):
            self._camera = aravis.Camera.new(where)
        self._device = self._camera.get_device()
        self.ethernet = bool(self._camera.is_gv_device())
        if self.ethernet:
            # Otherwise the stream may change the packet size after its buffers were allocated.
            self._camera.gv_set_packet_size_adjustment(aravis.GvPacketSizeAdjustment.NEVER)
            # Packet sockets need privileges, and receive every packet twice on the loopback interface.
            self._camera.gv_set_stream_options(aravis.GvStreamOption.PACKET_SOCKET_DISABLED)

    @property
    def controlled(self) -> bool:
        """Whether this program has exclusive control of the device."""
        return not self.ethernet or bool(self._device.is_controller())

    def has(self, name: str) -> bool:
        """Return whether the device has this feature and it is available now."""
        with _translated(name):
            return bool(self._device.is_feature_available(name))

    def get(self, name: str) -> Any:
        """Read a feature: a bool, a number, or the name of an enumeration entry."""
        aravis = _aravis()
        with _translated(f"reading {name}"):
            node = self._device.get_feature(name)
            if isinstance(node, aravis.GcBoolean):
                return self._device.get_boolean_feature_value(name)
            if isinstance(node, aravis.GcEnumeration | aravis.GcString) and not isinstance(node, aravis.GcInteger):
                return self._device.get_string_feature_value(name)
            if isinstance(node, aravis.GcEnumeration):
                return self._device.get_string_feature_value(name)
            if isinstance(node, aravis.GcFloat):
                return self._device.get_float_feature_value(name)
            return self._device.get_integer_feature_value(name)

    def set(self, name: str, value: bool | int | float | str) -> None:
        """Write a feature; any value executes a command."""
        aravis = _aravis()
        with _translated(f"setting {name} to {value!r}"):
            node = self._device.get_feature(name)
            if node is None:
                raise CameraError(f"camera at {self.where} has no feature {name}; leave it out, or check its spelling")
            if isinstance(node, aravis.GcCommand):
                self._device.execute_command(name)
            elif isinstance(value, str):
                self._device.set_string_feature_value(name, value)
            elif isinstance(node, aravis.GcBoolean):
                self._device.set_boolean_feature_value(name, bool(value))
            elif isinstance(node, aravis.GcFloat):
                self._device.set_float_feature_value(name, float(value))
            else:
                self._device.set_integer_feature_value(name, round(value))

    def set_packets(self, channel: int, size: int | None, delay_ns: int | None) -> int:
        """Set packet size and delay of a stream channel; size 0 or None takes the largest that arrives. Return it."""
        if not self.ethernet:
            return 0
        with _translated(f"camera at {self.where}: packets of stream {channel}"):
            if channel:
                self._camera.gv_select_stream_channel(channel)
            if size:
                self._camera.gv_set_packet_size(size)
            else:
                self._camera.gv_auto_packet_size()
            if delay_ns is not None:
                self._camera.gv_set_packet_delay(delay_ns)
            return int(self._camera.gv_get_packet_size())

    def channels(self) -> int:
        """Return the number of stream channels."""
        return int(self._camera.gv_get_n_stream_channels()) if self.ethernet else 1

    def stream(self, channel: int, payload: int, buffers: int, period_us: float) -> Stream:
        """Open a stream channel with a pool of buffers; call it after setting features and packets."""
        with _translated(f"camera at {self.where}: stream {channel}"):
            if channel:
                self._camera.gv_select_stream_channel(channel)
            return Stream(self._camera.create_stream(None, None), payload, buffers, period_us, self.ethernet)

    def answers(self) -> bool:
        """Return whether the device answers within 1.5 s and is still controlled; Aravis itself notices after 5 s."""
        if not self.ethernet:
            return True
        question = struct.pack(">BBHHHI", 0x42, 1, 0x0080, 4, 1, CONTROL_PRIVILEGE)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
            wire.settimeout(PING_S)
            for _ in range(PINGS):
                try:
                    wire.sendto(question, (self.where, GVCP_PORT))
                    answer = wire.recv(64)
                except OSError:
                    continue
                # A device under exclusive access refuses to answer this, but it is reachable.
                return len(answer) < 12 or bool(struct.unpack_from(">I", answer, 8)[0] & 3)
        return False

    def give_up(self) -> list[Any]:
        """Return the objects to drop, after the streams, to free the device; the device is unusable afterwards."""
        return [self.__dict__.pop(name) for name in ("_device", "_camera") if name in self.__dict__]


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
    def times(self) -> tuple[int, int, int]:
        """Frame id of the device, device clock, and host clock at the arrival of the first packet, ns."""
        held = self.held
        return held.get_frame_id(), held.get_timestamp(), held.get_system_timestamp()

    @property
    def image(self) -> tuple[int, int, int]:
        """Pixel format, width and height as announced by the frame."""
        held = self.held
        return held.get_image_pixel_format(), held.get_image_width(), held.get_image_height()


class Stream:
    """One stream channel: a thread of Aravis fills the buffers that this class pushes and pops."""

    def __init__(self, stream: Any, payload: int, buffers: int, period_us: float, ethernet: bool) -> None:
        self._stream = stream
        if ethernet:
            self._keep_packets(payload, period_us)
        for _ in range(buffers):
            array = np.empty(payload, np.uint8)
            held = _aravis().Buffer.new(payload, array.ctypes.data)
            held.array = array  # keeps the memory alive as long as the buffer
            stream.push_buffer(held)

    def _keep_packets(self, payload: int, period_us: float) -> None:
        aravis = _aravis()
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
