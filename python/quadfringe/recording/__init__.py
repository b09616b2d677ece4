"""Recordings: raw shots on disk that survive a crash; recorder, reader, replay, recovery and batch decoding.

Names are loaded when they are first used, because the helper process that reads a damaged file needs little of them.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import quadfringe as qf
>>> from quadfringe.recording import *
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> with TemporaryDirectory() as folder, qf.open(qf.SystemConfig(camera=small)) as scanner:
...     path = Path(folder) / "take.h5"
...     with Recorder(path, scanner.config, scanner.calibration) as recorder:
...         recorder.write(scanner.grab())
...     written = recorder.statistics()
...     with Recording(path) as take:
...         checked, header = take.verify(), take.header
...     copied = recover(path, Path(folder) / "whole.h5")
...     with RecordingWriter(Path(folder) / "more.h5", header) as writer:  # without the care for a full disk
...         writer.append(scanner.grab())
>>> isinstance(written, RecorderStatistics), written.written, written.refused
(True, 1, 0)
>>> isinstance(checked, Verification), checked.damaged, isinstance(copied, Recovered), copied.shots
(True, (), True, 1)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quadfringe.recording.reader import Recording, Verification
    from quadfringe.recording.recorder import Recorder, RecorderStatistics
    from quadfringe.recording.recovery import Recovered, recover
    from quadfringe.recording.writer import RecordingWriter

__all__ = [
    "Recorder",
    "RecorderStatistics",
    "Recording",
    "RecordingWriter",
    "Recovered",
    "Verification",
    "recover",
]

_MODULE_OF = {
    "Recorder": "recorder",
    "RecorderStatistics": "recorder",
    "Recording": "reader",
    "RecordingWriter": "writer",
    "Recovered": "recovery",
    "Verification": "reader",
    "recover": "recovery",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'quadfringe.recording' has no attribute {name!r}")
    return getattr(import_module(f"quadfringe.recording.{_MODULE_OF[name]}"), name)
