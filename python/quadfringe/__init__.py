"""quadfringe: one exposure in, one metric 3D shape out.

Three levels of detail: one call (`open` gives a `Scanner`), the steps (`read_shot`, `decode`, `Shape.save`; many shots
with a `Decoder`; `compare`), and the stages of the published method one by one (`stages`).

Conventions: arrays are (H, W), x to the right, y down, z forward, pixel centres at integers; phase in rad, lengths in
mm; NaN means no data. A property holds data or follows from it without arguments, and cannot fail. A method reads,
writes, takes arguments, can fail, or computes for long.

Names are loaded when they are first used, so that the import is fast. `quadfringe.open` is `open_system`; a star
import leaves it out, because it would replace the built-in function, and the packages (`devices`, `recording`, ...)
because `io` would replace the module of Python.

A shot of the virtual bench with a small camera, its shape, and what may go wrong:

>>> import quadfringe as qf
>>> camera = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> scene = qf.SceneConfig(surface="sphere", noise=0.01, seed=1)
>>> with qf.open_system(qf.SystemConfig(camera=camera, scene=scene)) as scanner:  # or qf.open
...     shot, calibration = scanner.grab(), scanner.calibration
>>> isinstance(calibration, qf.Calibration), isinstance(shot.truth, qf.Truth), qf.__version__ >= "0.1"
(True, True, True)
>>> decode = qf.DecodeConfig(method="joint", quality_min=0.2)
>>> try:
...     shape = qf.decode(shot, qf.Plan(912, qf.Fringes(), calibration, decode=decode, response=qf.Response()))
... except qf.DecodeError as error:  # a shot that cannot be trusted
...     print(error.reason, error.fix)
... except (qf.ConfigError, qf.InputError) as error:  # settings or files that cannot be used
...     print(error)
>>> shape.depth_mm.shape
(192, 256)

Fringe numbers and patterns:

>>> qf.optimum(36, 912), round(qf.check_code((36, 35, 30), 912), 2)
([36.0, 35.0, 30.0], 1.05)
>>> qf.pattern("red", (36, 35, 30), 912, 1140).shape
(1140, 912)

Errors of devices and files are `OSError` or say what to install, and every one names what to do:

>>> camera_errors = (qf.CameraNotFoundError, qf.CameraBusyError, qf.CameraLostError, qf.ShotTimeoutError)
>>> all(issubclass(error, qf.CameraError) for error in (*camera_errors, qf.UnpairedError, qf.WrongFrameError))
True
>>> issubclass(qf.CameraError, OSError), issubclass(qf.RecordingError, OSError)
(True, True)
>>> issubclass(qf.CalibrationError, qf.DecodeError), issubclass(qf.MissingExtraError, ImportError)
(True, True)
>>> issubclass(qf.BatchError, RuntimeError)  # the same command continues the batch
True
>>> import warnings
>>> with warnings.catch_warnings():
...     for doubt in (qf.DecodeWarning, qf.CameraWarning, qf.RecordingWarning):
...         warnings.simplefilter("error", doubt)  # doubts become errors
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quadfringe import (  # noqa: F401 - used as quadfringe.devices and so on
        calibration,
        config,
        data,
        decoding,
        devices,
        doctor,
        errors,
        evaluation,
        io,
        recording,
        scanner,
        view,
    )
    from quadfringe._core import __version__
    from quadfringe.config import DecodeConfig, Device, Fringes, Response, SceneConfig, SystemConfig
    from quadfringe.config.encoding import check_code, optimum, pattern
    from quadfringe.data import (
        BayerShot,
        Calibration,
        Reason,
        ResponseCalibration,
        Shape,
        Shot,
        Stamp,
        Truth,
        read_shot,
    )
    from quadfringe.decoding import Decoder, Plan, decode, decode_steps, estimate_response, stages
    from quadfringe.decoding.compare import compare
    from quadfringe.devices import open_camera, open_projector
    from quadfringe.errors import (
        BatchError,
        CalibrationError,
        CameraBusyError,
        CameraError,
        CameraLostError,
        CameraNotFoundError,
        CameraWarning,
        ConfigError,
        DecodeError,
        DecodeWarning,
        InputError,
        MissingExtraError,
        RecordingError,
        RecordingWarning,
        ShotTimeoutError,
        UnpairedError,
        WrongFrameError,
    )
    from quadfringe.scanner import Scanner, open_system
    from quadfringe.scanner import open_system as open  # noqa: A004, F401 - used as quadfringe.open

__all__ = [
    "BatchError",
    "BayerShot",
    "Calibration",
    "CalibrationError",
    "CameraBusyError",
    "CameraError",
    "CameraLostError",
    "CameraNotFoundError",
    "CameraWarning",
    "ConfigError",
    "DecodeConfig",
    "DecodeError",
    "DecodeWarning",
    "Decoder",
    "Device",
    "Fringes",
    "InputError",
    "MissingExtraError",
    "Plan",
    "Reason",
    "RecordingError",
    "RecordingWarning",
    "Response",
    "ResponseCalibration",
    "Scanner",
    "SceneConfig",
    "Shape",
    "Shot",
    "ShotTimeoutError",
    "Stamp",
    "SystemConfig",
    "Truth",
    "UnpairedError",
    "WrongFrameError",
    "__version__",
    "check_code",
    "compare",
    "decode",
    "decode_steps",
    "estimate_response",
    "open_camera",
    "open_projector",
    "open_system",
    "optimum",
    "pattern",
    "read_shot",
    "stages",
]

_NAMES_IN = {
    "_core": ("__version__",),
    "config.encoding": ("check_code", "optimum", "pattern"),
    "config": ("DecodeConfig", "Device", "Fringes", "Response", "SceneConfig", "SystemConfig"),
    "data": (
        "BayerShot",
        "Calibration",
        "Reason",
        "ResponseCalibration",
        "Shape",
        "Shot",
        "Stamp",
        "Truth",
        "read_shot",
    ),
    "decoding.compare": ("compare",),
    "decoding": ("Decoder", "Plan", "decode", "decode_steps", "estimate_response"),
    "devices": ("open_camera", "open_projector"),
    "scanner": ("Scanner", "open_system"),
}
_MODULE_OF = {name: module for module, names in _NAMES_IN.items() for name in names}
_MODULE_OF |= {name: "errors" for name in __all__ if name.endswith(("Error", "Warning"))}
_PACKAGES = (
    "calibration",
    "config",
    "data",
    "decoding",
    "devices",
    "doctor",
    "errors",
    "evaluation",
    "io",
    "recording",
    "scanner",
    "view",
)
_MODULES = {name: f"quadfringe.{name}" for name in _PACKAGES} | {"stages": "quadfringe.decoding.stages"}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    sought = "open_system" if name == "open" else name
    if sought not in _MODULE_OF:
        raise AttributeError(f"module 'quadfringe' has no attribute {name!r}")
    return getattr(import_module(f"quadfringe.{_MODULE_OF[sought]}"), sought)


def __dir__() -> list[str]:
    return [*__all__, *_PACKAGES, "open"]
