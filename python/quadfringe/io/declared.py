"""Sizes that files declare, checked before anything is decoded: a few kB can declare an image of many GB.

>>> import numpy as np
>>> from io import BytesIO
>>> stream = BytesIO()
>>> np.savez(stream, phase_rad=np.zeros((4, 6), np.float32))
>>> check_arrays("shape.npz", stream.getvalue())
>>> pixels_declared(b"BM" + bytes(16) + (640).to_bytes(4, "little") + (480).to_bytes(4, "little"))
307200
"""

from __future__ import annotations

import re
import struct
import zipfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

from quadfringe.errors import InputError

__all__ = ["ARRAYS_BYTES", "IMAGE_PX", "check_arrays", "check_image", "pixels_declared"]

IMAGE_PX = 2**28  # 16384 x 16384, the largest camera chip of today has 150 MP
ARRAYS_BYTES = 2**34  # maps of a shape of 2**28 pixels
ARRAYS = 64  # a shape has ten
TIFF_WIDTH, TIFF_HEIGHT = 256, 257
TIFF_ENTRIES = 4096
TIFF_PAGES = 64
SHORT, LONG = 3, 4
# The start of a frame: baseline, extended, progressive, lossless and the like, without tables (C4, C8, CC).
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


def check_image(path: Path | str, data: bytes) -> None:
    """Raise `InputError` unless `data` is an image of a known kind that declares at most 2**28 pixels."""
    pixels = pixels_declared(data)
    if pixels is None:
        raise InputError(
            f"{path}: not a readable image; expected PNG, TIFF or BMP, got {len(data)} bytes of something else"
        )
    if pixels > IMAGE_PX:
        raise InputError(f"{path}: declares {pixels:,} pixels; expected at most {IMAGE_PX:,}")


def pixels_declared(data: bytes) -> int | None:
    """Return the number of pixels that an image declares, of the largest page of a TIFF; None for other kinds of file.

    PNG, TIFF, BMP, JPEG and PNM are known.
    """
    try:
        if data.startswith(b"\x89PNG\r\n\x1a\n") and data[12:16] == b"IHDR":
            width, height = struct.unpack_from(">II", data, 16)
        elif data.startswith(b"BM"):
            width, height = struct.unpack_from("<ii", data, 18)
        elif data.startswith((b"II*\0", b"MM\0*")):
            return max(_tiff_pages(data), default=None)
        elif data.startswith(b"\xff\xd8"):
            return _jpeg_pixels(data)
        elif matched := re.match(rb"P[1-6](?:\s+|#[^\n]*\n)+(\d{1,9})\s+(\d{1,9})\s", data[:1024]):
            width, height = int(matched[1]), int(matched[2])
        else:
            return None
    except (struct.error, IndexError):
        return None
    return int(abs(width * height))


def _tiff_pages(data: bytes) -> Iterator[int]:
    """Give the pixels of each page of a TIFF."""
    order = "<" if data.startswith(b"II") else ">"
    (place,) = struct.unpack_from(f"{order}I", data, 4)
    for _ in range(TIFF_PAGES):
        (entries,) = struct.unpack_from(f"{order}H", data, place)
        size = {TIFF_WIDTH: 0, TIFF_HEIGHT: 0}
        for entry in range(place + 2, place + 2 + 12 * min(entries, TIFF_ENTRIES), 12):
            tag, kind = struct.unpack_from(f"{order}HH", data, entry)
            if tag in size and kind in (SHORT, LONG):
                (size[tag],) = struct.unpack_from(f"{order}{'H' if kind == SHORT else 'I'}", data, entry + 8)
        yield size[TIFF_WIDTH] * size[TIFF_HEIGHT]
        (place,) = struct.unpack_from(f"{order}I", data, place + 2 + 12 * entries)
        if place == 0:
            return


def _jpeg_pixels(data: bytes) -> int | None:
    """Return the pixels of a JPEG, from the header of its frame."""
    place = 2
    while data[place] == 0xFF:
        marker = data[place + 1]
        length, _, height, width = struct.unpack_from(">HBHH", data, place + 2)
        if marker in JPEG_FRAMES:
            return int(width * height)
        place += 2 + length
    return None


def check_arrays(path: Path | str, data: bytes) -> None:
    """Raise `InputError` if an NPZ archive declares more than 64 arrays, or more than 2**34 bytes in all.

    A file that is no archive passes; its reader reports it.
    """
    try:
        members = zipfile.ZipFile(BytesIO(data)).infolist()
    except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError, RuntimeError, struct.error):
        return
    declared = sum(member.file_size for member in members)
    if len(members) > ARRAYS or declared > ARRAYS_BYTES:
        raise InputError(
            f"{path}: declares {len(members)} arrays with {declared:,} bytes; expected at most {ARRAYS} with "
            f"{ARRAYS_BYTES:,}"
        )
