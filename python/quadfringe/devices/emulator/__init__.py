"""An emulated GigE Vision camera with two chips, for tests, demonstrations, and work before a camera arrives.

It runs in a separate process and answers on two addresses of the loopback interface, like a JAI AD-080GE with two
devices of one serial number, or as one device with two stream channels. It sends frames from a file or a test pattern,
obeys triggers, resends lost packets, and simulates the faults of real cameras (`Faults`).

>>> from quadfringe.devices.emulator import Emulator
>>> with Emulator() as camera:  # doctest: +SKIP
...     camera.order("lost_packets", 0.01)
>>> from quadfringe.devices import emulator
>>> emulator.MODEL, emulator.SERIAL, emulator.ADDRESSES
('AD-080GE', 'E000001', ('127.0.0.1', '127.0.0.2'))
>>> emulator.keep_pace()  # doctest: +SKIP
"""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Literal, Self

__all__ = ["ADDRESSES", "MODEL", "SERIAL", "Emulator", "keep_pace"]

ADDRESSES = ("127.0.0.1", "127.0.0.2")
MODEL = "AD-080GE"
SERIAL = "E000001"


def keep_pace() -> None:
    """Give the threads that this thread starts real-time priority, where that is permitted.

    A real camera exposes on time; without priority, a busy host would make the emulated one late. The threads are busy
    for only a few milliseconds per second.
    """
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))


class Emulator:
    """The process of an emulated camera; it ends with the `with` block.

    `frames` is an NPZ file with the arrays `visible` and `infrared` of `FileFrames`, sent in turn; without it, a test
    pattern of `size_px` (width, height) is sent. `clock` is the offset, s, and the drift, ppm, of the clock of the
    second chip against the first. With `model="two-streams"`, one device sends both chips. Raises OSError when the
    addresses are in use or missing.
    """

    def __init__(
        self,
        frames: Path | None = None,
        *,
        size_px: tuple[int, int] = (1024, 768),
        model: Literal["jai", "two-streams"] = "jai",
        clock: tuple[float, float] = (0.0, 0.0),
        addresses: tuple[str, str] = ADDRESSES,
        serial: str = SERIAL,
    ) -> None:
        self.addresses = addresses
        words = [
            "--model",
            model,
            "--serial",
            serial,
            "--addresses",
            *addresses,
            "--size",
            f"{size_px[0]}x{size_px[1]}",
        ]
        words += ["--clock", *map(str, clock)] + ([] if frames is None else ["--frames", str(frames)])
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._answer()

    def order(self, *words: object) -> str:
        """Send an order and return the answer: a fault of `Faults` with its value, "line" (a trigger pulse), "reset".

        The order "sent" returns the number of frames of each chip, "busy" the processor time of the camera in seconds.
        """
        assert self._process.stdin is not None
        print(*words, file=self._process.stdin, flush=True)
        return self._answer()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        answer = self._process.stdout.readline().strip()
        if not answer or answer.startswith("error"):
            self.close()
            raise OSError(
                f"the emulated camera: {answer.removeprefix('error: ') or 'its process ended; see its message'}"
            )
        return answer

    def close(self) -> None:
        """End the process; further calls do nothing."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()
