"""The images of the emulated chips: frames from a file, or a test pattern that encodes the exposure number."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadfringe.devices.emulator._registers import PIXEL_FORMATS

__all__ = ["FileFrames", "Source", "TestPattern", "packed"]

NAMES = {value: name for name, value in PIXEL_FORMATS.items()}


class Source(Protocol):
    """Returns the pixels of chip 0 (visible) or 1 (infrared) at an exposure."""

    shape: tuple[int, int]

    def frame(self, chip: int, exposure: int, bits: int) -> NDArray[Any]:
        """Return pixels (H, W), or (H, W, 3) of a colour image, as unsigned integers of `bits` bits."""


class TestPattern:
    """Noise that changes with every exposure; the first two pixels hold the exposure number modulo 65536.

    >>> from quadfringe.devices.emulator.frames import TestPattern
    >>> frame = TestPattern((48, 64)).frame(0, 700, 8)
    >>> TestPattern.exposure(frame)
    700
    """

    __test__ = False

    def __init__(self, shape: tuple[int, int]) -> None:
        self.shape = shape
        self._noise = [np.random.default_rng(chip).integers(0, 1 << 16, shape, dtype=np.uint16) for chip in (0, 1)]
        self._bytes = [(noise >> np.uint16(8)).astype(np.uint8) for noise in self._noise]

    def frame(self, chip: int, exposure: int, bits: int) -> NDArray[Any]:
        """Return the pattern of a chip at an exposure."""
        step = exposure * 40503 & (1 << bits) - 1
        frame: NDArray[Any]
        if bits == 8:
            frame = self._bytes[chip] + np.uint8(step)
        else:
            frame = (self._noise[chip] >> np.uint16(16 - bits)) + np.uint16(step) & np.uint16((1 << bits) - 1)
        frame[0, :2] = exposure & 255, exposure >> 8 & 255
        return frame

    @staticmethod
    def exposure(frame: NDArray[Any]) -> int:
        """Decode the exposure number modulo 65536."""
        return int(frame[0, 0]) + 256 * int(frame[0, 1])


class FileFrames:
    """Frames of an NPZ file with `visible` (N, H, W) or (N, H, W, 3) and `infrared` (N, H, W), sent in turn."""

    def __init__(self, file: Path) -> None:
        with np.load(file) as stored:
            self._chips = (stored["visible"], stored["infrared"])
        self.shape = self._chips[1].shape[1:3]

    def frame(self, chip: int, exposure: int, bits: int) -> NDArray[Any]:
        """Return the frame of an exposure; 8-bit frames are scaled to deeper formats."""
        frame: NDArray[Any] = self._chips[chip][exposure % len(self._chips[chip])]
        return frame if bits == 8 or frame.dtype != np.uint8 else frame.astype(np.uint16) << (bits - 8)


def packed(source: Source, chip: int, exposure: int, pixel_format: int, size_px: tuple[int, int]) -> memoryview[int]:
    """Return the payload of a frame of `size_px` (width, height) in a GenICam pixel format; possibly a view."""
    name = NAMES[pixel_format]
    bits = int("".join(letter for letter in name if letter.isdigit()))
    frame = source.frame(chip, exposure, bits)[: size_px[1], : size_px[0]]
    if name == "RGB8" and frame.ndim == 2:
        frame = np.repeat(frame[:, :, None], 3, axis=2)
    if name.endswith("p"):  # a stream of bits, the low ones first
        stream = np.unpackbits(frame.astype("<u2").reshape(-1, 1).view(np.uint8), axis=1, bitorder="little")[:, :bits]
        return _bytes(np.packbits(stream, bitorder="little"))
    if not name.endswith("Packed"):
        return _bytes(frame)
    pairs = frame.reshape(-1, 2)
    low = bits - 8
    out = np.empty((len(pairs), 3), np.uint8)
    out[:, 0], out[:, 2] = pairs[:, 0] >> low, pairs[:, 1] >> low
    out[:, 1] = (pairs[:, 0] & (1 << low) - 1) | (pairs[:, 1] & (1 << low) - 1) << 4
    return _bytes(out)


def _bytes(frame: NDArray[Any]) -> memoryview[int]:
    return np.ascontiguousarray(frame).view(np.uint8).reshape(-1).data
