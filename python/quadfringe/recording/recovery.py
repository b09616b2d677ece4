"""Rescue the shots of a recording whose writer was killed or whose disk failed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from quadfringe.errors import InputError
from quadfringe.files import atomic
from quadfringe.recording.reader import Recording
from quadfringe.recording.writer import RecordingWriter

__all__ = ["Recovered", "recover"]


@dataclass(frozen=True)
class Recovered:
    """The number of copied shots, and the indices of the damaged ones."""

    shots: int
    damaged: tuple[int, ...]


def recover(source: Path, target: Path) -> Recovered:
    """Copy every undamaged shot of `source` to the new recording `target`.

    The source is only read, because the repair tool of HDF5 (`h5clear`) can destroy a file whose writer was killed.
    Settings or a calibration that were changed are left out, with a `RecordingWarning`. A copy of a recording of
    version 1 says that its stamps were never verified. Raises `InputError` when `source` is no recording or `target`
    exists, and `RecordingError` when `source` cannot be read now, as it does not say which shots are sound.
    """
    if target.exists():
        raise InputError(f"{target}: exists already; recordings are never overwritten")
    with Recording(source, rescue=True) as recording, atomic(target) as temporary:
        temporary.unlink()
        damaged = []
        with RecordingWriter(temporary, recording.header) as writer:
            for index in range(len(recording)):
                shot = recording.read(index)
                if shot is None:
                    damaged.append(index)
                else:
                    writer.append(shot)
        return Recovered(writer.written, tuple(damaged))
