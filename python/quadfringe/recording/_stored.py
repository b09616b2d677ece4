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

from quadfringe.files import TEXT_BYTES
from quadfringe.recording._held import FileId
from quadfringe.recording._params import OPEN_MAX

__all__ = ["Extent", "Place", "ReplacedError", "Stored", "ask", "close", "is_hdf5", "missing_bytes", "stated_bytes"]

ARRAYS = ("red", "green", "blue", "ir", "raw", "id", "time_us", "chip_stamps", "crc32")
TEXTS = ("config", "calibration")
ATTRIBUTE_BYTES = 1 << 16  # of one attribute; the longest of a recording has some 100

SUPERBLOCK = struct.Struct("<8sB2xB16xQ")  # signature, version, flags and end of the file: superblocks 2 and 3 of HDF5
SIGNATURE = b"\x89HDF\r\n\x1a\n"


class ReplacedError(OSError):
    """The path names another file than before, or none."""


@dataclass(frozen=True)
class Place:
    """Where a file is, and which one it is; `key` is that of the reader, whom no other reader in any process equals."""

    path: str
    id: FileId
    key: str


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
    """An open file, which holds everything itself: what a link or an external dataset names is another file."""

    def __init__(self, place: Place) -> None:
        _require_same(place)
        self._file = _opened(Path(place.path))
        _require_same(place)

    def describe(self) -> Stored:
        """Read everything but the shots."""
        arrays = {name: self._dataset(name) for name in ARRAYS if name in self._file}
        arrays = {name: array for name, array in arrays.items() if array.shape}
        stamps = arrays.get("chip_stamps")
        return Stored(
            {name: _attribute(self._file, name) for name in self._file.attrs},
            {name: _text(self._dataset(name)) for name in TEXTS if name in self._file},
            {name: array.shape for name, array in arrays.items()},
            {name: array.dtype.str for name, array in arrays.items()},
            () if stamps is None else tuple(map(str, _attribute(stamps, "chips"))),
            bool(self._dataset("closed")[()]) if "closed" in self._file else None,
        )

    def _dataset(self, name: str) -> h5py.Dataset:
        """Return a dataset; raise ValueError for one that is elsewhere, or is none."""
        if isinstance(self._file.get(name, getlink=True), h5py.HardLink):
            found = self._file[name]
            if isinstance(found, h5py.Dataset) and not found.is_virtual and found.external is None:
                return found
        raise ValueError(f"{name} is no dataset of this file itself, as in every recording")

    def numbers(self, name: str, count: int) -> NDArray[Any]:
        """Read the first rows of a dataset."""
        rows: NDArray[Any] = self._dataset(name)[:count]
        return rows

    def extents(self, names: tuple[str, ...], index: int) -> dict[str, Extent] | None:
        """Find the images of a shot; None unless each is stored as it is, in one piece, as the writer does it."""
        found = {name: _extent(self._dataset(name), index) for name in names}
        whole = {name: extent for name, extent in found.items() if extent is not None}
        return whole if len(whole) == len(found) else None

    def images(self, names: tuple[str, ...], index: int) -> dict[str, NDArray[Any]]:
        """Read the images of a shot, however they are stored."""
        return {name: self._dataset(name)[index] for name in names}

    def close(self) -> None:
        """Close the file; further calls do nothing."""
        self._file.close()


def _attribute(holder: h5py.HLObject, name: str) -> Any:
    short = holder.attrs.get_id(name).get_storage_size() <= ATTRIBUTE_BYTES
    value = np.asarray(holder.attrs[name]).tolist() if short else None
    if not short or len(str(value)) > ATTRIBUTE_BYTES:
        raise ValueError(f"the attribute {name} has more than {ATTRIBUTE_BYTES} bytes")
    return value


def _text(dataset: h5py.Dataset) -> str:
    text = dataset.asstr()[()]
    if not isinstance(text, str):
        raise TypeError(f"{dataset.name} is no text")
    if len(text) > TEXT_BYTES:
        raise ValueError(f"{dataset.name} has {len(text) / 1e6:.0f} MB; expected at most {TEXT_BYTES / 1e6:.0f} MB")
    return text


_files: dict[str, _StoredFile] = {}


def ask(closed: list[str], place: Place, method: str, *arguments: Any) -> Any:
    """Close some files, then call a method of another, which stays open under its key or is opened again."""
    close(closed)
    file = _files.pop(place.key, None) or _StoredFile(place)
    _files[place.key] = file  # the one last in use is the last of the dictionary
    close(list(_files)[:-OPEN_MAX])
    return getattr(file, method)(*arguments)


def close(keys: list[str]) -> None:
    """Close the files with these keys that are open."""
    for key in keys:
        if key in _files:
            _files.pop(key).close()


def _require_same(place: Place) -> None:
    """Raise `ReplacedError` unless the path names the file that the reader holds."""
    try:
        same = FileId.of(Path(place.path).stat()) == place.id
    except FileNotFoundError:
        same = False
    if not same:
        raise ReplacedError("it was removed, or replaced by another file, since it was opened")


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
    # Not locked: other programs may write to the file, whose changes the checksums tell.
    return h5py.File(path, "r", libver="latest", swmr=swmr, locking=False)


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
