"""`Calibration`: what turns a raw shot into millimetres, with the record of how it was made."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field

from quadfringe.config import Affine, Device, Matrix4, Model, Response, ResponseChoice, Row4, checked
from quadfringe.errors import ConfigError
from quadfringe.files import atomic, read_bytes, require_suffix

__all__ = ["Calibration", "CalibrationRecord", "CalibrationStep", "ResponseCalibration", "conditioning"]


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
    camera: Device
    projector: Device
    infrared: Device | None = None
    dark: Row4 | None = None
    response: Response | None = None
    crosstalk: Matrix4 | None = None
    projector_response: Response | None = None
    ir_registration: Affine | None = None
    record: CalibrationRecord | None = None


def conditioning(calibration: Calibration | None, response: ResponseChoice | None = None) -> dict[str, Any]:
    """Give what is known about the intensities as the kernel's keywords.

    `response` replaces that of the calibration; "auto" and None leave it to the calibration. With "linear" no response
    of camera or projector is corrected; dark level, crosstalk and registration still are.
    """
    projector = calibration.projector_response if calibration and response != "linear" else None
    if response is None or response == "auto":
        response = calibration.response if calibration else None
    elif response == "linear":
        response = None
    known = {
        "response": response.rows() if response else None,
        "dark": calibration.dark if calibration else None,
        "crosstalk": calibration.crosstalk if calibration else None,
        "projector_response": projector.rows() if projector else None,
        "ir_registration": calibration.ir_registration if calibration else None,
    }
    return {name: value for name, value in known.items() if value is not None}
