"""The records that flow and are saved: `Shot` or `BayerShot` in, `Calibration` beside it, `Shape` out."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Affine, BayerPattern, DeviceModel, Matrix4, Model, Response, Row4, checked
from quadfringe.errors import ConfigError, InputError
from quadfringe.files import atomic, read_bytes, require_suffix
from quadfringe.images import full_scale

__all__ = ["AnyShot", "BayerShot", "Calibration", "ResponseCalibration", "Shape", "Shot", "Truth", "conditioning"]

Map = NDArray[np.float32]
MAPS = ("phase_rad", "column_px", "order", "modulation", "quality")
SUFFIXES = (".npz", ".ply", ".tif", ".tiff")


class Stored(Model):
    """A model with a JSON file of its own."""

    def save(self, path: Path | str) -> None:
        """Write the model as JSON, whole or not at all."""
        require_suffix(Path(path), (".json",))
        with atomic(Path(path)) as temporary:
            temporary.write_text(self.model_dump_json(indent=2, exclude_none=True) + "\n")

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


class Calibration(Stored):
    """What turns a raw shot into millimetres: the devices, and the defects of the channels (R, G, B, IR).

    `projector` is the visible one; `infrared` is known when both were calibrated.
    """

    schema_version: Literal[1] = 1
    camera: DeviceModel
    projector: DeviceModel
    infrared: DeviceModel | None = None
    dark: Row4 | None = None
    response: Response | None = None
    crosstalk: Matrix4 | None = None
    ir_registration: Affine | None = None


def conditioning(calibration: Calibration | None, response: Response | None) -> dict[str, Any]:
    """Give what is known about the intensities as the kernel's keywords; `response` stands in for the calibration's."""
    response = response or (calibration.response if calibration else None)
    known = {
        "response": response.rows() if response else None,
        "dark": calibration.dark if calibration else None,
        "crosstalk": calibration.crosstalk if calibration else None,
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
class Shot:
    """One exposure: four images (H, W) of one dtype (uint8, uint16 or float32), and their full scale."""

    red: NDArray[Any]
    green: NDArray[Any]
    blue: NDArray[Any]
    ir: NDArray[Any]
    full_scale: float | None = None
    truth: Truth | None = field(default=None, repr=False)

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
class BayerShot:
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
class Shape:
    """A decoded shot: maps (H, W) float32, points (H, W, 3) mm when calibrated; NaN where there is no data.

    `config` and `calibration` are the settings that made it and travel with it into an NPZ file.
    """

    phase_rad: Map
    column_px: Map
    order: Map
    modulation: Map
    quality: Map
    xyz_mm: Map | None = None
    config: Mapping[str, Any] = field(default_factory=dict, repr=False)
    calibration: Calibration | None = field(default=None, repr=False)

    @property
    def maps(self) -> dict[str, Map]:
        """Every map by name; `xyz_mm` only when calibrated."""
        maps = {name: getattr(self, name) for name in MAPS}
        return maps if self.xyz_mm is None else {**maps, "xyz_mm": self.xyz_mm}

    @property
    def returned(self) -> NDArray[np.bool_]:
        """Pixels with a phase, (H, W)."""
        return np.isfinite(self.phase_rad)

    @property
    def depth_mm(self) -> Map:
        """Depth along the camera's axis, (H, W), mm; raises `InputError` when not calibrated."""
        return self._points()[:, :, 2]

    def _points(self) -> Map:
        if self.xyz_mm is None:
            raise InputError("this shape has phase only: decode with a calibration to have millimetres")
        return self.xyz_mm

    def with_settings(self, config: Mapping[str, Any], calibration: Calibration | None) -> Shape:
        """Give the same maps with the settings that made them."""
        return replace(self, config=config, calibration=calibration)

    def save(self, path: Path | str) -> None:
        """Write by suffix: .ply points, .tif depth, .npz everything. Whole or not at all.

        PLY holds the valid points only, with the modulation as grey colour and `quality` as a scalar.
        """
        from quadfringe import export

        path = Path(path)
        suffix = require_suffix(path, SUFFIXES)
        if suffix == ".npz":
            export.write_npz(path, self.maps, self._texts())
        elif suffix == ".ply":
            points = self._points()
            valid = np.isfinite(points).all(axis=2)
            export.write_ply(path, points[valid], _grey(self.modulation)[valid], self.quality[valid])
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
        maps = {name: stored[name] for name in (*MAPS, "xyz_mm") if name in stored}
        return cls(**maps, config=config, calibration=calibration)


def _grey(modulation: Map) -> NDArray[np.uint8]:
    """Modulation as a grey picture, (H, W, 3): it follows the reflectance, and shows no fringes."""
    top = np.nanquantile(modulation, 0.99) if np.isfinite(modulation).any() else 1.0
    grey = np.nan_to_num(modulation / max(float(top), 1e-9)).clip(0, 1) * 255
    return np.repeat(grey.astype(np.uint8)[:, :, None], 3, axis=2)
