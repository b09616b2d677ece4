"""Write a recording shot by shot; a shot is safe on file when `append` returns, whatever happens afterwards."""

from __future__ import annotations

import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Stamp
from quadfringe.errors import InputError, RecordingError
from quadfringe.recording._checksums import crc_of_shot, crcs_of
from quadfringe.recording._layout import Header, frames_of, make_datasets
from quadfringe.recording._seal import pixel_extents, write_seal

__all__ = ["RecordingWriter", "require_room"]

RESERVE_BYTES = 8 << 20  # room for the tables of HDF5 and for closing the file
READABLE_SINCE = ("v110", "v110")  # the file format of HDF5 1.10, the first that survives a killed writer


class RecordingWriter:
    """Writes shots to a new file; use it in a `with` block, from one thread.

    The file uses the single-writer multiple-reader mode of HDF5: it can be read while it grows, and every shot for
    which `append` has returned stays readable when the process is killed. Raises `InputError` when the file exists or
    cannot be created, and `RecordingError` when the disk is full or fails.
    """

    def __init__(self, path: Path | str, header: Header) -> None:
        self.path, self.header = Path(path), header
        self.written = 0
        self._failed = False
        created = _create(self.path, header)
        self._file, self._header_sha256 = created.file, created.header_sha256
        self._datasets = {name: self._file[name] for name in self._file if self._file[name].chunks}  # slow to look up
        self._dtypes = {name: dataset.dtype for name, dataset in self._datasets.items()}

    def append(self, shot: AnyShot) -> None:
        """Write one shot, which is safe on return. A shot without a stamp gets the next number and the current time."""
        self.header.require_alike(shot)
        require_room(self.path.parent, self.header.shot_bytes, self.written)
        images = {name: np.ascontiguousarray(image) for name, image in shot.images.items()}
        stamp = shot.stamp or Stamp(self.written, time.time_ns() // 1000, "", {})
        try:
            self._write(images, stamp)
        except (OSError, RuntimeError) as error:  # h5py raises both for a write that failed
            self._failed = True
            raise RecordingError(
                f"{self.path}: shot {self.written} could not be written: {_first_line(error)}; "
                f"the {self.written} shots before it are safe"
            ) from error
        except BaseException:  # Ctrl-C in the middle of a shot
            self._failed = True
            raise
        self.written += 1

    def _write(self, images: dict[str, NDArray[Any]], stamp: Stamp) -> None:
        n, datasets = self.written, self._datasets
        for name, image in images.items():
            place = datasets[name].id
            place.set_extent((n + 1, *image.shape))
            place.write_direct_chunk((n, 0, 0), image)
        frames, crcs = frames_of(stamp), crcs_of(images)
        crcs.append(crc_of_shot(self._header_sha256, n, (stamp.id, stamp.time_us), frames, crcs))
        rows: dict[str, Any] = {"id": stamp.id, "time_us": stamp.time_us, "crc32": crcs}
        if frames:
            rows["chip_stamps"] = frames
        for name, value in rows.items():
            _append_row(datasets[name].id, n, np.asarray(value, self._dtypes[name]))
        self._file.flush()  # the whole file: after a flush of single datasets, h5clear would lose data

    def close(self) -> None:
        """Close the file, mark it as closed and seal it, unless a write failed; further calls do nothing."""
        if not self._file.id.valid:
            return
        with suppress(OSError, RuntimeError):
            self._file["closed"][()] = not self._failed
            extents = pixel_extents([self._datasets[name] for name in self.header.images])
            self._file.close()
            if not self._failed:
                write_seal(self.path, extents, self.written)
        with suppress(OSError, RuntimeError):
            self._file.close()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def require_room(folder: Path, shot_bytes: int, written: int) -> None:
    """Raise `RecordingError` unless the disk has room for one more shot, so that HDF5 never runs out of space."""
    free = shutil.disk_usage(folder).free
    if free < shot_bytes + RESERVE_BYTES:
        raise RecordingError(
            f"{folder}: the disk is full ({free / 1e6:.0f} MB left); free space; the {written} shots written before "
            "are safe"
        )


@dataclass(frozen=True)
class _Created:
    """A new file, and the SHA-256 of its header."""

    file: h5py.File
    header_sha256: str


def _create(path: Path, header: Header) -> _Created:
    if path.suffix != ".h5":
        raise InputError(f"{path}: expected a name that ends in .h5")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it first")
    require_room(path.parent, header.shot_bytes, 0)
    try:
        file = h5py.File(path, "x", libver=READABLE_SINCE)
    except FileExistsError as error:
        raise InputError(f"{path}: exists already; recordings are never overwritten") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be created: {_first_line(error)}") from error
    try:
        header_sha256 = header.write(file)
        make_datasets(file, header)
        file.swmr_mode = True
        file.flush()
    except (OSError, RuntimeError) as error:
        with suppress(OSError, RuntimeError):
            file.close()
        path.unlink(missing_ok=True)
        raise RecordingError(f"{path}: cannot be written: {_first_line(error)}") from error
    return _Created(file, header_sha256)


def _append_row(dataset: h5py.h5d.DatasetID, n: int, row: NDArray[Any]) -> None:
    """Append row `n` to a dataset: like `dataset[n] = row`, but without its overhead."""
    dataset.set_extent((n + 1, *row.shape))
    place = dataset.get_space()
    place.select_hyperslab((n, *[0] * row.ndim), (1, *row.shape))
    dataset.write(h5py.h5s.create_simple((1, *row.shape)), place, row)


def _first_line(error: BaseException) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
