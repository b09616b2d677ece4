"""What can go wrong, by who can mend it: the caller (`InputError`), the bench (`DecodeError`, `CameraError`)."""

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
    "ConfigError",
    "DecodeError",
    "InputError",
    "MissingExtraError",
    "RecordingError",
    "ShotTimeoutError",
    "UnpairedError",
    "WrongFrameError",
    "require",
]


class InputError(ValueError):
    """A file or a value that cannot be used; the message says what was expected and what came."""


class ConfigError(InputError):
    """A settings or calibration file with unknown keys or wrong values; the message lists every one with its path."""


class DecodeError(RuntimeError):
    """A shot from which no shape can be trusted; the message says why and what to look at."""


class CalibrationError(DecodeError):
    """Captures that cannot be calibrated; `reason` is one word for programs, the message is for people."""

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason


class CameraError(OSError):
    """What a camera did; the message says what to look at. The camera may be asked again: it reconnects."""


class CameraNotFoundError(CameraError):
    """No camera answers to this name, or more than one does; the message lists those that answer."""


class CameraBusyError(CameraError):
    """Another program controls the camera."""


class CameraLostError(CameraError):
    """The camera no longer answers: power, cable, network, or another program took it over."""


class ShotTimeoutError(CameraError):
    """The camera answers, and no shot came in time: no trigger, or all of its packets are lost."""


class UnpairedError(ShotTimeoutError):
    """Frames of one chip came, and none of the other chip of the same instant."""


class WrongFrameError(CameraError):
    """Frames came in another size or pixel format than was agreed, or damaged, and none that is right."""


class RecordingError(OSError):
    """A recording that cannot go on; the message says why and how many shots are safe."""


class BatchError(RuntimeError):
    """A batch that cannot go on; what was decoded stays, and the same command goes on from there."""


class MissingExtraError(ImportError):
    """An optional library that is not installed; the message names the extra that brings it."""


def require(module: str, extra: str) -> ModuleType:
    """Import an optional library, or raise `MissingExtraError` naming the extra that brings it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingExtraError(
            f'{module} is needed here and is not installed: pip install "quadfringe[{extra}]"'
        ) from error
