"""The emulated camera: one exposure clock and two chips, each with a separate stream channel."""

from __future__ import annotations

import random
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from quadfringe.devices.emulator._control import STREAM_0, STREAM_STEP, Control, Identity, Resend
from quadfringe.devices.emulator._registers import FEATURES, PIXEL_FORMATS
from quadfringe.devices.emulator.frames import Source, packed

__all__ = ["Chip", "EmulatedCamera", "Faults"]

IP_UDP_HEADER, GVSP_HEADER = 28, 8
LEADER, TRAILER, PAYLOAD = 1, 2, 3
SHORT_IDS = 65535
FIRE_TEST = 1 << 31
KEPT = 8  # frames whose packets can be resent
Packet: TypeAlias = "tuple[bytes, bytes | memoryview[int]]"  # header and content


@dataclass
class Faults:
    """The simulated faults, which persist until reset; shares are probabilities with a fixed random seed."""

    lost_packets: float = 0.0  # share of packets that are not sent at first; a resend delivers them
    lost_frames: float = 0.0  # share of frames of each chip that are neither sent nor counted
    skipped_ids: float = 0.0  # share of frames after which one id is skipped
    deaf: bool = False  # resend requests are ignored
    silent: bool = False  # no frames from either chip
    silent_chip: int = -1  # no frames from this chip
    wrong_size: bool = False  # frames have half the lines of the Height register
    wrong_format: bool = False  # frames are announced in another pixel format of the same size
    short: bool = False  # the last packets of each frame are missing, and the trailer does not say so
    packet_size: int = 0  # packet size in place of that of the register, bytes
    mtu: int = 0  # larger packets, bytes with headers of IP and UDP, vanish on the way without a word; 0: none does
    gone: bool = False  # no answers and no frames, as if without power
    duplicates: float = 0.0  # share of packets that are sent twice
    reordered: float = 0.0  # share of packets that are sent after the next one
    corrupted: float = 0.0  # share of frames in whose payload a byte is inverted
    swapped: bool = False  # each chip sends the pixels of the other one
    clock_bits: int = 64  # bits of the device clocks in ns; 32 wrap around every 4.3 s
    next_id: int = 0  # id of the next frame of each chip; 0: count on


@dataclass
class Chip:
    """One chip: its device, stream channel and clock."""

    index: int
    control: Control
    stream: int
    clock_offset_s: float = 0.0
    clock_drift_ppm: float = 0.0
    id: int = 0
    sent: int = 0
    kept: deque[tuple[int, list[Packet]]] = field(default_factory=lambda: deque(maxlen=KEPT))

    def register(self, offset: int) -> int:
        """Read a register of this chip's stream channel."""
        return self.control[STREAM_0 + STREAM_STEP * self.stream + offset]

    @property
    def target(self) -> tuple[str, int]:
        """Address that frames are sent to."""
        return socket.inet_ntoa(struct.pack(">I", self.register(0x18))), self.register(0x0) & 0xFFFF

    def device_ns(self, instant_ns: int) -> int:
        """Return the device clock at an instant, ns."""
        return int(instant_ns * (1 + self.clock_drift_ppm * 1e-6) + self.clock_offset_s * 1e9)


