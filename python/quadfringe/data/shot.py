"""`Shot` and `BayerShot`: one exposure, with its time stamp and, on the virtual bench, the truth.

>>> import numpy as np
>>> from quadfringe.data import Shot
>>> Shot(*np.zeros((4, 480, 640), np.uint16), full_scale=4095)
Shot(640 x 480 uint16 up to 4095)
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import BayerPattern
from quadfringe.data._checks import check_full_scale, check_images, check_maps, check_stamp
from quadfringe.data.drawing import cards, plots
from quadfringe.errors import InputError
from quadfringe.io.images import full_scale

__all__ = ["AnyShot", "BayerShot", "ChipImage", "FrameStamp", "Shot", "Stamp", "Truth"]

Map = NDArray[np.float32]


@dataclass(frozen=True, repr=False)
class Truth:
    """The truth about a shot of the virtual bench: maps (H, W) float32, NaN where no surface is seen.

    `column_px` is the projector column that lights the point, `xyz_mm` (H, W, 3) the point in the camera frame.
    `shadow` marks pixels that no projector lights, `edge` those whose values mix two sides of a step of depth or light.
    Raises `InputError` for maps of unequal size.
    """

    column_px: Map
    xyz_mm: Map
    shadow: NDArray[np.bool_]
    edge: NDArray[np.bool_]

    def __post_init__(self) -> None:
        check_maps({field.name: getattr(self, field.name) for field in fields(self)})

    @property
    def depth_mm(self) -> Map:
        """Depth along the camera's axis, (H, W), mm."""
        return self.xyz_mm[:, :, 2]

    def __repr__(self) -> str:
        return f"Truth({self.shadow.shape[1]} x {self.shadow.shape[0]})"


@dataclass(frozen=True)
class FrameStamp:
    """One frame of one chip: the device's number and clock, ns, and UTC in ns since 1970 when it began to arrive.

    `arrival_ns` proceeds evenly while a stream runs, as `Stamp.time_us` does.
    """

    id: int
    device_ns: int
    arrival_ns: int


@dataclass(frozen=True)
class Stamp:
    """When and by which camera a shot was taken.

    `id` numbers the exposures since the camera was opened; it jumps where exposures were lost. `time_us` is UTC in us
    since 1970 when the exposure began, as well as the host can tell; setting the clock of the host while a stream runs
    does not disturb it. `frames` are by chip, "visible" and "infrared".
    """

    id: int
    time_us: int
    device: str
    frames: Mapping[str, FrameStamp] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_stamp(self.id, self.time_us, self.device)


class Stamped:
    """Number and time of a record, taken from its stamp."""

    stamp: Stamp | None

    @property
    def id(self) -> int | None:
        """Number of the exposure in its stream; None when the shot comes from files."""
        return None if self.stamp is None else self.stamp.id

    @property
    def time_us(self) -> int | None:
        """UTC in us since 1970 when the exposure began; None when the shot comes from files."""
        return None if self.stamp is None else self.stamp.time_us


