"""Pixel formats of GenICam, and the conversion of a frame's bytes to pixels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import BayerPattern
from quadfringe.errors import CameraError

__all__ = ["FORMATS", "PixelFormat", "format_named"]


@dataclass(frozen=True)
class PixelFormat:
    """A format of the GenICam pixel format naming convention; `packed` formats hold two pixels in three bytes."""

    name: str
    code: int
    bits: int
    packed: bool = False
    colours: int = 1
    bayer: BayerPattern | None = None

    @property
    def full_scale(self) -> float:
        """Value of a saturated pixel."""
        return float(2**self.bits - 1)

    def payload(self, width: int, height: int) -> int:
        """Return the number of bytes of a frame."""
        return width * height * (self.code >> 16 & 0xFF) // 8

    def pixels(self, data: NDArray[np.uint8], width: int, height: int) -> NDArray[Any]:
        """Return the pixels (H, W), or (H, W, 3) of a colour image, uint8 or uint16; a view unless packed.

        >>> FORMATS["Mono12Packed"].pixels(np.array([0x12, 0x43, 0x56], np.uint8), 2, 1)
        array([[291, 1380]], dtype=uint16)
        """
        values: NDArray[Any] = data[: self.payload(width, height)]
        if self.packed:
            values = _unpacked(values, self.bits)
        elif self.bits > 8:
            values = values.view("<u2")
        return values.reshape((height, width, 3) if self.colours == 3 else (height, width))


def _unpacked(data: NDArray[np.uint8], bits: int) -> NDArray[np.uint16]:
    """Undo the packing of GigE Vision: high bits, low bits of both (first in the lower half), high bits."""
    triples = data.reshape(-1, 3)
    low = np.uint16(bits - 8)
    out = np.empty((len(triples), 2), np.uint16)
    out[:, 0], out[:, 1] = triples[:, 0], triples[:, 2]
    out <<= low
    mask = np.uint8((1 << (bits - 8)) - 1)
    out[:, 0] |= triples[:, 1] & mask
    out[:, 1] |= triples[:, 1] >> np.uint8(4) & mask
    return out


def _mosaics() -> Iterator[PixelFormat]:
    """Give the Bayer formats; the codes of the four orders of the colours follow each other."""
    orders: tuple[tuple[str, BayerPattern], ...] = (("GR", "grbg"), ("RG", "rggb"), ("GB", "gbrg"), ("BG", "bggr"))
    depths = (
        ("8", 0x01080008),
        ("10", 0x0110000C),
        ("10Packed", 0x010C0026),
        ("12", 0x01100010),
        ("12Packed", 0x010C002A),
    )
    for depth, first in depths:
        packed = depth.endswith("Packed")
        for number, (order, bayer) in enumerate(orders):
            bits = int(depth.removesuffix("Packed"))
            yield PixelFormat(f"Bayer{order}{depth}", first + number, bits, packed=packed, bayer=bayer)


_KNOWN = (
    PixelFormat("Mono8", 0x01080001, 8),
    PixelFormat("Mono10", 0x01100003, 10),
    PixelFormat("Mono10Packed", 0x010C0004, 10, packed=True),
    PixelFormat("Mono12", 0x01100005, 12),
    PixelFormat("Mono12Packed", 0x010C0006, 12, packed=True),
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
