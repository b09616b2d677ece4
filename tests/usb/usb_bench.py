"""Helpers of the tests in the umockdev testbed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray


class Screen:
    """The screen of an X server in memory."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def rgb(self) -> NDArray[np.uint8]:
        """Red, green, blue of every pixel: the file is in the format of xwd, 32 bit per pixel."""
        raw = self._file.read_bytes()
        header = np.frombuffer(raw, ">u4", 25)
        size, width, height, line, colours = (int(header[i]) for i in (0, 4, 5, 12, 19))
        rows = np.frombuffer(raw, np.uint8, height * line, size + 12 * colours).reshape(height, line)
        return rows[:, : 4 * width].reshape(height, width, 4)[:, :, 2::-1]
