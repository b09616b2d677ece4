"""`quadfringe info`: describe a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import say

__all__ = ["info"]


def info(
    file: Annotated[
        Path,
        typer.Argument(help="A shape, calibration, camera response, file of figures, system file, recording or image."),
    ],
) -> None:
    """Describe a file: its maps and their ranges, its settings, its calibration."""
    from quadfringe.recording.inspection import lines_about

    for line in lines_about(file):
        say(line)
