"""The system of a command: a system file, a camera by one word, or both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from quadfringe.config import SystemConfig

__all__ = ["CameraOption", "system_of"]

CameraOption = Annotated[
    str | None,
    typer.Option(
        "--camera",
        metavar="WORD",
        help="Camera by one word: uvc:0 (a webcam by its number, or a video file), files:FOLDER (images that another "
        "program writes there), aravis:NAME, replay:FILE, virtual:; it replaces that of the system file.",
    ),
]


def system_of(system: Path | None, camera: str | None) -> SystemConfig | None:
    """Return the settings of a system file with this camera; None for neither, which is the virtual bench."""
    from quadfringe.config import SystemConfig, load_system
    from quadfringe.config.cameras import capture_config

    if camera is None:
        return None if system is None else load_system(system)
    if system is None:
        return SystemConfig(capture=capture_config(camera))
    # A file that says nothing of a setting leaves it to a recording; so must the file with another camera.
    return load_system(system).model_copy(update={"capture": capture_config(camera)})
