"""`Calibration`: the data that turn a raw shot into millimetres, with a record of how they were measured."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field

from quadfringe.config import Affine, Device, Matrix4, Model, Response, ResponseChoice, Row4, checked, shortened
from quadfringe.errors import ConfigError
from quadfringe.files import atomic, read_bytes, require_suffix

__all__ = ["Calibration", "CalibrationRecord", "CalibrationStep", "ResponseCalibration", "conditioning"]

FILE = "calibration.json"  # in a folder that holds a calibration


def _short_lists(text: str) -> str:
    """Put every list of plain numbers on one line: a matrix is then read row by row."""
    return re.sub(r"\[\n\s*([-+\d.eE,\s]*?)\n\s*\]", lambda m: f"[{' '.join(m[1].split())}]", text)


class Stored(Model):
    """A model that is saved as a JSON file."""

    def save(self, path: Path | str) -> None:
        """Write the model as JSON, whole or not at all."""
        require_suffix(Path(path), (".json",))
        with atomic(Path(path)) as temporary:
            temporary.write_text(_short_lists(self.model_dump_json(indent=2, exclude_none=True)) + "\n")

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a model from JSON; raises `InputError` for no file, `ConfigError` that lists every problem in it."""
        text = read_bytes(Path(path))
        try:
            values = json.loads(text)
        except ValueError as error:
            raise ConfigError(f"{path}: not valid JSON: {error}") from error
        if not isinstance(values, dict):
            raise ConfigError(f"{path}: expected a JSON object, got {type(values).__name__}")
        return checked(cls, values, str(path))


class ResponseCalibration(Stored, Response):
    """Responses of the channels, and what they were estimated from."""

    schema_version: Literal[1] = Field(default=1, description="Version of this format.")
    steps: int | None = Field(default=None, description="Phase steps of each channel.")
    inputs: tuple[str, ...] = Field(default=(), description="Names of the image files.")


class CalibrationStep(Model):
    """One step of a calibration: inputs, settings, residuals, and a verdict."""

    name: str = Field(description="Name of the step.")
    inputs: tuple[str, ...] = Field(default=(), description="Names of the captures.")
    settings: dict[str, Any] = Field(default_factory=dict, description="Settings and data of the step.")
    figures: dict[str, float | None] = Field(default_factory=dict, description="Residuals by name with unit.")
    good: bool = Field(description="Whether the residuals keep their limits.")
    verdict: str = Field(description="The result in words.")


class CalibrationRecord(Model):
    """When a calibration was made, by which version, of which rig, and every step with its residuals."""

    made_utc: str = Field(description="Time, UTC.")
    quadfringe_version: str = Field(description="Version of quadfringe.")
    rig: str = Field(description="Name of the rig.")
    steps: tuple[CalibrationStep, ...] = Field(default=(), description="Steps in their order.")

    @property
    def good(self) -> bool:
        """Whether every step is good."""
        return all(step.good for step in self.steps)


class Calibration(Stored):
    """The data that turn a raw shot into millimetres: the devices, and the defects of the channels (R, G, B, IR).

    `response` is corrected before `crosstalk`, `projector_response` after it.
    """

    schema_version: Literal[1, 2] = Field(
        default=2, description="Version of this format; files of version 1 have neither `infrared` nor `record`."
    )
    camera: Device = Field(description="The camera, whose frame holds all coordinates.")
    projector: Device = Field(description="The visible projector.")
    infrared: Device | None = Field(
        default=None, description="The infrared projector. Absent: coaxial with `projector`."
    )
    dark: Row4 | None = Field(default=None, description="Dark level of each channel, fraction of full scale.")
    response: Response | None = Field(default=None, description="Response of the camera.")
    crosstalk: Matrix4 | None = Field(
        default=None, description="Rows: captured R, G, B, IR; columns: projected R, G, B, IR."
    )
    projector_response: Response | None = Field(default=None, description="Response of the projectors.")
    ir_registration: Affine | None = Field(
        default=None,
        description="Affine map from pixels of the visible to pixels of the infrared chip, two rows of three.",
    )
    record: CalibrationRecord | None = Field(default=None, description="How the calibration was made.")

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a calibration from JSON, or calibration.json of a folder; raises `InputError` or `ConfigError`."""
        path = Path(path)
        return super().load(path / FILE if (path / FILE).is_file() else path)

    def __repr__(self) -> str:
        devices = {"camera": self.camera, "projector": self.projector, "infrared": self.infrared}
        words = [f"{name} {d.width_px} x {d.height_px}" for name, d in devices.items() if d is not None]
        defects = ("dark", "response", "crosstalk", "projector_response", "ir_registration")
        words += [name for name in defects if getattr(self, name) is not None]
        words += [f"made {self.record.made_utc} of {self.record.rig}"] if self.record else []
        return shortened(f"Calibration({', '.join(words)})")

    __str__ = __repr__


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
        "response": response.rows if response else None,
        "dark": calibration.dark if calibration else None,
        "crosstalk": calibration.crosstalk if calibration else None,
        "projector_response": projector.rows if projector else None,
        "ir_registration": calibration.ir_registration if calibration else None,
    }
    return {name: value for name, value in known.items() if value is not None}
