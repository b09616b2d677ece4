"""The stamps and checksums of all shots of a file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import FrameStamp, Stamp
from quadfringe.errors import InputError
from quadfringe.recording._checksums import crcs_of_shots, sha256_of
from quadfringe.recording._layout import Header, StoredHeader
from quadfringe.recording._seal import Seal
from quadfringe.recording._source import Source
from quadfringe.recording._stored import Stored

__all__ = ["FileSize", "Table", "read_table"]

HOLES_BYTES = 1 << 28  # of a shot that may be holes, as in copies of black images; as many as those of image files


@dataclass(frozen=True)
class FileSize:
    """The number of bytes that a file has, that it states at its beginning, and that its tables may have."""

    found: int
    stated: int
    tables_most: int


@dataclass(frozen=True)
class Table:
    """One row for each of N shots; a row that is not `sound` is missing or changed, and holds zeros.

    ids (N,), times_us (N,), chip_stamps (N, chips, 3), crc32 (N, images, and one for the shot), sound (N,).
    """

    ids: NDArray[np.uint64]
    times_us: NDArray[np.int64]
    chip_stamps: NDArray[np.int64]
    crc32: NDArray[np.uint32]
    sound: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def without_last(self) -> Self:
        """The same without the last shot."""
        return replace(self, **{name: rows[:-1] for name, rows in vars(self).items()})

    def sha256(self, header: StoredHeader) -> str:
        """Return the SHA-256 of header and table, in hexadecimal digits."""
        return sha256_of(header.identity, self.ids, self.times_us, self.chip_stamps, self.crc32)

    def stamp(self, index: int, header: Header) -> Stamp:
        """Return the stamp of a shot."""
        rows = self.chip_stamps[index].tolist()
        frames = {chip: FrameStamp(*row) for chip, row in zip(header.chips, rows, strict=True)}
        return Stamp(int(self.ids[index]), int(self.times_us[index]), header.device, frames)


def read_table(source: Source, stored: Stored, header: StoredHeader, size: FileSize, seal: Seal | None) -> Table:
    """Read the table of a file; raises `InputError` when it claims more shots than its size allows.

    In a closed file, a shot that any dataset or the seal holds counts, and is not sound when others lack it. In another
    file, the last shot may be unfinished.
    """
    images, chips = header.header.images, header.header.chips
    names = ("id", "time_us", *(("chip_stamps",) if chips else ()), "crc32")
    lengths = [stored.shapes[name][0] for name in (*images, *names)]
    length = max(*lengths, seal.shots if seal else 0) if seal or stored.closed else min(lengths)
    row_bytes = sum(np.dtype(stored.dtypes[n]).itemsize * math.prod(stored.shapes[n][1:]) for n in names)
    # Of a file that was cut short, the images may be missing, but not the table.
    most = min(size.tables_most // row_bytes, max(size.found, size.stated) // header.header.shot_bytes + 1)
    if length > most:
        raise InputError(f"claims {length} shots, but its size is that of {most}; copy it again")
    room = max(HOLES_BYTES, size.tables_most)
    if length and header.header.shot_bytes > room:
        raise InputError(
            f"claims shots of {header.header.shot_bytes / 1e6:.0f} MB, and nearly all of the file are holes that take "
            f"no room on the disk; expected at most {room / 1e6:.0f} MB; copy it again"
        )
    rows = min(length, *(stored.shapes[name][0] for name in names))
    found = {name: source.numbers(name, rows) for name in names}
    found.setdefault("chip_stamps", np.zeros((rows, 0, 3), np.int64))
    sound = _sound(header.sha256, found) if header.sha256 else np.ones(rows, bool)
    values = {name: _only(array, sound, length) for name, array in found.items()}
    return Table(values["id"], values["time_us"], values["chip_stamps"], values["crc32"], _only(sound, sound, length))


def _only(rows: NDArray[Any], sound: NDArray[np.bool_], length: int) -> NDArray[Any]:
    """Return the sound rows in a table of this length; all others are zero."""
    kept = np.zeros((length, *rows.shape[1:]), rows.dtype)
    kept[: len(rows)][sound] = rows[sound]
    return kept


def _sound(header_sha256: str, found: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return which rows match the CRC-32 of their shot, (N,)."""
    crcs = found["crc32"]
    matches: NDArray[np.bool_] = crcs[:, -1] == crcs_of_shots(
        header_sha256, found["id"], found["time_us"], found["chip_stamps"], crcs[:, :-1]
    )
    return matches
