"""Sizes that images declare, checked before anything is decoded: a few kB can declare an image of many GB.

>>> pixels_declared(b"BM" + bytes(16) + (640).to_bytes(4, "little") + (480).to_bytes(4, "little"))
307200
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from quadfringe.errors import InputError
from quadfringe.io.tiff import is_tiff, pages_of

__all__ = ["IMAGE_PX", "check_image", "pixels_declared", "without_texts"]

IMAGE_PX = 2**28  # 16384 x 16384, the largest camera chip of today has 150 MP
# Bytes that the pixels of an image may take: 44 million pixels of three 16-bit colours, which take 2 s; or 16 times
# those of a larger file, which measured pixels never reach: of a black image a thousandth is left.
DECODED_BYTES, DECODED_RATIO = 1 << 28, 16
PNG = b"\x89PNG\r\n\x1a\n"
PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}  # by type of colour
PNG_CHUNKS = 1_000_000  # 900 MB in pieces of 8 kB have 110,000
PNG_TEXTS = (b"zTXt", b"iTXt", b"iCCP")  # compressed texts, each up to a thousand times larger when unpacked
# The start of a frame: baseline, extended, progressive, lossless and the like, without tables (C4, C8, CC).
JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
JPEG_SCAN, JPEG_SCANS = b"\xff\xda", 16  # a progressive image has some ten; each goes over all pixels
PNM = re.compile(rb"P([1-6])(?:\s+|#[^\n]*\n)+(\d{1,9})\s+(\d{1,9})\s")


class _Declared(NamedTuple):
    """Number of pixels, and of the bytes that they take in memory."""

    pixels: int
    bytes: int


def check_image(path: Path | str, data: bytes) -> None:
    """Raise `InputError` for an image that declares more pixels than 2**28, or than `data` can reasonably hold.

    So is one of unknown kind, and a PNG that is cut. Damage elsewhere is reported by the decoder.
    """
    if data.startswith(PNG) and (missing := _bytes_missing(path, data)):
        raise InputError(
            f"{path}: not a readable image: {missing:,} bytes of the PNG file are missing; it is cut or damaged, so "
            "copy it again"
        )
    found = _declared(data)
    if found is None:
        raise InputError(
            f"{path}: not a readable image; expected PNG, TIFF or BMP, got {len(data)} bytes of something else"
        )
    if found.pixels > IMAGE_PX:
        raise InputError(f"{path}: declares {found.pixels:,} pixels; expected at most {IMAGE_PX:,}")
    most = max(DECODED_BYTES, DECODED_RATIO * len(data))
    if found.bytes > most:
        raise InputError(
            f"{path}: declares pixels of {found.bytes / 1e6:.0f} MB in a file of {len(data) / 1e6:.1f} MB; expected at "
            f"most {most / 1e6:.0f} MB, so save it without compression if it is an image"
        )


def pixels_declared(data: bytes) -> int | None:
    """Return the number of pixels that an image declares, of the largest page of a TIFF; None for other kinds of file.

    PNG, TIFF, BMP, JPEG and PNM are known.
    """
    found = _declared(data)
    return None if found is None else found.pixels


def _declared(data: bytes) -> _Declared | None:
    try:
        if data.startswith(PNG) and data[12:16] == b"IHDR":
            width, height, bits, colour = struct.unpack_from(">IIBB", data, 16)
            return _of(width * height, PNG_CHANNELS.get(colour, 4) * (2 if bits > 8 else 1))
        if data.startswith(b"BM"):
            width, height = struct.unpack_from("<ii", data, 18)
            return _of(abs(width * height), 4)
        if is_tiff(data):
            pages = list(pages_of(data))
            return _Declared(max(p.pixels for p in pages), max(p.decoded_bytes for p in pages)) if pages else None
        if data.startswith(b"\xff\xd8"):
            pixels = _jpeg_pixels(data)
            return None if pixels is None else _of(pixels, 3 * (1 + data.count(JPEG_SCAN) // JPEG_SCANS))
        if matched := PNM.match(data[:1024]):
            return _of(int(matched[2]) * int(matched[3]), 6)
    except (struct.error, IndexError):
        pass
    return None


def _of(pixels: int, bytes_each: int) -> _Declared:
    return _Declared(int(pixels), int(pixels * bytes_each))


def without_texts(data: bytes) -> bytes:
    """Leave the compressed texts of a PNG out, which the decoder would unpack: some MB of them take minutes."""
    if not data.startswith(PNG) or not any(kind in data for kind in PNG_TEXTS):
        return data
    kept, begin = [data[: len(PNG)]], len(PNG)
    for end, kind in _chunks(data):
        if kind not in PNG_TEXTS:
            kept.append(data[begin:end])
        begin = end
    return b"".join([*kept, data[begin:]])


def _chunks(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Give end and kind of the chunks of a PNG up to the last one, or to the end of the file."""
    place, kind = len(PNG), b""
    while kind != b"IEND" and place < len(data):
        length, kind = int.from_bytes(data[place : place + 4], "big"), data[place + 4 : place + 8]
        place += 12 + length
        yield place, kind


def _bytes_missing(path: Path | str, data: bytes) -> int:
    """Return by how many bytes the chunks of a PNG exceed it; OpenCV reserves 4 GB for a chunk that says so."""
    end = len(PNG)
    for number, (end, _) in enumerate(_chunks(data)):  # noqa: B007 - the last end is wanted
        if number >= PNG_CHUNKS:
            raise InputError(f"{path}: expected a PNG of at most {PNG_CHUNKS:,} chunks, got more; save it again")
    return max(0, end - len(data))


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
