"""Errors, by who can correct them: the caller (`InputError`), or a person at the bench (`DecodeError`, `CameraError`).

>>> from quadfringe.errors import ConfigError, InputError
>>> issubclass(ConfigError, InputError), issubclass(InputError, ValueError)
(True, True)

>>> from quadfringe import errors
>>> try:
...     errors.require("a_library", "view")
... except errors.MissingExtraError as error:
...     print(error)
a_library is needed here and is not installed: pip install "quadfringe[view]"
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

__all__ = [
    "BatchError",
    "CalibrationError",
    "CameraBusyError",
    "CameraError",
    "CameraLostError",
    "CameraNotFoundError",
    "CameraWarning",
    "ConfigError",
    "DecodeError",
    "DecodeWarning",
    "InputError",
    "MissingExtraError",
    "RecordingError",
    "RecordingWarning",
    "ShotTimeoutError",
    "UnpairedError",
    "WrongFrameError",
    "require",
]


class InputError(ValueError):
    """A file or a value that cannot be used. The message names the expected and the given value."""


class ConfigError(InputError):
    """Settings or a calibration have unknown keys or wrong values; the message lists the first ten with their paths."""


class DecodeError(RuntimeError):
    """The shape of a shot cannot be trusted; the message says why and what to do.

    `reason` names the likeliest cause in a few words, and `fix` what to do about it; both may be empty.
    """

    def __init__(self, message: str = "", *, reason: str = "", fix: str = "") -> None:
        super().__init__(message)
        self.reason, self.fix = reason, fix


class DecodeWarning(UserWarning):
    """A shape was returned, and something about it is doubtful; `Shape.warnings` holds the same words."""


class CameraError(OSError):
    """A camera failed; the message says what to check. Call the camera again: it reconnects."""


class CameraWarning(UserWarning):
    """A camera or projector works otherwise than it should, or images were left out; the message says what to do."""


class CameraNotFoundError(CameraError):
    """No camera has this name, or several have; the message lists the cameras that answer."""


class CameraBusyError(CameraError):
    """Another program controls the camera."""


class CameraLostError(CameraError):
    """The camera no longer answers: power, cable, network, or another program took it over."""


class ShotTimeoutError(CameraError):
    """The camera answers, but no shot came in time: no trigger, or all packets were lost."""


class UnpairedError(ShotTimeoutError):
    """Frames of one chip came, but none of the other chip of the same instant."""


class WrongFrameError(CameraError):
    """All frames were damaged, or had another size or pixel format than agreed."""


class RecordingError(OSError):
    """A recording cannot continue; the message says why and how many shots are safe."""


class RecordingWarning(UserWarning):
    """A recording or a result of a batch was changed, was cut short, or cannot be verified; the message says which."""


class BatchError(RuntimeError):
    """A batch cannot continue; finished shots are kept, and the same command continues with the rest."""


class CalibrationError(DecodeError):
    """Captures cannot be calibrated; `reason` is one word for programs, the message is for people."""

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason


class MissingExtraError(ImportError):
    """An optional library is not installed; the message names the extra that installs it."""


def require(module: str, extra: str) -> ModuleType:
    """Import an optional library; raise `MissingExtraError` that names the extra which installs it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingExtraError(
            f'{module} is needed here and is not installed: pip install "quadfringe[{extra}]"'
        ) from error
