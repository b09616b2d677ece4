"""What can go wrong, by who can mend it: the caller (`InputError`), the set-up on the bench (`DecodeError`)."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

__all__ = ["CalibrationError", "ConfigError", "DecodeError", "InputError", "MissingExtraError", "require"]


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
