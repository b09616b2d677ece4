"""The content of the HDF5 file of a recording as plain values, unchecked.

A damaged file can make HDF5 hang or crash. This module therefore runs in a helper process (`ask`), and imports little,
so that the process starts quickly.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from quadfringe.recording._params import OPEN_MAX

__all__ = ["Extent", "Stored", "ask", "close", "is_hdf5", "missing_bytes", "stated_bytes"]

SUPERBLOCK = struct.Struct("<8sB2xB16xQ")  # signature, version, flags and end of the file: superblocks 2 and 3 of HDF5
SIGNATURE = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class Stored:
    """Attributes, texts, and the shapes and dtypes of the datasets of a file; None stands for what is missing."""

    attributes: dict[str, Any]
    texts: dict[str, str]
    shapes: dict[str, tuple[int, ...]]
    dtypes: dict[str, str]
    chips: tuple[str, ...]
    closed: bool | None


@dataclass(frozen=True)
class Extent:
    """Where the pixels of an image begin in the file, byte; and their shape and dtype."""

    begin: int
    shape: tuple[int, ...]
    dtype: str


@dataclass(frozen=True)
class _Superblock:
    """Flags of writers that have not closed the file, and the length that the file states."""

    flags: int
    end: int


class _StoredFile:
    """An open file."""

    def __init__(self, path: str) -> None:
        self._file = _opened(Path(path))

    def describe(self) -> Stored:
        """Read everything but the shots."""
        file = self._file
        arrays = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset) and item.shape}
        stamps = arrays.get("chip_stamps")
        return Stored(
            {name: np.asarray(value).tolist() for name, value in file.attrs.items()},
            {name: file[name].asstr()[()] for name in ("config", "calibration") if name in file},
            {name: array.shape for name, array in arrays.items()},
            {name: array.dtype.str for name, array in arrays.items()},
            () if stamps is None else tuple(map(str, stamps.attrs["chips"])),
            bool(file["closed"][()]) if "closed" in file else None,
        )

    def numbers(self, name: str, count: int) -> NDArray[Any]:
        """Read the first rows of a dataset."""
        rows: NDArray[Any] = self._file[name][:count]
        return rows

    def extents(self, names: tuple[str, ...], index: int) -> dict[str, Extent] | None:
        """Find the images of a shot; None unless each is stored as it is, in one piece, as the writer does it."""
        found = {name: _extent(self._file[name], index) for name in names}
        whole = {name: extent for name, extent in found.items() if extent is not None}
        return whole if len(whole) == len(found) else None

    def images(self, names: tuple[str, ...], index: int) -> dict[str, NDArray[Any]]:
        """Read the images of a shot, however they are stored."""
        return {name: self._file[name][index] for name in names}

    def close(self) -> None:
        """Close the file; further calls do nothing."""
        self._file.close()


_files: dict[int, _StoredFile] = {}


def ask(path: str, number: int, method: str, *arguments: Any) -> Any:
    """Call a method of a file, which this process keeps open under its number until `close`, or opens again."""
    file = _files.pop(number, None) or _StoredFile(path)
    _files[number] = file  # the one last in use is the last of the dictionary
    while len(_files) > OPEN_MAX:
        close(next(iter(_files)))
    return getattr(file, method)(*arguments)


def close(number: int) -> None:
    """Close a file, if it is open."""
    if number in _files:
        _files.pop(number).close()


def _extent(dataset: h5py.Dataset, index: int) -> Extent | None:
    shape = dataset.shape[1:]
    if dataset.chunks != (1, *shape) or dataset.id.get_create_plist().get_nfilters():
        return None
    chunk = dataset.id.get_chunk_info_by_coord((index, *[0] * len(shape)))
    size = dataset.dtype.itemsize * int(np.prod(shape))
    return Extent(chunk.byte_offset, shape, dataset.dtype.str) if chunk.byte_offset and chunk.size == size else None


def _opened(path: Path) -> h5py.File:
    """Open a file; for several readers only where its writer has not closed it, or data are missing.

    In that mode (SWMR) HDF5 waits for a damaged table as for one that is about to be written, for minutes.
    """
    swmr = _superblock(path).flags != 0 or missing_bytes(path) > 0
    return h5py.File(path, "r", libver="latest", swmr=swmr)


def is_hdf5(path: Path) -> bool:
    """Return whether a file begins as the files of recordings do."""
    with path.open("rb") as file:
        return file.read(len(SIGNATURE)) == SIGNATURE


def stated_bytes(path: Path) -> int:
    """Return the length that a file states at its beginning."""
    return _superblock(path).end


def missing_bytes(path: Path) -> int:
    """Return how many of the stated bytes are missing."""
    return max(0, stated_bytes(path) - path.stat().st_size)


def _superblock(path: Path) -> _Superblock:
    with path.open("rb") as file:
        head = file.read(SUPERBLOCK.size)
    _, version, flags, end = SUPERBLOCK.unpack(head.ljust(SUPERBLOCK.size, b"\0"))
    return _Superblock(flags, end) if version >= 2 else _Superblock(0, 0)
