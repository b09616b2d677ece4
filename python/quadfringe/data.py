"""The records that flow and are saved: `Shot` or `BayerShot` in, `Calibration` beside it, `Shape` out."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from quadfringe.config import Affine, BayerPattern, DeviceModel, Matrix4, Model, Response, Row4, checked
from quadfringe.errors import ConfigError, InputError
from quadfringe.files import atomic, read_bytes, require_suffix
from quadfringe.images import full_scale

__all__ = [
    "AnyShot",
    "BayerShot",
    "Calibration",
    "CalibrationRecord",
    "CalibrationStep",
    "ChipImage",
    "FrameStamp",
    "ResponseCalibration",
    "Shape",
    "Shot",
    "Stamp",
    "Truth",
    "conditioning",
]

Map = NDArray[np.float32]
MAPS = ("phase_rad", "column_px", "modulation", "quality")
MORE_MAPS = ("wrong_order_probability", "uncertainty_rad", "uncertainty_mm", "xyz_mm")
SCALARS = ("quality", "uncertainty_mm", "wrong_order_probability")
SUFFIXES = (".npz", ".ply", ".tif", ".tiff")


def _short_lists(text: str) -> str:
    """Put every list of plain numbers on one line: a matrix is then read row by row."""
    return re.sub(r"\[\n\s*([-+\d.eE,\s]*?)\n\s*\]", lambda m: f"[{' '.join(m[1].split())}]", text)


class Stored(Model):
    """A model with a JSON file of its own."""

    def save(self, path: Path | str) -> None:
        """Write the model as JSON, whole or not at all."""
        require_suffix(Path(path), (".json",))
        with atomic(Path(path)) as temporary:
            temporary.write_text(_short_lists(self.model_dump_json(indent=2, exclude_none=True)) + "\n")

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a model from JSON; raises `ConfigError` that lists every problem."""
        try:
            values = json.loads(read_bytes(Path(path)))
        except ValueError as error:
            raise ConfigError(f"{path}: not valid JSON: {error}") from error
        if not isinstance(values, dict):
            raise ConfigError(f"{path}: expected a JSON object, got {type(values).__name__}")
        return checked(cls, values, str(path))


class ResponseCalibration(Stored, Response):
    """Responses of the channels, and what they were estimated from."""

    schema_version: Literal[1] = 1
    steps: int | None = None
    inputs: tuple[str, ...] = ()


class CalibrationStep(Model):
    """One step of a calibration: what went in, what came out, and what is to be thought of it."""

    name: str
    inputs: tuple[str, ...] = ()
    settings: dict[str, Any] = Field(default_factory=dict)
    figures: dict[str, float | None] = Field(default_factory=dict)
    good: bool
    verdict: str


class CalibrationRecord(Model):
    """When a calibration was made, by which version, of which rig, and every step with its residuals."""

    made_utc: str
    quadfringe_version: str
    rig: str
    steps: tuple[CalibrationStep, ...] = ()

    @property
    def good(self) -> bool:
        """Whether every step is good."""
        return all(step.good for step in self.steps)


class Calibration(Stored):
    """What turns a raw shot into millimetres: the devices, and the defects of the channels (R, G, B, IR).

    `response` is undone before `crosstalk` and `projector_response` after it. `infrared` is the second projector, None
    when it is coaxial with `projector`. Files of schema 1, which know neither it nor the record, are read as they are.
    """

    schema_version: Literal[1, 2] = 2
    camera: DeviceModel
    projector: DeviceModel
    infrared: DeviceModel | None = None
    dark: Row4 | None = None
    response: Response | None = None
    crosstalk: Matrix4 | None = None
    projector_response: Response | None = None
    ir_registration: Affine | None = None
    record: CalibrationRecord | None = None


def conditioning(calibration: Calibration | None, response: Response | None) -> dict[str, Any]:
    """Give what is known about the intensities as the kernel's keywords; `response` stands in for the calibration's."""
    response = response or (calibration.response if calibration else None)
    projector = calibration.projector_response if calibration else None
    known = {
        "response": response.rows() if response else None,
        "dark": calibration.dark if calibration else None,
        "crosstalk": calibration.crosstalk if calibration else None,
        "projector_response": projector.rows() if projector else None,
        "ir_registration": calibration.ir_registration if calibration else None,
    }
    return {name: value for name, value in known.items() if value is not None}


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


