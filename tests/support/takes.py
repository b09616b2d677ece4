"""Recordings for tests, and changes of their files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py

from quadfringe.evaluation._takes import numbered_shot
from quadfringe.recording import Recorder

__all__ = ["SHOTS", "Change", "changed", "recorded"]

Change = Callable[[h5py.File], object]
SHOTS = 6


def recorded(path: Path, first: int = 0, shots: int = SHOTS) -> Path:
    with Recorder(path) as recorder:
        for number in range(first, first + shots):
            recorder.write(numbered_shot(number))
    return path


def changed(path: Path, change: Change) -> Path:
    """Change a file as another HDF5 program would, which leaves no seal."""
    with h5py.File(path, "r+") as file:
        change(file)
    return path
