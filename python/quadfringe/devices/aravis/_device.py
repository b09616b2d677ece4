"""Devices of Aravis: discovery, features, packets, and whether a device still answers."""

from __future__ import annotations

import socket
import struct
from dataclasses import dataclass
from typing import Any

from quadfringe.devices.aravis._binding import aravis_binding, translated
from quadfringe.devices.aravis._stream import Stream
from quadfringe.errors import CameraError

__all__ = ["Device", "Found", "TooLarge", "found"]

GVCP_PORT = 3956  # GigE Vision standard
CONTROL_PRIVILEGE = 0x0A00  # address of the control privilege register, GigE Vision standard
TEST_PACKET = "GevSCPSFireTestPacket"  # without it, Aravis keeps the packet size that it finds
PING_S, PINGS = 0.3, 5  # wait for an answer, s, and attempts: 1.5 s, well below the 5 s after which Aravis gives up


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
    aravis = aravis_binding()
    aravis.update_device_list()
    devices = []
    for n in range(aravis.get_n_devices()):
        ethernet = aravis.get_device_protocol(n) == "GigEVision"
        where = aravis.get_device_address(n) if ethernet else aravis.get_device_id(n)
        texts = (aravis.get_device_vendor(n), aravis.get_device_model(n), aravis.get_device_serial_nbr(n))
        devices.append(Found(where, *(text or "" for text in texts)))
    return sorted(set(devices), key=str)


@dataclass(frozen=True)
class TooLarge:
    """A packet size that was agreed, and the largest that arrives, bytes with all headers; None: there is no test."""

    agreed: int
    carried: int | None


class Device:
    """One device and its features; close its streams before it."""

    def __init__(self, where: str) -> None:
        aravis = aravis_binding()
        self.where = where
        self._packet_bytes: dict[int, int] = {}  # agreed for each stream channel
        with translated(f"camera at {where}"):
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
        with translated(name):
            return bool(self._device.is_feature_available(name))

    def get(self, name: str) -> Any:
        """Read a feature: a bool, a number, or the name of an enumeration entry."""
        aravis = aravis_binding()
        with translated(f"reading {name}"):
            node = self._device.get_feature(name)
            if isinstance(node, aravis.GcBoolean):
                return self._device.get_boolean_feature_value(name)
            if isinstance(node, aravis.GcEnumeration):
                return self._device.get_string_feature_value(name)
            if isinstance(node, aravis.GcString) and not isinstance(node, aravis.GcInteger):
                return self._device.get_string_feature_value(name)
            if isinstance(node, aravis.GcFloat):
                return self._device.get_float_feature_value(name)
            return self._device.get_integer_feature_value(name)

    def set(self, name: str, value: bool | int | float | str) -> None:
        """Write a feature; any value executes a command."""
        aravis = aravis_binding()
        with translated(f"setting {name} to {value!r}"):
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

    def set_packets(self, channel: int, size: int | None, delay_ns: int | None) -> None:
        """Set packet size and delay of a stream channel; size 0 or None takes the largest that arrives."""
        if not self.ethernet:
            return
        with translated(f"camera at {self.where}: packets of stream {channel}"):
            if channel:
                self._camera.gv_select_stream_channel(channel)
            if size:
                self._camera.gv_set_packet_size(size)
            else:
                self._camera.gv_auto_packet_size()
            if delay_ns is not None:
                self._camera.gv_set_packet_delay(delay_ns)
            self._packet_bytes[channel] = int(self._camera.gv_get_packet_size())

    def too_large(self, channel: int) -> TooLarge | None:
        """Return the agreed packet size of a stopped stream unless test packets of that size arrive.

        The stream cannot start again afterwards.
        """
        agreed = self._packet_bytes.get(channel)
        if agreed is None:
            return None
        if not self.has(TEST_PACKET):
            return TooLarge(agreed, None)
        with translated(f"camera at {self.where}: test packets of stream {channel}"):
            if channel:
                self._camera.gv_select_stream_channel(channel)
            carried = int(self._camera.gv_auto_packet_size())
        return TooLarge(agreed, carried) if carried < agreed else None

    def channels(self) -> int:
        """Return the number of stream channels."""
        return int(self._camera.gv_get_n_stream_channels()) if self.ethernet else 1

    def stream(self, channel: int, payload: int, buffers: int, period_us: float) -> Stream:
        """Open a stream channel with a pool of buffers; call it after setting features and packets."""
        with translated(f"camera at {self.where}: stream {channel}"):
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
