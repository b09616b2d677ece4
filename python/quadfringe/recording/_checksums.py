"""Checksums of a recording: of the pixels and the stamp of each shot, of the header, and of the whole.

CRC-32 of each image    of its bytes in C order
CRC-32 of a shot        of the SHA-256 of the header, the index of the shot, its stamp, and the CRC-32 of its images
SHA-256 of the header   of attributes, sizes and types; one each of the texts of settings and calibration
"""

from __future__ import annotations

import hashlib
import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core

__all__ = ["crc_of_shot", "crcs_of", "crcs_of_shots", "sha256_of"]


def crcs_of(images: Mapping[str, NDArray[Any]]) -> list[int]:
    """Return the CRC-32 of the bytes of each image, in C order."""
    return [_core.crc32(np.ascontiguousarray(image).view(np.uint8)) for image in images.values()]


def crc_of_shot(
    header_sha256: str, index: int, stamp: Sequence[int], chip_stamps: Sequence[Sequence[int]], crcs: Sequence[int]
) -> int:
    """Return the CRC-32 that binds a stamp (id, time_us) and the CRC-32 of images to their place in a recording."""
    frames = [number for chip in chip_stamps for number in chip]
    row = struct.pack(f"<QQq{len(frames)}q{len(crcs)}I", index, *stamp, *frames, *crcs)
    return zlib.crc32(row, zlib.crc32(header_sha256.encode()))


def crcs_of_shots(
    header_sha256: str,
    ids: NDArray[np.uint64],
    times_us: NDArray[np.int64],
    chip_stamps: NDArray[np.int64],
    crcs: NDArray[np.uint32],
) -> NDArray[np.uint32]:
    """Return the CRC-32 of many shots from the first on, (N,), as `crc_of_shot` does for one."""
    columns = (np.arange(len(ids), dtype="<u8"), ids.astype("<u8"), times_us.astype("<i8"), chip_stamps.astype("<i8"))
    if not len(ids):
        return np.zeros(0, np.uint32)
    bytes_of = [np.ascontiguousarray(c).view(np.uint8).reshape(len(ids), -1) for c in (*columns, crcs.astype("<u4"))]
    rows = np.hstack(bytes_of)
    begin = zlib.crc32(header_sha256.encode())
    return np.array([zlib.crc32(row, begin) for row in rows], np.uint32)


def sha256_of(*parts: object) -> str:
    """Return the SHA-256 of texts, arrays, and plain data, in hexadecimal digits."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.tobytes() if isinstance(part, np.ndarray) else _text(part).encode()
        digest.update(struct.pack("<Q", len(data)) + data)
    return digest.hexdigest()


def _text(part: object) -> str:
    return part if isinstance(part, str) else json.dumps(part, sort_keys=True, default=repr)
