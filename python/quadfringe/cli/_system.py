"""The system of a command: a system file, a camera by one word, or both."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._options import ChannelsOfCode, SomeNumbers, fringes_from

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


def system_of(
    system: Path | None,
    camera: str | None,
    encoding: ChannelsOfCode | None = None,
    numbers: SomeNumbers | None = None,
) -> SystemConfig | None:
    """Return the settings of a system file with this camera and these fringes; None for none, the virtual bench."""
    from quadfringe.config import SystemConfig, load_system
    from quadfringe.config.cameras import capture_config

    changes: dict[str, Any] = {} if camera is None else {"capture": capture_config(camera)}
    if encoding is not None or numbers is not None:
        changes["fringes"] = fringes_from(encoding, numbers, None)
    if system is None:
        return SystemConfig(**changes) if changes else None
    # A file that says nothing of a setting leaves it to a recording; so must the file with other settings.
    return load_system(system).model_copy(update=changes)
