"""`quadfringe report`: a saved shape, or a recorded shot, as one HTML page that needs no network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import caution, say

if TYPE_CHECKING:
    from quadfringe.data import Shape

__all__ = ["report"]


def report(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Shape, .npz, or recording, .h5, one shot of which is decoded.")
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Page to write, .html.")] = Path("report.html"),
    shot: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Shot of a recording, counted from 0; default: the first.")
    ] = None,
) -> None:
    """Write a page with the surface, which can be turned, the maps, the uncertainty, and why pixels are missing.

    It is one file and needs no network. `quadfringe decode --report FILE.html` writes the same page of a shot.
    """
    from quadfringe.data import Shape
    from quadfringe.errors import InputError, require
    from quadfringe.files import require_suffix
    from quadfringe.view.page import SUFFIXES, write_page

    require_suffix(out, SUFFIXES)
    require("matplotlib", "plot")
    if file.is_dir():
        raise InputError(f"{file}: a folder of images says nothing of its fringes: quadfringe decode {file} --report")
    is_recording = file.suffix.lower() == ".h5"
    if shot is not None and not is_recording:
        raise InputError(f"{file}: --shot is for recordings (.h5)")
    shape = _decoded(file, shot or 0) if is_recording else Shape.load(file)
    write_page(out, shape, f"{file.name}, shot {shot or 0}" if is_recording else file.name)
    say(f"{out}: {out.stat().st_size / 1e6:.1f} MB, from {int(shape.returned.sum())} pixels with data")


def _decoded(file: Path, index: int) -> Shape:
    """Decode a shot of a recording as it was planned; print its warnings."""
    import warnings

    from quadfringe.config import ReplayConfig, SystemConfig
    from quadfringe.errors import DecodeWarning, InputError
    from quadfringe.recording import Recording
    from quadfringe.scanner import open_system

    replay = ReplayConfig(file=file.resolve(), speed="full")
    with Recording(file) as recording, open_system(SystemConfig(capture=replay)) as scanner:
        if index >= len(recording):
            raise InputError(f"{file}: has {len(recording)} shots; expected --shot below that, got {index}")
        if (taken := recording.read(index)) is None:
            raise InputError(f"{file}: shot {index} is damaged; choose another one with --shot")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DecodeWarning)
            shape = scanner.decode(taken)
    for words in shape.warnings:
        caution(words)
    return shape
