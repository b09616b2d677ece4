"""quadfringe: one exposure in, one metric 3D shape out.

Three doors of rising power: one call (`open`), the stages (`decode`, `render`, `pattern`, `stages`), the
parts (`Decoder`, `Device`). Names are loaded when first used, so that importing the package costs nothing.

Conventions: arrays are (H, W), x right, y down, z forward, pixel centres at integers; phase in rad, lengths
in mm; NaN is "no data".
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quadfringe._core import Decoder, Device, __version__, check_code, optimum, pattern
    from quadfringe.config import DecodeConfig, DeviceModel, Fringes, Response, SceneConfig, SystemConfig
    from quadfringe.data import (
        BayerShot,
        Calibration,
        ResponseCalibration,
        Shape,
        Shot,
        Stamp,
        Truth,
        read_bayer_shot,
        read_shot,
    )
    from quadfringe.decoding import Plan, ShotDecoder, decode, own_response
    from quadfringe.devices import open_camera, open_projector
    from quadfringe.errors import CameraError, ConfigError, DecodeError, InputError, MissingExtraError
    from quadfringe.scanner import Scanner
    from quadfringe.scanner import open_system as open  # noqa: A004 - read as quadfringe.open

_HOME = {
    "_core": ("Decoder", "Device", "__version__", "check_code", "optimum", "pattern"),
    "config": ("DecodeConfig", "DeviceModel", "Fringes", "Response", "SceneConfig", "SystemConfig"),
    "data": ("BayerShot", "Calibration", "ResponseCalibration", "Shape", "Shot", "Stamp", "Truth"),
    "decoding": ("Plan", "ShotDecoder", "decode", "own_response"),
    "devices": ("open_camera", "open_projector"),
    "errors": ("CameraError", "ConfigError", "DecodeError", "InputError", "MissingExtraError"),
    "scanner": ("Scanner", "open_system"),
    "data.shot_files": ("read_bayer_shot", "read_shot"),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "BayerShot",
    "Calibration",
    "CameraError",
    "ConfigError",
    "DecodeConfig",
    "DecodeError",
    "Decoder",
    "Device",
    "DeviceModel",
    "Fringes",
    "InputError",
    "MissingExtraError",
    "Plan",
    "Response",
    "ResponseCalibration",
    "Scanner",
    "SceneConfig",
    "Shape",
    "Shot",
    "ShotDecoder",
    "Stamp",
    "SystemConfig",
    "Truth",
    "__version__",
    "check_code",
    "decode",
    "open",
    "open_camera",
    "open_projector",
    "optimum",
    "own_response",
    "pattern",
    "read_bayer_shot",
    "read_shot",
]


def __getattr__(name: str) -> Any:
    asked = "open_system" if name == "open" else name
    if asked not in _MODULE_OF:
        raise AttributeError(f"module 'quadfringe' has no attribute {name!r}")
    return getattr(import_module(f"quadfringe.{_MODULE_OF[asked]}"), asked)


def __dir__() -> list[str]:
    return __all__
