"""The control channel of one emulated device: GVCP on UDP port 3956, registers, one controller at a time."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from quadfringe.devices.emulator._registers import FEATURES, XML_ADDRESS, genicam

__all__ = ["Control", "Identity", "Resend"]

PORT = 3956
COMMAND_KEY = 0x42
DISCOVERY, RESEND, READ_REGISTER, WRITE_REGISTER, READ_MEMORY, WRITE_MEMORY = 0x02, 0x40, 0x80, 0x82, 0x84, 0x86
ACCESS_DENIED, INVALID_ADDRESS = 0x8006, 0x8003
CCP, HEARTBEAT, STREAM_0, STREAM_STEP = 0x0A00, 0x0938, 0x0D00, 0x40
CONTROLLER_PORT, CONTROLLER_IP = 0x0A04, 0x0A14
Address = tuple[str, int]
Resend = Callable[[int, int, int], None]


@dataclass(frozen=True)
class Identity:
    """How a device identifies itself, and its pixel formats and number of stream channels."""

    vendor: str
    model: str
    serial: str
    ip: str
    formats: tuple[str, ...]
    streams: int = 1


class Control:
    """Registers behind GVCP; calls `written` after a register of a stream or a feature was written."""

    def __init__(self, who: Identity, written: Callable[[int, int], None], resend: Resend) -> None:
        self.who = who
        self.controller: Address | None = None
        self.answering = True
        self._written, self._resend = written, resend
        self._heard = 0.0
        self._memory = bytearray(0x30000)
        self._xml = genicam(list(who.formats), who.streams)
        self._fill()
        self._lock = threading.Lock()
        self._socket = _bound(who.ip)
        # Discovery uses the broadcast address, which a socket bound to one address does not receive.
        for ear in (self._socket, _bound("255.255.255.255")):
            threading.Thread(target=self._serve, args=(ear,), name=f"control {who.ip}", daemon=True).start()

    def _fill(self) -> None:
        who = self.who
        ip = socket.inet_aton(who.ip)
        file = f"Local:camera.xml;{XML_ADDRESS:x};{len(self._xml):x}"
        for address, text, length in (
            (0x48, who.vendor, 32),
            (0x68, who.model, 32),
            (0x88, "1", 32),
            (0xD8, who.serial, 16),
            (0x200, file, 512),
        ):
            self._memory[address : address + length] = text.encode().ljust(length, b"\0")
        self._memory[0x24:0x28] = ip
        numbers = {0x0: 0x00010002, 0x4: 0x80000001, 0x8: 0x0200, 0xC: struct.unpack(">I", ip)[0], 0x10: 6, 0x14: 6}
        numbers |= {0x34: 0xFF000000, 0x600: 1, 0x904: who.streams, 0x934: 0x80000007, HEARTBEAT: 3000, 0x940: 10**9}
        numbers |= {STREAM_0 + n * STREAM_STEP + 4: 1500 for n in range(who.streams)}
        for address, value in numbers.items():
            self[address] = value

    def __getitem__(self, address: int) -> int:
        """Read a register."""
        value: int = struct.unpack_from(">I", self._memory, address)[0]
        return value

    def __setitem__(self, address: int, value: int) -> None:
        """Set a register, without calling `written`."""
        struct.pack_into(">I", self._memory, address, value & 0xFFFFFFFF)

    def feature(self, name: str) -> int:
        """Read the register of a feature."""
        return self[FEATURES[name]]

    def _serve(self, ear: socket.socket) -> None:
        while True:
            packet, sender = ear.recvfrom(2048)
            if self.answering and len(packet) >= 8 and packet[0] == COMMAND_KEY:
                with self._lock:
                    self._handle(packet, sender)

    def _handle(self, packet: bytes, sender: Address) -> None:
        _, flags, command, _, number = struct.unpack_from(">BBHHH", packet)
        body = packet[8:]
        if command == RESEND:
            _, block, first, last = struct.unpack_from(">HHII", body)
            self._resend(block, first & 0xFFFFFF, last & 0xFFFFFF)
            return
        status, answer = self._answer(command, body, sender)
        if flags & 1:
            head = struct.pack(">HHHH", status, command + 1, len(answer), number)
            self._socket.sendto(head + answer, sender)

    def _answer(self, command: int, body: bytes, sender: Address) -> tuple[int, bytes]:
        self._expire()
        if sender == self.controller:
            self._heard = time.monotonic()
        if command == DISCOVERY:
            return 0, bytes(self._memory[:0xF8])
        if command == READ_REGISTER:
            return 0, b"".join(struct.pack(">I", self[address]) for (address,) in struct.iter_unpack(">I", body))
        if command == READ_MEMORY:
            address, length = struct.unpack(">II", body)
            return 0, body[:4] + self._read(address, length & 0xFFFF)
        if command not in (WRITE_REGISTER, WRITE_MEMORY):
            return 0x8001, b""
        if self.controller not in (None, sender) or (self.controller is None and body[:4] != struct.pack(">I", CCP)):
            return ACCESS_DENIED, b""
        writes = struct.iter_unpack(">II", body) if command == WRITE_REGISTER else [struct.unpack(">II", body[:8])]
        for address, value in writes:
            if address + 4 > len(self._memory):
                return INVALID_ADDRESS, b""
            self._write(address, value, sender)
        return 0, struct.pack(">HH", 0, 1)

    def _read(self, address: int, length: int) -> bytes:
        if address >= XML_ADDRESS:
            return self._xml[address - XML_ADDRESS :][:length].ljust(length, b"\0")
        return bytes(self._memory[address : address + length])

    def _write(self, address: int, value: int, sender: Address) -> None:
        if address == CCP:
            self.controller = sender if value & 3 else None
            self._heard = time.monotonic()
            self[CONTROLLER_PORT] = sender[1] if value & 3 else 0
            self[CONTROLLER_IP] = struct.unpack(">I", socket.inet_aton(sender[0]))[0] if value & 3 else 0
        self[address] = value
        self._written(address, value)

    def _expire(self) -> None:
        """Release a controller that has been silent for the heartbeat time, and stop its acquisition."""
        if self.controller is not None and time.monotonic() - self._heard > self[HEARTBEAT] / 1000:
            self.release()

    def release(self) -> None:
        """Release the controller and stop its acquisition."""
        self.controller = None
        self[CCP] = 0
        self[FEATURES["Acquisition"]] = 0


def _bound(ip: str) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    bound.bind((ip, PORT))
    return bound
