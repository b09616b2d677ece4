"""Read a recording as a sequence of shots, also while it is being written, and after its writer was killed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from quadfringe.config import SystemConfig, shortened
from quadfringe.data import AnyShot, Calibration, Stamp
from quadfringe.errors import InputError
from quadfringe.recording._layout import Header, crcs_of, stamp_at

__all__ = ["Recording"]

LAST_SHOT_BYTES = 64 << 20  # upper bound of an unfinished shot: four 16-bit images of 8 million pixels
LOOK_S = 30.0  # limit for the process that checks a cut file: a busy machine starts it slowly
LOOK = """
import h5py, sys
with h5py.File(sys.argv[1], "r", libver="latest", swmr=True) as file:
    for name in file:
        if file[name].chunks:
            [file[name].id.get_chunk_info(i) for i in range(file[name].id.get_num_chunks())]
"""


class Recording:
    """The shots of one file, oldest first; close it, or use it in a `with` block.

    The file may still grow; `len` counts the shots that were complete when it was opened. Every shot is checked against
    its CRC-32. Raises `InputError` for a file that is missing, damaged, or no recording.

    >>> with Recording("take.h5") as take:                                          # doctest: +SKIP
    ...     shapes = [decoder.decode(shot) for shot in take]
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._file = _open(self.path)
        try:
            self.header = Header.read(self._file, str(path))
            self._length = self._complete()
        except (OSError, RuntimeError, KeyError, ValueError) as error:
            self._file.close()
            if isinstance(error, InputError):
                raise
            raise InputError(f"{path}: damaged recording: {error}; copy it again from where it was recorded") from error

    def __repr__(self) -> str:
        size = f"{self.header.width_px} x {self.header.height_px} {self.header.dtype}"
        return shortened(f"Recording({self.path.name}, {len(self)} shots of {size})")

    @property
    def config(self) -> SystemConfig | None:
        """The resolved settings of the system that made the recording."""
        return self.header.config

    @property
    def calibration(self) -> Calibration | None:
        """The calibration of the system that made the recording."""
        return self.header.calibration

    @property
    def closed_in_order(self) -> bool:
        """False while the file is being written, and after its writer was killed."""
        return bool(self._file["closed"][()])

    @property
    def ids(self) -> NDArray[np.uint64]:
        """Exposure numbers, (N,); gaps are exposures that did not become a shot."""
        ids: NDArray[np.uint64] = self._file["id"][: self._length]
        return ids

    @property
    def times_us(self) -> NDArray[np.int64]:
        """Start of every exposure, (N,), us since 1970 UTC."""
        times: NDArray[np.int64] = self._file["time_us"][: self._length]
        return times

    def __len__(self) -> int:
        return self._length

    def __iter__(self) -> Iterator[AnyShot]:
        for index in range(len(self)):
            yield self[index]

    def __getitem__(self, index: int) -> AnyShot:
        place = index + self._length if index < 0 else index
        if not 0 <= place < self._length:
            raise IndexError(f"{self.path}: expected a shot from 0 to {self._length - 1}, got {index}")
        images = self.images(place)
        if images is None:
            raise InputError(
                f"{self.path}: shot {place} is damaged (CRC mismatch); quadfringe recover rescues the others"
            )
        return self.header.shot(images, self.stamp(place))

    def stamp(self, index: int) -> Stamp:
        """Return the stamp of a shot."""
        return stamp_at(self._file, self.header, index)

    def images(self, index: int) -> dict[str, NDArray[Any]] | None:
        """Return the images of a shot, or None when they do not match their CRC-32."""
        try:
            images = {name: self._file[name][index] for name in self.header.images}
            expected = self._file["crc32"][index].tolist()
        except OSError:
            return None
        return images if crcs_of(images) == expected else None

    def _complete(self) -> int:
        """Count the complete shots; a shot that its writer left unfinished is the last and fails its CRC-32."""
        length = min(len(self._file[name]) for name in (*self.header.images, "id", "time_us", "crc32"))
        if not self.closed_in_order:
            while length and self.images(length - 1) is None:
                length -= 1
        return int(length)

    def close(self) -> None:
        """Close the file; further calls do nothing."""
        self._file.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _open(path: Path) -> h5py.File:
    if not path.is_file():
        reason = "a folder; name a recording (.h5) in it" if path.is_dir() else "no such file; check the path"
        raise InputError(f"{path}: {reason}")
    if not h5py.is_hdf5(path):
        raise InputError(f"{path}: expected an HDF5 recording of quadfringe record, got another format")
    try:
        file = h5py.File(path, "r", libver="latest", swmr=True)
    except (OSError, RuntimeError) as error:
        raise InputError(f"{path}: damaged or cut short: {str(error).splitlines()[0]}; copy it again") from error
    missing = file.id.get_filesize() - path.stat().st_size
    if missing > 0 and not (missing < LAST_SHOT_BYTES and _has_its_tables(path)):
        file.close()
        raise InputError(f"{path}: cut short by {missing} bytes; copy it again from where it was recorded")
    return file


def _has_its_tables(path: Path) -> bool:
    """Return whether every index table of a cut file is present: a failed writer wrote them before the missing data.

    HDF5 waits forever for a missing table and cannot be interrupted, so another process reads them.
    """
    with suppress(subprocess.TimeoutExpired):
        return (
            subprocess.run([sys.executable, "-c", LOOK, str(path)], capture_output=True, timeout=LOOK_S).returncode == 0
        )
    return False