@dataclass(frozen=True)
class Shape:
    """A decoded shot: maps (H, W) float32, points (H, W, 3) mm when calibrated; NaN where there is no data.

    `uncertainty_mm` is one standard deviation of the depth (`uncertainty_rad` of the phase when not calibrated) for the
    order that was chosen, `wrong_order_probability` that of another order. `config` and `calibration` are the settings
    that made it and travel with it into an NPZ file.
    """

    phase_rad: Map
    column_px: Map
    modulation: Map
    quality: Map
    xyz_mm: Map | None = None
    wrong_order_probability: Map | None = None
    uncertainty_rad: Map | None = None
    uncertainty_mm: Map | None = None
    config: Mapping[str, Any] = field(default_factory=dict, repr=False)
    calibration: Calibration | None = field(default=None, repr=False)

    @property
    def maps(self) -> dict[str, Map]:
        """Every map by name; `uncertainty_mm` in place of `uncertainty_rad`, and `xyz_mm`, when calibrated."""
        maps = {name: getattr(self, name) for name in (*MAPS, "order", *MORE_MAPS)}
        return {name: values for name, values in maps.items() if values is not None}

    @property
    def order(self) -> Map:
        """Fringe order, (H, W): whole turns of the absolute phase, rounded down."""
        order: Map = np.floor(self.phase_rad / np.float32(2 * np.pi))
        return order

    @property
    def returned(self) -> NDArray[np.bool_]:
        """Pixels with a phase, (H, W)."""
        return np.isfinite(self.phase_rad)

    @property
    def depth_mm(self) -> Map:
        """Depth along the camera's axis, (H, W), mm; raises `InputError` when not calibrated."""
        return self.points_mm[:, :, 2]

    @property
    def points_mm(self) -> Map:
        """Points in the camera frame, (H, W, 3), mm; raises `InputError` when not calibrated."""
        if self.xyz_mm is None:
            raise InputError("this shape has phase only: decode with a calibration to have millimetres")
        return self.xyz_mm

    def figures(self) -> dict[str, float]:
        """Give what the shape says of itself, by name with unit.

        `returned_percent`; where pixels came back also `uncertainty_median_mm` (or `_rad`), one standard deviation, and
        `wrong_orders_at_most`, the sum of their probabilities of another order, an upper bound.
        """
        returned = self.returned
        found = {"returned_percent": 100.0 * float(returned.mean())}
        if not returned.any():
            return found
        for name, sigma in (("rad", self.uncertainty_rad), ("mm", self.uncertainty_mm)):
            if sigma is not None:
                found[f"uncertainty_median_{name}"] = float(np.nanmedian(sigma))
        if self.wrong_order_probability is not None:
            found["wrong_orders_at_most"] = float(np.nansum(self.wrong_order_probability, dtype=np.float64))
        return found

    def with_settings(self, config: Mapping[str, Any], calibration: Calibration | None) -> Shape:
        """Give the same maps with the settings that made them."""
        return replace(self, config=config, calibration=calibration)

    def save(self, path: Path | str) -> None:
        """Write by suffix: .ply points, .tif depth, .npz everything. Whole or not at all.

        PLY holds the valid points only, with the modulation as grey colour, and as scalars `quality`, `uncertainty_mm`
        and `wrong_order_probability`.
        """
        from quadfringe import export

        path = Path(path)
        suffix = require_suffix(path, SUFFIXES)
        if suffix == ".npz":
            export.write_npz(path, self.maps, self._texts())
        elif suffix == ".ply":
            points = self.points_mm
            valid = np.isfinite(points).all(axis=2)
            scalars = {name: values[valid] for name, values in self.maps.items() if name in SCALARS}
            export.write_ply(path, points[valid], export.grey(self.modulation)[valid], scalars)
        else:
            export.write_depth(path, self.depth_mm)

    def _texts(self) -> dict[str, str]:
        texts = {"config": json.dumps(dict(self.config))}
        if self.calibration is not None:
            texts["calibration"] = self.calibration.model_dump_json(exclude_none=True)
        return texts

    @classmethod
    def load(cls, path: Path | str) -> Shape:
        """Read back what `save` wrote as NPZ."""
        from quadfringe.export import read_npz

        stored = read_npz(Path(path))
        missing = [name for name in MAPS if name not in stored]
        if missing:
            raise InputError(f"{path}: not a saved shape: no {', '.join(missing)}")
        calibration = None
        if "calibration" in stored:
            values = json.loads(str(stored["calibration"]))
            calibration = checked(Calibration, values, f"{path}, calibration")
        config = json.loads(str(stored["config"])) if "config" in stored else {}
        maps = {name: stored[name] for name in (*MAPS, *MORE_MAPS) if name in stored}
        return cls(**maps, config=config, calibration=calibration)
