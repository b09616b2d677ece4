"""Read a recording as a sequence of shots, also while it is being written, and after its writer was killed."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import SystemConfig, shortened
from quadfringe.data import AnyShot, Calibration
from quadfringe.errors import InputError, RecordingError, RecordingWarning
from quadfringe.files import kind_of
from quadfringe.recording._checksums import crcs_of
from quadfringe.recording._held import HeldFile
from quadfringe.recording._layout import UNVERIFIED, Header, StoredHeader
from quadfringe.recording._seal import Seal, read_seal
from quadfringe.recording._source import DamageError, Source, UnreadableError
from quadfringe.recording._stored import is_hdf5, missing_bytes, stated_bytes
from quadfringe.recording._table import FileSize, read_table

__all__ = ["Recording", "Verification", "listed"]

AGAIN = "copy it again from where it was recorded"
UNVERIFIABLE = (
    "recorded by an earlier version: stamps, settings and calibration have no checksums and cannot be verified"
)
COPIED = "copied from a recording of an earlier version, whose stamps, settings and calibration could not be verified"
OTHER_SHOTS = "quadfringe recover rescues the others"
TRY = "try again, and suspect the file if that does not help"
UNMATCHED = "it does not match its checksum"
LISTED = 10  # shots that a message names


@dataclass(frozen=True)
class Verification:
    """Number of shots, indices of the damaged ones, and what else differs from the recording as it was closed."""

    shots: int
    damaged: tuple[int, ...]
    faults: tuple[str, ...]


class Recording:
    """The shots of one file, oldest first; close it, or use it in a `with` block.

    The file may still grow; `len` counts the shots that were complete when it was opened. Header, settings, calibration
    and every shot (pixels and stamp) are checked against their checksums. A helper process with a limit of time and
    memory reads the file, because a damaged one can hang or crash HDF5. `faults` says in words how the file differs
    from what was recorded; it is found without reading pixels. A copy made by pickle opens the file anew.

    Raises `InputError` for a file that is missing, no recording, or has a damaged header, and warns with
    `RecordingWarning` of a file that is incomplete, was changed, or has no checksums. A changed text of settings or
    calibration is an `InputError`, too; with `rescue` it is left out (None) and the warning says so. Opening and every
    read raise `RecordingError` for a file that cannot be read now, damaged or not: HDF5 needs too long, another process
    ends the helper, the file was replaced or shortened. After `close`, reads raise `ValueError`.

    >>> with Recording("take.h5") as take:                                          # doctest: +SKIP
    ...     shapes = [decoder.decode(shot) for shot in take]
    """

    def __init__(self, path: Path | str, *, rescue: bool = False) -> None:
        self.path = Path(path)
        self._rescue = rescue
        _require_hdf5(self.path)
        file = _held(self.path)
        seal = read_seal(self.path)
        self._source = Source(self.path, file, sealed=seal is not None)
        with self._closed_on_error():
            stored = self._source.describe()
            self._header = StoredHeader.of(stored)
            if self._header.changed_texts and not rescue:
                raise InputError(
                    f"{self._header.changed_texts[0]} was changed; quadfringe recover copies the shots without it"
                )
            self._closed = bool(stored.closed) or seal is not None
            size = FileSize(file.size, stated_bytes(self.path), file.tables_most)
            self._table = read_table(self._source, stored, self._header, size, seal)
            if not self._closed and len(self) and isinstance(self._found(-1), str):
                self._table = self._table.without_last  # its writer did not finish it
        self.faults = tuple(self._found_faults(seal))
        if told := [*self.faults, *self._found_doubts()]:
            warnings.warn(f"{path}: {'; '.join(told)}", RecordingWarning, stacklevel=2)

    @contextmanager
    def _closed_on_error(self) -> Iterator[None]:
        """Close the file when it cannot be opened as a recording, and name it in the error."""
        try:
            yield
        except DamageError as error:
            self._source.close()
            missing = missing_bytes(self.path)
            what = f"cut short by {missing} bytes" if missing else "damaged recording"
            raise InputError(f"{self.path}: {what}: {error}; {AGAIN}") from error
        except UnreadableError as error:
            self._source.close()
            missing = missing_bytes(self.path) if self.path.exists() else 0
            what = f"{missing} bytes are missing, and it cannot be read" if missing else "cannot be read"
            raise RecordingError(f"{self.path}: {what}: {error}; {AGAIN if missing else TRY}") from error
        except InputError as error:
            self._source.close()
            raise type(error)(f"{self.path}: {error}") from error

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Recording, self.path.absolute(), rescue=self._rescue), ()

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
    def header(self) -> Header:
        """The properties that all shots share."""
        return self._header.header

    @property
    def verifiable(self) -> bool:
        """False for recordings of earlier versions, which have checksums of images only, and for copies of them."""
        return not self.header.origin

    @property
    def closed_in_order(self) -> bool:
        """False while the file is being written, and after its writer was killed."""
        return self._closed

    @property
    def ids(self) -> NDArray[np.uint64]:
        """Exposure numbers, (N,); gaps are exposures that did not become a shot; 0 where `stamped` is False."""
        return self._table.ids.copy()

    @property
    def times_us(self) -> NDArray[np.int64]:
        """Start of every exposure, (N,), us since 1970 UTC; 0 where `stamped` is False."""
        return self._table.times_us.copy()

    @property
    def stamped(self) -> NDArray[np.bool_]:
        """False for shots whose stamp does not match its checksum, (N,)."""
        return self._table.sound.copy()

    @property
    def sha256(self) -> str:
        """The identity of the recording: SHA-256 of its header, stamps and CRC-32 of images, 64 hexadecimal digits."""
        return self._table.sha256(self._header)

    def __len__(self) -> int:
        return len(self._table)

    def __iter__(self) -> Iterator[AnyShot]:
        for index in range(len(self)):
            yield self[index]

    def __getitem__(self, index: int) -> AnyShot:
        shot = self._shot(index)
        if isinstance(shot, str):
            raise InputError(f"{self.path}: shot {index % len(self)} is damaged ({shot}); {OTHER_SHOTS}")
        return shot

    def read(self, index: int) -> AnyShot | None:
        """Return a shot, or None when its images or its stamp are damaged."""
        shot = self._shot(index)
        return None if isinstance(shot, str) else shot

    def _shot(self, index: int) -> AnyShot | str:
        try:
            return self._found(index)
        except UnreadableError as error:
            place = index % len(self)
            raise RecordingError(
                f"{self.path}: shot {place} cannot be read: {error}; open the recording again to try again"
            ) from error

    def _found(self, index: int) -> AnyShot | str:
        """Return a shot, or in words how it is damaged."""
        place = index + len(self) if index < 0 else index
        if not 0 <= place < len(self):
            raise IndexError(f"{self.path}: expected a shot from 0 to {len(self) - 1}, got {index}")
        if not self._table.sound[place]:
            return UNMATCHED
        try:
            images = self._source.images(self.header.images, place)
        except DamageError as error:
            return str(error)
        if crcs_of(images) != self._table.crc32[place, : len(images)].tolist():
            return UNMATCHED
        return self.header.shot(images, self._table.stamp(place, self.header))

    def verify(self, indices: Iterable[int] | None = None) -> Verification:
        """Check every shot, or those of `indices`, against its checksums; report what is wrong."""
        chosen = range(len(self)) if indices is None else indices
        return Verification(len(self), tuple(i for i in chosen if self.read(i) is None), self.faults)

    def _found_faults(self, seal: Seal | None) -> Iterator[str]:
        missing = missing_bytes(self.path)
        if missing >= (1 if self._closed else self.header.shot_bytes):
            yield f"cut short by {missing} bytes; {AGAIN}"
        elif self._closed and self._header.sha256 and (seal is None or not seal.holds):
            yield f"changed since it was closed, so every shot is checked by itself; {AGAIN}"
        for name in self._header.changed_texts:
            yield f"{name} was changed, and is left out"
        if bad := np.flatnonzero(~self._table.sound).tolist():
            yield f"no sound stamps of {len(bad)} shots: {listed(bad)}"

    def _found_doubts(self) -> Iterator[str]:
        if not self._header.sha256:
            yield UNVERIFIABLE
        elif self.header.origin == UNVERIFIED:
            yield COPIED

    def close(self) -> None:
        """Close the file; further calls do nothing."""
        self._source.close()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def listed(indices: Sequence[int]) -> str:
    """Return the first indices in words."""
    more = ", ..." if len(indices) > LISTED else ""
    return ", ".join(map(str, indices[:LISTED])) + more


def _held(path: Path) -> HeldFile:
    try:
        return HeldFile(path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error


def _require_hdf5(path: Path) -> None:
    if not path.is_file():
        kind = kind_of(path)
        words = {"folder": "a folder; name a recording (.h5) in it", "": "no such file; check the path"}
        raise InputError(f"{path}: {words.get(kind, f'is a {kind}; name a file')}")
    try:
        foreign = not is_hdf5(path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    if foreign:
        raise InputError(f"{path}: expected an HDF5 recording of quadfringe record, got another format")
