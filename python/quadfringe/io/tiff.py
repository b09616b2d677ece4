r"""Pages of a TIFF file, classic or BigTIFF, as its tags declare them; nothing is decoded.

>>> list(pages_of(b"II*\0" + bytes(4)))
[]
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

__all__ = ["Page", "has_more_pages", "is_tiff", "pages_of"]


class Page(NamedTuple):
    """Size of a page and of its tiles in px, tiles of 0 px when it has none; samples of a pixel, and bits of each."""

    width: int
    height: int
    tile_width: int
    tile_height: int
    samples: int
    bits: int

    @property
    def pixels(self) -> int:
        """Number of pixels of the page, or of one of its tiles if that is larger."""
        return max(self.width * self.height, self.tile_width * self.tile_height)

    @property
    def decoded_bytes(self) -> int:
        """Number of bytes of its pixels in memory."""
        return self.pixels * max(1, self.samples) * max(1, math.ceil(self.bits / 8))


class _Layout(NamedTuple):
    """Place of the offset of the first page, types of offsets and tag counts, bytes of a tag."""

    first: int
    offset: str
    number: str
    tag_bytes: int


ORDERS = {b"II": "<", b"MM": ">"}  # of bytes, by the first two of a TIFF
LAYOUTS = {42: _Layout(4, "I", "H", 12), 43: _Layout(8, "Q", "Q", 20)}  # by version: classic, and BigTIFF
PAGES, ENTRIES = 64, 4096  # most that are looked at
TAGS = {256: "width", 257: "height", 258: "bits", 277: "samples", 322: "tile_width", 323: "tile_height"}
# Every type of whole numbers: libtiff takes them all for a size.
NUMBERS = {1: "B", 3: "H", 4: "I", 6: "b", 8: "h", 9: "i", 16: "Q", 17: "q"}


def is_tiff(data: bytes) -> bool:
    """Say whether a file begins as a TIFF does."""
    return _layout(data) is not None


def pages_of(data: bytes) -> Iterator[Page]:
    """Give each page; ends where a place lies outside the file, as of anything that is no TIFF."""
    layout = _layout(data)
    if layout is None:
        return
    order = ORDERS[data[:2]]
    try:
        (place,) = struct.unpack_from(order + layout.offset, data, layout.first)
        for _ in range(PAGES):
            if place == 0:
                return
            yield _page(data, order, layout, place)
            place = _after(data, order, layout, place)
    except struct.error:
        return


def has_more_pages(data: bytes) -> bool:
    """Say whether a TIFF names a page after the first one; False for any other file."""
    layout = _layout(data)
    if layout is None:
        return False
    order = ORDERS[data[:2]]
    try:
        (place,) = struct.unpack_from(order + layout.offset, data, layout.first)
        return bool(_after(data, order, layout, place))
    except struct.error:  # the places are outside the file; the decoder says so
        return False


def _layout(data: bytes) -> _Layout | None:
    if data[:2] not in ORDERS or len(data) < 4:
        return None
    return LAYOUTS.get(struct.unpack_from(ORDERS[data[:2]] + "H", data, 2)[0])


def _page(data: bytes, order: str, layout: _Layout, place: int) -> Page:
    """Read the tags at a place; of a tag that is given twice, the larger value."""
    (tags,) = struct.unpack_from(order + layout.number, data, place)
    first = place + struct.calcsize(layout.number)
    found: dict[str, Any] = dict.fromkeys(TAGS.values(), 0)
    for entry in range(first, first + layout.tag_bytes * min(tags, ENTRIES), layout.tag_bytes):
        tag, kind = struct.unpack_from(f"{order}HH", data, entry)
        if tag in TAGS and kind in NUMBERS:
            found[TAGS[tag]] = max(found[TAGS[tag]], _value(data, order, layout, entry))
    return Page(**found)


def _value(data: bytes, order: str, layout: _Layout, entry: int) -> int:
    """Read the first number of a tag, which stands in it if all its numbers fit there, else where it says."""
    kind, count = struct.unpack_from(f"{order}H{layout.offset}", data, entry + 2)
    place = entry + 4 + struct.calcsize(layout.offset)
    if count * struct.calcsize(NUMBERS[kind]) > struct.calcsize(layout.offset):
        (place,) = struct.unpack_from(order + layout.offset, data, place)
    return int(struct.unpack_from(order + NUMBERS[kind], data, place)[0])


def _after(data: bytes, order: str, layout: _Layout, place: int) -> int:
    """Read where the next page is, 0 after the last one."""
    (tags,) = struct.unpack_from(order + layout.number, data, place)
    end = place + struct.calcsize(layout.number) + layout.tag_bytes * tags
    return int(struct.unpack_from(order + layout.offset, data, end)[0])
