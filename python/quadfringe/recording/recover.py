"""What a killed writer or a bad disk left, copied into a new and whole recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from quadfringe.errors import InputError
from quadfringe.files import atomic
from quadfringe.recording._layout import crcs_of
from quadfringe.recording.reader import Recording
from quadfringe.recording.writer import RecordingWriter

__all__ = ["Recovered", "recover"]


@dataclass(frozen=True)
class Recovered:
    """How many shots were copied, and the places of those that were damaged."""

    shots: int
    damaged: tuple[int, ...]


def recover(source: Path, target: Path) -> Recovered:
    """Copy every shot of `source` whose bytes are as recorded into `target`, whole or not at all.

    The source is only read: HDF5's own repair (`h5clear`) can destroy a file that its writer was killed over.
    Raises `InputError` when nothing can be read, or when `target` exists.
    """
    if target.exists():
        raise InputError(f"{target}: exists already; recordings are never overwritten")
    with Recording(source) as take, atomic(target) as temporary:
        temporary.unlink()
        damaged = []
        with RecordingWriter(temporary, take.header) as writer:
            for index in range(len(take)):
                images = take.images(index)
                if images is None:
                    damaged.append(index)
                else:
                    writer.append_images(images, take.stamp(index), crcs_of(images))
        return Recovered(len(take) - len(damaged), tuple(damaged))