class EmulatedCamera:
    """Two chips that expose together, like a JAI AD-080GE with SyncMode Sync.

    `devices` has one identity for each chip, or one with two stream channels for both. The camera communicates through
    the network only, except for `order`, which the process that runs it calls.
    """

    def __init__(self, devices: list[Identity], source: Source, *, clocks: tuple[float, float] = (0.0, 0.0)) -> None:
        self._source = source
        self._random = random.Random(1)
        self._start_ns = time.monotonic_ns()
        self._exposure = -1
        self._asked = threading.Semaphore(0)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 << 20)
        self._controls = [Control(who, self._written(at), self._resend(at)) for at, who in enumerate(devices)]
        places = [(at, stream) for at, who in enumerate(devices) for stream in range(who.streams)]
        self.chips = [Chip(index, self._controls[at], stream) for index, (at, stream) in enumerate(places)]
        self.chips[1].clock_offset_s, self.chips[1].clock_drift_ppm = clocks
        self._reset()
        threading.Thread(target=self._expose, name="exposures", daemon=True).start()

    def _reset(self) -> None:
        """Return to the state after power-on, without faults."""
        self.faults = Faults()
        for control in self._controls:
            control.answering = True
            control.release()
            self._set_up(control)

    def _set_up(self, control: Control) -> None:
        height, width = self._source.shape
        start = {"SensorWidth": width, "SensorHeight": height, "Width": width, "Height": height}
        start |= dict.fromkeys(("TriggerMode", "TriggerSource", "GainRaw", "SyncMode"), 0)
        for name, value in (start | {"FramePeriodUs": 33333, "ExposureTimeRaw": 100}).items():
            control[FEATURES[name]] = value
        for stream in range(control.who.streams):
            chosen = control.who.formats[0] if stream == 0 else "Mono8"
            control[FEATURES["PixelFormat"] + 4 * stream] = PIXEL_FORMATS[chosen]

    def _written(self, device: int) -> Callable[[int, int], None]:
        def written(address: int, value: int) -> None:
            control = self._controls[device]
            if address == FEATURES["SoftwareTrigger0"] and (device == 0 or control.feature("SyncMode")):
                self._asked.release()
            stream, register = divmod(address - STREAM_0, STREAM_STEP)
            if 0 <= stream < control.who.streams and register == 4 and value & FIRE_TEST:
                chip = next(chip for chip in self.chips if chip.control is control and chip.stream == stream)
                control[address] = value & ~FIRE_TEST  # the bit clears itself
                self._send_packet(chip, (b"", bytes((value & 0xFFFF) - IP_UDP_HEADER)))

        return written

    def _resend(self, device: int) -> Resend:
        def resend(block: int, first: int, last: int) -> None:
            if self.faults.deaf:
                return
            # Aravis requests stream channel 0 for every channel, so all chips of the device are searched for the frame.
            for chip in (chip for chip in self.chips if chip.control is self._controls[device]):
                for known, packets in tuple(chip.kept):
                    if known == block:
                        for packet in packets[first : last + 1]:
                            self._send_packet(chip, packet)

        return resend

    def order(self, words: list[str]) -> str:
        """Execute an order: a fault and its value, "line" (a trigger pulse), "sent", "busy" or "reset"."""
        if words == ["line"]:
            self._asked.release()
        elif words == ["reset"]:
            self._reset()
        elif words == ["sent"]:
            return " ".join(str(chip.sent) for chip in self.chips)
        elif words == ["busy"]:
            return str(time.process_time())
        elif len(words) == 2 and hasattr(self.faults, words[0]):
            kind = type(getattr(self.faults, words[0]))
            setattr(self.faults, words[0], kind(float(words[1])))
            self._renumber()
            for control in self._controls:
                control.answering = not self.faults.gone
                if self.faults.gone:
                    control.release()
        else:
            raise ValueError(f"expected a fault and its value, line, sent, busy or reset, got {' '.join(words)!r}")
        return "ok"

    def _renumber(self) -> None:
        """Let the frames of both chips count from the id that was ordered."""
        if self.faults.next_id:
            for chip in self.chips:
                chip.id = self.faults.next_id - 1
            self.faults.next_id = 0

    def _expose(self) -> None:
        """Expose at the frame rate of the first chip, or when triggered; a busy host delays but never skips one."""
        due_ns = time.monotonic_ns()
        while True:
            control = self._controls[0]
            if control.feature("TriggerMode"):
                if self._asked.acquire(timeout=0.1):
                    self._send(time.monotonic_ns())
                due_ns = time.monotonic_ns()
                continue
            due_ns += control.feature("FramePeriodUs") * 1000
            left_ns = due_ns - time.monotonic_ns()
            if left_ns > 0:
                time.sleep(left_ns / 1e9)
            elif left_ns < -1_000_000_000:
                due_ns = time.monotonic_ns()
            self._send(due_ns)

    def _send(self, instant_ns: int) -> None:
        self._exposure += 1
        active = [chip for chip in self.chips if self._sends(chip)]
        turn_ns = 1 << self.faults.clock_bits
        trains = [
            self._on_the_wire(self._packets(chip, chip.device_ns(instant_ns - self._start_ns) % turn_ns))
            for chip in active
        ]
        # Both chips share the wire: their packets take turns.
        for turn in range(max((len(packets) for packets in trains), default=0)):
            for chip, packets in zip(active, trains, strict=True):
                if turn < len(packets) and self._random.random() >= self.faults.lost_packets:
                    self._send_packet(chip, packets[turn])
        for chip in active:
            chip.sent += 1

    def _send_packet(self, chip: Chip, packet: Packet) -> None:
        if not self.faults.mtu or IP_UDP_HEADER + sum(map(len, packet)) <= self.faults.mtu:
            self._socket.sendmsg(packet, (), 0, chip.target)

    def _on_the_wire(self, packets: list[Packet]) -> list[Packet]:
        """Send some packets twice, and some after the next one, as routers and redundant links do."""
        if not (self.faults.duplicates or self.faults.reordered):
            return packets
        sent = [packet for packet in packets for _ in range(1 + (self._random.random() < self.faults.duplicates))]
        for at in range(len(sent) - 1):
            if self._random.random() < self.faults.reordered:
                sent[at], sent[at + 1] = sent[at + 1], sent[at]
        return sent

    def _sends(self, chip: Chip) -> bool:
        if not chip.control.feature("Acquisition") or not chip.register(0x0) or self.faults.gone:
            return False
        chip.id = chip.id % SHORT_IDS + 1
        if self._random.random() < self.faults.skipped_ids:
            chip.id = chip.id % SHORT_IDS + 1
        if self.faults.silent or self.faults.silent_chip == chip.index:
            return False
        return self._random.random() >= self.faults.lost_frames

    def _packets(self, chip: Chip, device_ns: int) -> list[Packet]:
        width, height = (chip.control.feature(name) for name in ("Width", "Height"))
        pixel_format = chip.control[FEATURES["PixelFormat"] + 4 * chip.stream]
        seen = 1 - chip.index if self.faults.swapped else chip.index
        payload = packed(self._source, seen, self._exposure, pixel_format, (width, height))
        if self._random.random() < self.faults.corrupted:
            wrong = bytearray(payload)
            wrong[self._random.randrange(4, len(wrong))] ^= 0xFF
            payload = memoryview(wrong)
        if self.faults.wrong_size:
            height //= 2
            payload = payload[: len(payload) // 2]
        if self.faults.short:
            payload = payload[: len(payload) // 2]
        announced = pixel_format ^ 0x80 if self.faults.wrong_format else pixel_format
        leader = struct.pack(">HHQIIIIIHH", 0, 1, device_ns, announced, width, height, 0, 0, 0, 0)
        parts: list[tuple[int, bytes | memoryview[int]]] = [(LEADER, leader)]
        parts += [(PAYLOAD, part) for part in self._split(chip, payload)]
        parts.append((TRAILER, struct.pack(">HHI", 0, 1, height)))
        packets: list[Packet] = [
            (struct.pack(">HHI", 0, chip.id, kind << 24 | number), part) for number, (kind, part) in enumerate(parts)
        ]
        chip.kept.append((chip.id, packets))
        return packets

    def _split(self, chip: Chip, payload: memoryview[int]) -> Iterator[memoryview[int]]:
        size = (self.faults.packet_size or chip.register(0x4) & 0xFFFF) - IP_UDP_HEADER - GVSP_HEADER
        return (payload[at : at + size] for at in range(0, len(payload), size))
