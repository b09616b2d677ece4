"""The seal of a closed recording: a SHA-256 of everything but the pixels, which is checked without HDF5.

    bytes of HDF5 | extents (n, 2) <u8: begin and size of runs of pixels | FOOTER

HDF5 ignores what stands behind the end that it states. The SHA-256 covers the bytes of HDF5 outside the extents, then
the extents; each image has its CRC-32 among those bytes. A file whose seal holds is as its writer left it, up to its
pixels, so that HDF5 reads it without surprises.
"""

from __future__ import annotations

import hashlib
import os
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from numpy.typing import NDArray

from quadfringe.files import believable_bytes

__all__ = ["Seal", "pixel_extents", "read_seal", "write_seal"]

MAGIC = b"quadfringe seal\x01"
FOOTER = struct.Struct("<16sQQQ32sI")  # MAGIC, bytes of HDF5, shots, n, SHA-256; CRC-32 of extents and footer before it
PIECE_BYTES = 1 << 20


@dataclass(frozen=True)
class Seal:
    """Number of shots when the file was closed, and whether everything but the pixels is as it was then."""

    shots: int
    holds: bool


def pixel_extents(datasets: Sequence[h5py.Dataset]) -> NDArray[np.uint64]:
    """Return begin and size of the runs of bytes, (n, 2), that hold the chunks of these datasets."""
    chunks = np.zeros((sum(len(dataset) for dataset in datasets), 2), np.uint64)
    place = 0

    def note(chunk: Any) -> None:
        nonlocal place
        chunks[place] = chunk.byte_offset, chunk.size
        place += 1

    for dataset in datasets:
        dataset.id.chunk_iter(note)
    chunks = chunks[np.argsort(chunks[:, 0])]
    ends = chunks.sum(axis=1)
    first = np.flatnonzero(np.append(True, chunks[1:, 0] != ends[:-1])) if place else np.zeros(0, np.intp)
    last = np.append(first[1:], place)[: len(first)] - 1
    return np.stack([chunks[first, 0], ends[last] - chunks[first, 0]], axis=1)


def write_seal(path: Path, extents: NDArray[np.uint64], shots: int) -> None:
    """Append the seal to a file that HDF5 has closed."""
    size = path.stat().st_size
    table = np.ascontiguousarray(extents, "<u8").tobytes()
    with path.open("rb") as file:
        digest = _digest(file, size, extents, table)
    footer = FOOTER.pack(MAGIC, size, shots, len(extents), digest, 0)[: -struct.calcsize("<I")]
    with path.open("ab") as file:
        file.write(table + footer + struct.pack("<I", zlib.crc32(footer, zlib.crc32(table))))


def read_seal(path: Path) -> Seal | None:
    """Return the seal of a file and check it; None when the file has none that is readable.

    It does not hold when more bytes would have to be hashed than the file can have in tables: those of holes.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        if size < FOOTER.size:
            return None
        file.seek(size - FOOTER.size)
        footer = file.read(FOOTER.size)
        magic, end, shots, count, digest, crc = FOOTER.unpack(footer)
        most = believable_bytes(os.fstat(file.fileno()))
        if magic != MAGIC or end + 16 * count + FOOTER.size != size or 16 * count > most:
            return None
        file.seek(end)
        table = file.read(16 * count)
        if zlib.crc32(footer[: -struct.calcsize("<I")], zlib.crc32(table)) != crc:
            return None
        extents = np.frombuffer(table, "<u8").reshape(count, 2)
        hashed = end - int(extents[:, 1].sum(dtype=float))
        return Seal(shots, hashed <= most and _digest(file, end, extents, table) == digest)


def _digest(file: BinaryIO, end: int, extents: NDArray[np.uint64], table: bytes) -> bytes:
    """Return the SHA-256 of a file up to `end` without the extents, then of their table; b"" for a wrong table."""
    digest, place = hashlib.sha256(), 0
    for begin, size in (*extents.tolist(), (end, 0)):
        if not place <= begin <= begin + size <= end:
            return b""
        file.seek(place)
        while place < begin and (piece := file.read(min(PIECE_BYTES, begin - place))):
            digest.update(piece)
            place += len(piece)
        place = begin + size
    digest.update(table)
    return digest.digest()
