"""Two fake cameras of Aravis that show the test pattern: an implementation of GigE Vision independent of ours.

    python -m quadfringe.evaluation._aravis_fake WIDTH HEIGHT RATE_HZ ADDRESS ADDRESS

Prints "ready" when both run. Each line on stdin is answered by a line of JSON with the exposures that each camera has
sent; the end of stdin ends the process. A C callback fills the frames. The callback that the binding sets is freed at
once and crashes, so this module sets it through ctypes and keeps it alive. The cameras share no clock except the
period: one that wakes more than a period late skips an exposure.
"""

from __future__ import annotations

import ctypes
import json
import os
import sys
from typing import Any

import gi
import numpy as np

gi.require_version("Aravis", "0.8")
from gi.repository import Aravis  # noqa: E402

from quadfringe.devices.emulator import keep_pace  # noqa: E402
from quadfringe.devices.emulator.frames import TestPattern, packed  # noqa: E402

Fill = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32)
WIDTH, HEIGHT, SENSOR_WIDTH, SENSOR_HEIGHT, PERIOD_US = 0x100, 0x104, 0x11C, 0x118, 0x138
library = ctypes.CDLL("libaravis-0.8.so.0")
library.arv_buffer_get_data.restype = ctypes.c_void_p
library.arv_buffer_get_data.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
library.arv_buffer_get_timestamp.restype = ctypes.c_uint64
library.arv_buffer_get_timestamp.argtypes = [ctypes.c_void_p]
library.arv_buffer_set_timestamp.argtypes = [ctypes.c_void_p, ctypes.c_uint64]
library.arv_fake_camera_set_fill_pattern.argtypes = [ctypes.c_void_p, Fill, ctypes.c_void_p, ctypes.c_void_p]
library.arv_fake_camera_set_fill_pattern.restype = None
unwrap = ctypes.pythonapi.PyCapsule_GetPointer
unwrap.restype, unwrap.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]


class Chip:
    """One fake camera whose frames carry the number of the period that they belong to."""

    def __init__(self, index: int, address: str, source: TestPattern, rate_hz: float) -> None:
        self._camera = Aravis.GvFakeCamera(interface_name=address, serial_number=f"FAKE{index}")
        assert self._camera.is_running(), f"{address} is taken"
        self._index, self._source = index, source
        self._period_ns = round(1e6 / rate_hz) * 1000
        self.sent: list[int] = []
        self._device = self._camera.get_fake_camera()
        height, width = source.shape
        self._size_px = width, height
        start = {
            SENSOR_WIDTH: width,
            SENSOR_HEIGHT: height,
            WIDTH: width,
            HEIGHT: height,
            PERIOD_US: self._period_ns // 1000,
        }
        for register, value in start.items():
            self._device.write_register(register, value)
        self._callback = Fill(self._fill)
        library.arv_fake_camera_set_fill_pattern(unwrap(self._device.__gpointer__, None), self._callback, None, None)

    def _fill(self, buffer: int, _data: Any, _exposure: int, _gain: int, pixel_format: int) -> None:
        # Both cameras wake at multiples of the period; a late one keeps its place in the row.
        now = library.arv_buffer_get_timestamp(buffer) // self._period_ns
        exposure = max(self.sent[-1] + 1, now) if self.sent else now
        frame = np.frombuffer(packed(self._source, self._index, exposure, pixel_format, self._size_px), np.uint8)
        ctypes.memmove(library.arv_buffer_get_data(buffer, None), frame.ctypes.data, frame.nbytes)
        library.arv_buffer_set_timestamp(buffer, exposure * self._period_ns)
        self.sent.append(exposure)


def main() -> None:
    """Run both cameras until stdin ends."""
    width, height, rate_hz = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    source = TestPattern((height, width))
    keep_pace()
    chips = [Chip(index, address, source, rate_hz) for index, address in enumerate(sys.argv[4:6])]
    print("ready", flush=True)
    for _ in sys.stdin:
        print(json.dumps([[exposure % 65536 for exposure in chip.sent] for chip in chips]), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()
