"""Sizes that images declare, checked before anything is decoded: a few kB can declare an image of many GB.

>>> pixels_declared(b"BM" + bytes(16) + (640).to_bytes(4, "little") + (480).to_bytes(4, "little"))
307200
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path

from quadfringe.errors import InputError

__all__ = ["IMAGE_PX", "check_image", "pixels_declared"]

IMAGE_PX = 2**28  # 16384 x 16384, the largest camera chip of today has 150 MP
PNG = b"\x89PNG\r\n\x1a\n"
TIFF_WIDTH, TIFF_HEIGHT = 256, 257
TIFF_ENTRIES = 4096
TIFF_PAGES = 64
SHORT, LONG = 3, 4
# The start of a frame: baseline, extended, progressive, lossless and the like, without tables (C4, C8, CC).
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


def check_image(path: Path | str, data: bytes) -> None:
    """Raise `InputError` if `data` is an image that declares more than 2**28 pixels, or more bytes than it has.

    A file of another kind passes; its reader reports it.
    """
    if data.startswith(PNG) and (missing := _bytes_missing(data)):
        raise InputError(
            f"{path}: not a readable image: {missing:,} bytes of the PNG file are missing; it is cut or damaged, so "
            "copy it again"
        )
    pixels = pixels_declared(data)
    if pixels is not None and pixels > IMAGE_PX:
        raise InputError(f"{path}: declares {pixels:,} pixels; expected at most {IMAGE_PX:,}")


def pixels_declared(data: bytes) -> int | None:
    """Return the number of pixels that an image declares, of the largest page of a TIFF; None for other kinds of file.

    PNG, TIFF, BMP, JPEG and PNM are known.
    """
    try:
        if data.startswith(PNG) and data[12:16] == b"IHDR":
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


def _bytes_missing(data: bytes) -> int:
    """Return by how many bytes the chunks of a PNG exceed it; OpenCV reserves 4 GB for a chunk that says so."""
    place, kind = len(PNG), b""
    while kind != b"IEND" and place < len(data):
        length, kind = int.from_bytes(data[place : place + 4], "big"), data[place + 4 : place + 8]
        place += 12 + length
    return max(0, place - len(data))


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
