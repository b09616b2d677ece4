"""`Calibration`: the data that turn a raw shot into millimetres, with a record of how they were measured."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field

from quadfringe.config import (
    Affine,
    Camera,
    Device,
    Matrix4,
    Model,
    Response,
    ResponseChoice,
    Row4,
    brief,
    checked,
    shortened,
)
from quadfringe.data.drawing import cards, plots
from quadfringe.errors import ConfigError
from quadfringe.files import TEXT_BYTES, atomic, read_bytes, require_suffix
from quadfringe.io.texts import json_of

__all__ = [
    "DIGEST",
    "Calibration",
    "CalibrationRecord",
    "CalibrationStep",
    "ResponseCalibration",
    "conditioning",
    "stored_values",
]

FILE = "calibration.json"  # in a folder that holds a calibration
DIGEST = "digest"  # key of a file, not of the model: a changed copy of a model has no digest that could be wrong
EXACT = 1 << 53  # integers below have a float of the same value


def _short_lists(text: str) -> str:
    """Put every list of plain numbers on one line: a matrix is then read row by row."""
    return re.sub(r"\[\n\s*([-+\d.eE,\s]*?)\n\s*\]", lambda m: f"[{' '.join(m[1].split())}]", text)


class Stored(Model):
    """A model that is saved as a JSON file."""

    def save(self, path: Path | str) -> None:
        """Write the model as JSON, whole or not at all."""
        require_suffix(Path(path), (".json",))
        with atomic(Path(path)) as temporary:
            temporary.write_text(_short_lists(self._text()) + "\n")

    def _text(self) -> str:
        return self.model_dump_json(indent=2, exclude_none=True)

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a model from JSON; raises `InputError` for no file, `ConfigError` that lists the problems in it."""
        return checked(cls, stored_values(path), str(path))


class Measured(Stored):
    """A result of measurements, which nobody edits: its file ends with a digest that tells a changed file.

    A file without one, of an earlier version or written by hand, is read as well.
    """

    def _text(self) -> str:
        values = json.loads(super()._text())
        return json.dumps(values | {DIGEST: digest_of(values)}, indent=2, ensure_ascii=False)

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Read a model as `Stored.load` does; raises `ConfigError` also when the digest shows that it was changed."""
        stored = stored_values(path)
        values = {name: value for name, value in stored.items() if name != DIGEST}
        loaded = checked(cls, values, str(path))
        if DIGEST in stored and stored[DIGEST] != digest_of(values):
            raise ConfigError(
                f"{path}: was changed after it was saved: its {DIGEST} is {brief(stored[DIGEST])}, that of its values "
                f"{digest_of(values)}; restore the file, or, if the change is meant, remove the key {DIGEST}"
            )
        return loaded


def stored_values(path: Path | str) -> dict[str, Any]:
    """Read the JSON object in a file; raises `InputError` for no file, `ConfigError` for anything else in it."""
    values = json_of(read_bytes(Path(path), TEXT_BYTES), str(path))
    if not isinstance(values, dict):
        raise ConfigError(f"{path}: expected a JSON object, got {type(values).__name__}")
    return values


def digest_of(values: Mapping[str, Any]) -> str:
    """Give the SHA-256 of JSON values; it depends on the values and neither on their order nor on their layout."""
    text = json.dumps(_as_floats(values), sort_keys=True, separators=(",", ":"))
    return f"sha256:{sha256(text.encode()).hexdigest()}"


def _as_floats(value: Any) -> Any:
    """Write 5 as 5.0, because programs that lay a file out anew differ in that."""
    if isinstance(value, dict):
        return {key: _as_floats(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_as_floats(inner) for inner in value]
    exact = isinstance(value, int) and not isinstance(value, bool) and abs(value) < EXACT
    return float(value) if exact else value


class ResponseCalibration(Measured, Response):
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


class Calibration(Measured):
    """The data that turn a raw shot into millimetres: the devices, and the defects of the channels (R, G, B, IR).

    `response` is corrected before `crosstalk`, `projector_response` after it.
    """

    schema_version: Literal[1, 2] = Field(
        default=2, description="Version of this format; files of version 1 have neither `infrared` nor `record`."
    )
    camera: Camera = Field(description="The camera, whose frame holds all coordinates.")
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

    def _repr_html_(self) -> str:
        return str(cards().calibration_card(self))

    def plot(self) -> Any:
        """Plot the devices from above, and the responses that are known; give the axes in an array.

        Raises `MissingExtraError` without matplotlib (extra `plot`).

        >>> calibration.plot()[0].set_title("bench 2")                                   # doctest: +SKIP
        """
        return plots().plot_calibration(self)


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
