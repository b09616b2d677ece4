"""`Shot` and `BayerShot`: one exposure, with its time stamp and, on the virtual bench, the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import BayerPattern
from quadfringe.errors import InputError
from quadfringe.io.images import full_scale

__all__ = ["AnyShot", "BayerShot", "ChipImage", "FrameStamp", "Shot", "Stamp", "Truth"]

Map = NDArray[np.float32]


@dataclass(frozen=True)
class Truth:
    """What the virtual bench knows of a shot: maps (H, W) float32, NaN where nothing is seen.

    `edge` marks pixels too near to a step of depth or light for a value of their own.
    """

    column_px: Map
    xyz_mm: Map
    shadow: NDArray[np.bool_]
    edge: NDArray[np.bool_]

    @property
    def depth_mm(self) -> Map:
        """Depth along the camera's axis, (H, W), mm."""
        return self.xyz_mm[:, :, 2]


@dataclass(frozen=True)
class FrameStamp:
    """One frame of one chip: the device's number and clock, and the host's clock when it began to arrive, in ns."""

    id: int
    device_ns: int
    arrival_ns: int


@dataclass(frozen=True)
class Stamp:
    """When and by which camera a shot was taken.

    `id` numbers the exposures since the camera was opened and jumps where some were lost; `time_us` is UTC in us since
    1970, when the exposure was, as well as the host can tell; `frames` are by chip, "visible" and "infrared".
    """

    id: int
    time_us: int
    device: str
    frames: Mapping[str, FrameStamp] = field(default_factory=dict)


class Stamped:
    """What every shot tells of its origin."""

    stamp: Stamp | None

    @property
    def id(self) -> int | None:
        """Number of the exposure in its stream; None when the shot comes from files."""
        return None if self.stamp is None else self.stamp.id

    @property
    def time_us(self) -> int | None:
        """UTC in us since 1970 when the exposure began; None when the shot comes from files."""
        return None if self.stamp is None else self.stamp.time_us


@dataclass(frozen=True)
class Shot(Stamped):
    """One exposure: four images (H, W) of one dtype (uint8, uint16 or float32), and their full scale."""

    red: NDArray[Any]
    green: NDArray[Any]
    blue: NDArray[Any]
    ir: NDArray[Any]
    full_scale: float | None = None
    truth: Truth | None = field(default=None, repr=False)
    stamp: Stamp | None = None

    @property
    def channels(self) -> dict[str, NDArray[Any]]:
        """Give the images by name, in the order R, G, B, IR."""
        return {"red": self.red, "green": self.green, "blue": self.blue, "ir": self.ir}

    @property
    def images(self) -> dict[str, NDArray[Any]]:
        """Give what was captured, by name: the four channels."""
        return self.channels

    @property
    def full_scale_value(self) -> float:
        """The intensity of a full pixel: as given, else 255, 65535 or 1.0 by dtype."""
        return float(full_scale(self.red)) if self.full_scale is None else self.full_scale


@dataclass(frozen=True)
class BayerShot(Stamped):
    """One exposure of a Bayer chip and an infrared one: the raw mosaic and the infrared image, (H, W) of one dtype.

    `bayer` names the colours of the first two pixels of the first row and of the second. Nothing is interpolated
    here: decoding does that, after dark level and response. Raises `InputError` for a pattern that does not exist,
    and for images that are not (H, W) of one size.
    """

    raw: NDArray[Any]
    bayer: BayerPattern
    ir: NDArray[Any]
    full_scale: float | None = None
    truth: Truth | None = field(default=None, repr=False)
    stamp: Stamp | None = None

    def __post_init__(self) -> None:
        if self.bayer not in get_args(BayerPattern):
            known = ", ".join(get_args(BayerPattern))
            raise InputError(f"bayer: expected one of {known}, got {self.bayer!r}")
        if self.raw.ndim != 2 or self.ir.shape != self.raw.shape:
            raise InputError(
                f"expected a raw mosaic and an infrared image (H, W) of one size, got shapes {self.raw.shape} "
                f"and {self.ir.shape}; a colour image is no mosaic any more: give its planes as a `Shot`"
            )

    @property
    def images(self) -> dict[str, NDArray[Any]]:
        """Give what was captured, by name: `raw` and `ir`."""
        return {"raw": self.raw, "ir": self.ir}

    @property
    def channels(self) -> dict[str, NDArray[Any]]:
        """Give the samples of each channel by name, to look at: colours have a quarter of the pixels.

        They lie at different places, half of the green ones are left out, and nothing may be decoded from them.
        """
        row, column = divmod(self.bayer.index("r"), 2)
        red, green = self.raw[row::2, column::2], self.raw[row::2, 1 - column :: 2]
        return {"red": red, "green": green, "blue": self.raw[1 - row :: 2, 1 - column :: 2], "ir": self.ir}

    @property
    def full_scale_value(self) -> float:
        """The intensity of a full pixel: as given, else 255, 65535 or 1.0 by dtype."""
        return float(full_scale(self.raw)) if self.full_scale is None else self.full_scale


AnyShot = Shot | BayerShot


@dataclass(frozen=True)
class ChipImage(Stamped):
    """One exposure of one chip: pixels (H, W), or (H, W, 3) in R, G, B order, uint8 or uint16, up to `full_scale`.

    `pixel_format` is its name in GenICam; `bayer` the colours of a raw mosaic, None when it is none.
    """

    pixels: NDArray[Any]
    pixel_format: str
    full_scale: float
    bayer: BayerPattern | None
    stamp: Stamp
