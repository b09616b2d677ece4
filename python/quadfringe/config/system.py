"""`SystemConfig`: a whole system, and the TOML file that describes it.

Every table may be left out; a setting of an algorithm that is left out takes the kernel's default, which is written
once, in Rust.

>>> from quadfringe.config import SystemConfig
>>> SystemConfig().fringes.numbers
(36.0, 35.0, 30.0)
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from quadfringe.config._base import Model, checked
from quadfringe.config._brief import brief
from quadfringe.config.cameras import AnyCapture, FilesConfig, ReplayConfig, UvcConfig, VirtualConfig
from quadfringe.config.decode import DecodeConfig
from quadfringe.config.devices import Camera, Device
from quadfringe.config.fringes import Fringes
from quadfringe.config.projectors import ProjectorsConfig
from quadfringe.config.scene import SceneConfig
from quadfringe.errors import InputError
from quadfringe.files import TEXT_BYTES, read_bytes
from quadfringe.io.texts import toml_of

__all__ = ["SystemConfig", "check_system", "load_system"]

FILE = "system.toml"


class SystemConfig(Model):
    """A whole system: devices, fringes, scene and decoding."""

    schema_version: Literal[1] = Field(default=1, description="Version of this format.")
    capture: AnyCapture = Field(
        default=VirtualConfig(),
        description='The camera: a table with its kind, or a word such as "aravis:NAME" or "uvc:0". Absent: the '
        "virtual bench.",
    )
    camera: Camera | None = Field(
        default=None, description="Camera of the virtual bench. Absent: the published camera."
    )
    projector: Device | None = Field(
        default=None, description="Visible projector of the virtual bench. Absent: the published projector."
    )
    infrared: Device | None = Field(
        default=None, description="Infrared projector of the virtual bench. Absent: coaxial with `projector`."
    )
    calibration: Path | None = Field(default=None, description="Calibration file (.json).")
    projectors: ProjectorsConfig | None = Field(
        default=None,
        description="Projectors that this program drives. Absent: the virtual bench lights itself, and every other "
        "camera sees the light that is there.",
    )
    fringes: Fringes = Field(default=Fringes(), description="Fringes that the projectors show.")
    scene: SceneConfig = Field(default=SceneConfig(), description="The scene of the virtual bench.")
    decode: DecodeConfig = Field(default=DecodeConfig(), description="How shots are decoded.")


def check_system(config: object) -> None:
    """Raise `InputError` unless these are the settings of a system, and say how to read them from a file."""
    if not isinstance(config, SystemConfig):
        advice = "; read a system file with qf.config.load_system" if isinstance(config, (str, Path)) else ""
        raise InputError(f"config: expected a SystemConfig, such as qf.SystemConfig(), got {brief(config)}{advice}")


def load_system(path: Path | str) -> SystemConfig:
    """Read a system file, or system.toml of a folder; paths inside the file are relative to it.

    Raises `ConfigError` that lists the problems, `InputError` when the file cannot be read.
    """
    path = Path(path)
    if path.is_dir():
        if not (path / FILE).is_file():
            raise InputError(f"{path}: a folder without {FILE}; name the system file")
        path /= FILE
    values = toml_of(read_bytes(path, TEXT_BYTES), str(path))
    config = checked(SystemConfig, values, str(path))
    return _with_absolute_paths(config, path.resolve().parent)


def _with_absolute_paths(config: SystemConfig, folder: Path) -> SystemConfig:
    scene = config.scene
    if scene.height_map is not None:
        file = folder / scene.height_map.file
        scene = scene.model_copy(update={"height_map": scene.height_map.model_copy(update={"file": file})})
    calibration = None if config.calibration is None else folder / config.calibration
    capture, decode = config.capture, config.decode
    if isinstance(capture, ReplayConfig):
        capture = capture.model_copy(update={"file": folder / capture.file})
    if isinstance(capture, FilesConfig):
        capture = capture.model_copy(update={"folder": folder / capture.folder})
    if isinstance(capture, UvcConfig) and not capture.device.isdigit():
        capture = capture.model_copy(update={"device": str(folder / capture.device)})
    if isinstance(decode.response, Path):
        decode = decode.model_copy(update={"response": folder / decode.response})
    changed = {"scene": scene, "calibration": calibration, "capture": capture, "decode": decode}
    return config.model_copy(update=changed)
