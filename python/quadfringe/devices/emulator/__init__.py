"""A camera with two chips on the wire of GigE Vision, for tests, demonstrations and cameras that are not there yet.

It runs in a process of its own and answers on two addresses of the loopback interface, as a JAI AD-080GE does with two
devices of one serial number, or as one device with two stream channels. It shows frames of yours, obeys triggers, sends
lost packets again, and fails in the ways that cameras fail.

>>> from quadfringe.devices.emulator import Emulator
>>> with Emulator() as camera:  # doctest: +SKIP
...     camera.order("lost_packets", 0.01)
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
    """Let threads that this one starts go before other programs, where that is allowed, as a camera exposes on time.

    They send a few milliseconds in a second; a busy host that makes them wait would be measured as a bad camera.
    """
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))


class Emulator:
    """The process of an emulated camera; it ends with the `with` block.

    `frames` is an NPZ file with `visible` and `infrared` as `FileFrames` has them, which are shown in turn; without it
    the test pattern of `size_px` (width, height) is. `clock` is by how many seconds and ppm the second chip's clock
    differs from the first one's. With `model="two-streams"` one device sends both chips.
    Raises OSError when the addresses are taken or missing.
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
        """Tell the camera what: a fault of `Faults` and its value, "line" for a trigger pulse, "reset".

        "sent" answers with the frames of each chip, "busy" with the processor seconds that the camera took.
        """
        assert self._process.stdin is not None
        print(*words, file=self._process.stdin, flush=True)
        return self._answer()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        answer = self._process.stdout.readline().strip()
        if not answer or answer.startswith("error"):
            self.close()
            raise OSError(f"the emulated camera: {answer.removeprefix('error: ') or 'it ended; see its message'}")
        return answer

    def close(self) -> None:
        """End the process; closing twice is allowed."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()
