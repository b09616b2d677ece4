"""Pixel formats of GenICam, and the conversion of a frame's bytes to pixels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import BayerPattern
from quadfringe.errors import CameraError

__all__ = ["FORMATS", "PixelFormat", "format_named"]


@dataclass(frozen=True)
class PixelFormat:
    """A format of the GenICam pixel format naming convention.

    `packing` "gev" is that of GigE Vision, whose names end with Packed: two pixels in three bytes. "p" is a stream of
    bits without gaps, the low bits of a pixel first: four pixels of 10 bit in five bytes, two of 12 bit in three.
    """

    name: str
    code: int
    bits: int
    packing: Literal["gev", "p"] | None = None
    colours: int = 1
    bayer: BayerPattern | None = None

    @property
    def full_scale(self) -> float:
        """Value of a saturated pixel."""
        return float(2**self.bits - 1)

    @property
    def packed(self) -> bool:
        """Whether pixels share bytes, so that they cannot be lent without a copy."""
        return self.packing is not None

    def payload(self, width: int, height: int) -> int:
        """Return the number of bytes of a frame; the last byte may be filled by a part of a pixel."""
        return -(-width * height * (self.code >> 16 & 0xFF) // 8)

    def pixels(self, data: NDArray[np.uint8], width: int, height: int) -> NDArray[Any]:
        """Return the pixels (H, W), or (H, W, 3) of a colour image, uint8 or uint16; a view unless packed.

        >>> FORMATS["Mono12Packed"].pixels(np.array([0x12, 0x43, 0x56], np.uint8), 2, 1)
        array([[ 291, 1380]], dtype=uint16)
        """
        values: NDArray[Any] = data[: self.payload(width, height)]
        if self.packing is not None:
            group = 5 if self.packing == "p" and self.bits == 10 else 3
            if lacking := -len(values) % group:
                values = np.concatenate([values, np.zeros(lacking, np.uint8)])
            unpacked = {"gev": _two_of_gev, "p": _four_of_ten if group == 5 else _two_of_twelve}[self.packing]
            values = unpacked(values.reshape(-1, group), self.bits).reshape(-1)[: width * height * self.colours]
        elif self.bits > 8:
            values = values.view("<u2")
        return values.reshape((height, width, 3) if self.colours == 3 else (height, width))


def _two_of_gev(triples: NDArray[np.uint8], bits: int) -> NDArray[np.uint16]:
    """Undo the packing of GigE Vision: high bits, low bits of both (first in the lower half), high bits."""
    low = np.uint16(bits - 8)
    out = np.empty((len(triples), 2), np.uint16)
    out[:, 0], out[:, 1] = triples[:, 0], triples[:, 2]
    out <<= low
    mask = np.uint8((1 << (bits - 8)) - 1)
    out[:, 0] |= triples[:, 1] & mask
    out[:, 1] |= triples[:, 1] >> np.uint8(4) & mask
    return out


def _two_of_twelve(triples: NDArray[np.uint8], _: int) -> NDArray[np.uint16]:
    """Undo 12p: low eight bits of the first pixel, its high four and the low four of the second, its high eight."""
    out = np.empty((len(triples), 2), np.uint16)
    out[:, 0], out[:, 1] = triples[:, 1] & np.uint8(0x0F), triples[:, 2]
    out[:, 0] <<= np.uint16(8)
    out[:, 1] <<= np.uint16(4)
    out[:, 0] |= triples[:, 0]
    out[:, 1] |= triples[:, 1] >> np.uint8(4)
    return out


def _four_of_ten(fives: NDArray[np.uint8], _: int) -> NDArray[np.uint16]:
    """Undo 10p: pixel n takes 8 - 2 n high bits of byte n, and 2 n + 2 low bits of the next."""
    out = np.empty((len(fives), 4), np.uint16)
    for n in range(4):
        out[:, n] = fives[:, n + 1] & np.uint8((1 << 2 * n + 2) - 1)
        out[:, n] <<= np.uint16(8 - 2 * n)
        out[:, n] |= fives[:, n] >> np.uint8(2 * n)
    return out


def _mosaics() -> Iterator[PixelFormat]:
    """Give the Bayer formats; codes of the four orders of colours follow each other, those of "p" in another order."""
    orders: tuple[tuple[str, BayerPattern], ...] = (("GR", "grbg"), ("RG", "rggb"), ("GB", "gbrg"), ("BG", "bggr"))
    steps = {"GR": 4, "RG": 6, "GB": 2, "BG": 0}
    depths = (
        ("8", 0x01080008),
        ("10", 0x0110000C),
        ("10Packed", 0x010C0026),
        ("12", 0x01100010),
        ("12Packed", 0x010C002A),
    )
    for depth, first in depths:
        packing: Literal["gev"] | None = "gev" if depth.endswith("Packed") else None
        for number, (order, bayer) in enumerate(orders):
            bits = int(depth.removesuffix("Packed"))
            yield PixelFormat(f"Bayer{order}{depth}", first + number, bits, packing, bayer=bayer)
    for bits, first in ((10, 0x010A0052), (12, 0x010C0053)):
        for order, bayer in orders:
            yield PixelFormat(f"Bayer{order}{bits}p", first + steps[order], bits, "p", bayer=bayer)


_KNOWN = (
    PixelFormat("Mono8", 0x01080001, 8),
    PixelFormat("Mono10", 0x01100003, 10),
    PixelFormat("Mono10Packed", 0x010C0004, 10, "gev"),
    PixelFormat("Mono10p", 0x010A0046, 10, "p"),
    PixelFormat("Mono12", 0x01100005, 12),
    PixelFormat("Mono12Packed", 0x010C0006, 12, "gev"),
    PixelFormat("Mono12p", 0x010C0047, 12, "p"),
    *_mosaics(),
    PixelFormat("RGB8", 0x02180014, 8, colours=3),
)
FORMATS = {known.name: known for known in _KNOWN}
ALIASES = {"RGB8Packed": "RGB8"}


def format_named(name: str) -> PixelFormat:
    """Return the format of this name; raises `CameraError` listing the supported formats."""
    known = FORMATS.get(ALIASES.get(name, name))
    if known is None:
        raise CameraError(f"pixel format {name} is not supported; set pixel_format to one of {', '.join(FORMATS)}")
    return known