class _Exposure(Stamped, ABC):
    """The checks and the full scale that both kinds of shots share."""

    ir: NDArray[Any] | None
    full_scale: float | None

    def __post_init__(self) -> None:
        check_images(self.images)
        check_full_scale(self.full_scale)

    @property
    @abstractmethod
    def images(self) -> dict[str, NDArray[Any]]:
        """The captured images by name."""

    @property
    @abstractmethod
    def channels(self) -> dict[str, NDArray[Any]]:
        """The samples of each channel by name."""

    def _repr_html_(self) -> str:
        return str(cards().shot_card(self))

    def plot(self) -> Any:
        """Plot the channels as they were captured; give the axes in an array.

        Raises `MissingExtraError` without matplotlib (extra `plot`).

        >>> shot.plot()[0, 1].figure.savefig("channels.png")                             # doctest: +SKIP
        """
        return plots().plot_shot(self)

    @property
    def full_scale_value(self) -> float:
        """The intensity of a saturated pixel: as given, else 255, 65535 or 1.0 by dtype."""
        return float(full_scale(self.first)) if self.full_scale is None else self.full_scale

    @property
    def first(self) -> NDArray[Any]:
        """The first of the images, whose size and dtype are those of all."""
        return next(iter(self.images.values()))

    def _with_infrared(self, images: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Add the infrared image, if there is one."""
        return images if self.ir is None else images | {"ir": self.ir}


def _described(record: Any, image: NDArray[Any], kind: str = "") -> str:
    """Name a record with size, type, full scale and number."""
    number = "" if record.id is None else f", id {record.id}"
    size = f"{image.shape[1]} x {image.shape[0]} {image.dtype}"
    without = ", without infrared" if isinstance(record, _Exposure) and record.ir is None else ""
    return f"{type(record).__name__}({kind}{size} up to {record.full_scale_value:g}{number}{without})"


@dataclass(frozen=True, repr=False)
class Shot(_Exposure):
    """One exposure: four images (H, W) of one size and one dtype (uint8, uint16 or float32), and their full scale.

    `ir` is None for a camera without infrared, whose three images the encoding "rgb" decodes. `full_scale` is the
    intensity of a saturated pixel; None stands for 255, 65535 or 1.0 by dtype. `truth` comes from the virtual bench,
    `stamp` says when and by which camera the shot was taken. Raises `InputError` for anything else.
    """

    red: NDArray[Any]
    green: NDArray[Any]
    blue: NDArray[Any]
    ir: NDArray[Any] | None = None
    full_scale: float | None = None
    truth: Truth | None = None
    stamp: Stamp | None = None

    def __repr__(self) -> str:
        return _described(self, self.red)

    @classmethod
    def from_rgb(
        cls, rgb: NDArray[Any], full_scale: float | None = None, truth: Truth | None = None, stamp: Stamp | None = None
    ) -> Shot:
        """Make a shot without infrared from a colour image (H, W, 3) in R, G, B order; raises `InputError` for others.

        >>> Shot.from_rgb(np.zeros((480, 640, 3), np.uint8))
        Shot(640 x 480 uint8 up to 255, without infrared)
        """
        if not isinstance(rgb, np.ndarray) or rgb.ndim != 3 or rgb.shape[2] != 3:
            got = f"an array of shape {rgb.shape}" if isinstance(rgb, np.ndarray) else type(rgb).__name__
            raise InputError(f"rgb: expected a colour image (H, W, 3), got {got}")
        red, green, blue = (np.ascontiguousarray(rgb[:, :, channel]) for channel in range(3))
        return cls(red, green, blue, None, full_scale, truth, stamp)

    @property
    def channels(self) -> dict[str, NDArray[Any]]:
        """The images by name, in the order R, G, B, and IR if there is one."""
        return self._with_infrared({"red": self.red, "green": self.green, "blue": self.blue})

    @property
    def images(self) -> dict[str, NDArray[Any]]:
        """The captured images by name: the channels."""
        return self.channels


@dataclass(frozen=True, repr=False)
class BayerShot(_Exposure):
    """One exposure of a Bayer chip and an infrared chip: the raw mosaic and the infrared image, (H, W) of one dtype.

    `ir` is None for a camera without infrared.
    `bayer` names the colours of the first two pixels of the first row and of the second row (rggb, grbg, gbrg or
    bggr). Decoding interpolates the colours, after it has corrected dark level and response. The rest is as for `Shot`.
    """

    raw: NDArray[Any]
    bayer: BayerPattern
    ir: NDArray[Any] | None = None
    full_scale: float | None = None
    truth: Truth | None = None
    stamp: Stamp | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bayer not in get_args(BayerPattern):
            known = ", ".join(get_args(BayerPattern))
            raise InputError(f"bayer: expected one of {known}, got {self.bayer!r}")

    def __repr__(self) -> str:
        return _described(self, self.raw, f"{self.bayer} ")

    @property
    def images(self) -> dict[str, NDArray[Any]]:
        """The captured images by name: `raw`, and `ir` if there is one."""
        return self._with_infrared({"raw": self.raw})

    @property
    def channels(self) -> dict[str, NDArray[Any]]:
        """The samples of each channel by name, for display: each colour has a quarter of the pixels.

        The colours lie at different places and half of the green samples are left out, so do not decode from them.
        """
        row, column = divmod(self.bayer.index("r"), 2)
        red, green = self.raw[row::2, column::2], self.raw[row::2, 1 - column :: 2]
        return self._with_infrared({"red": red, "green": green, "blue": self.raw[1 - row :: 2, 1 - column :: 2]})


AnyShot = Shot | BayerShot


@dataclass(frozen=True, repr=False)
class ChipImage(Stamped):
    """One exposure of one chip: pixels (H, W), or (H, W, 3) in R, G, B order, uint8 or uint16, up to `full_scale`.

    `pixel_format` is the GenICam name of the format; `bayer` the colours of a raw mosaic, None for other images.
    """

    pixels: NDArray[Any]
    pixel_format: str
    full_scale: float
    bayer: BayerPattern | None
    stamp: Stamp

    @property
    def full_scale_value(self) -> float:
        """The intensity of a saturated pixel."""
        return self.full_scale

    def __repr__(self) -> str:
        return _described(self, self.pixels, f"{self.pixel_format} ")
