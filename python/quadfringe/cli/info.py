"""`quadfringe info`: describe a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import progress, say

__all__ = ["info"]


def info(
    file: Annotated[
        Path,
        typer.Argument(help="A shape, calibration, camera response, file of figures, system file, recording or image."),
    ],
    verify: Annotated[
        bool, typer.Option("--verify", help="Read all shots of a recording and compare them with their checksums.")
    ] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Print all settings and the whole calibration of a recording.")
    ] = False,
) -> None:
    """Describe a file: its maps and their ranges, its settings, its calibration; a recording on one screen.

    With --verify, a recording that is damaged, was changed or is incomplete makes the exit status 1.
    """
    from quadfringe.recording.inspection import lines_about

    if verify:
        _verify(file)
        return
    for line in lines_about(file, full=full):
        say(line)


def _verify(path: Path) -> None:
    """Print what is wrong with a recording; raise `RecordingError` unless nothing is."""
    from quadfringe.errors import InputError, RecordingError
    from quadfringe.recording import Recording

    if path.suffix.lower() != ".h5":
        raise InputError(f"{path}: --verify is for recordings (.h5)")
    with (
        Recording(path, rescue=True) as recording,
        progress(range(len(recording)), "verifying", len(recording)) as indices,
    ):
        found = recording.verify(indices)
    say(f"{path}: {found.shots - len(found.damaged)} of {found.shots} shots are whole")
    say(f"SHA-256: {recording.sha256}")
    if not recording.closed_in_order:
        say("not closed: shots may be missing at its end")
    if found.damaged:
        raise RecordingError(f"{path}: damaged shots: {', '.join(map(str, found.damaged))}")
    if found.faults:
        raise RecordingError(f"{path}: not as it was recorded: {'; '.join(found.faults)}")
