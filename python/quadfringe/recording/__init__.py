"""Recordings: raw shots on disk that survive a crash; recorder, reader, replay, recovery and batch decoding.

Names are loaded when they are first used, because the helper process that reads a damaged file needs little of them.
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
