"""`quadfringe calibrate`: what a bench must know of itself before it measures."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli.output import JsonOption, table, write_figures

__all__ = ["app"]

app = typer.Typer(help="Estimate what a bench must know of itself.", no_args_is_help=True)


class ChannelName(StrEnum):
    """Which channel a stack of images belongs to."""

    all = "all"
    red = "red"
    green = "green"
    blue = "blue"
    ir = "ir"


@app.callback()
def calibrate() -> None:
    """Estimate what a bench must know of itself."""


@app.command()
def response(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Images in the order of their shifts.")],
    steps: Annotated[int, typer.Option(min=4, max=64, help="Equal shifts in one period.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The response, .json.")],
    channel: Annotated[ChannelName, typer.Option(help="Channel that the images show.")] = ChannelName.all,
    base: Annotated[Path | None, typer.Option(metavar="FILE", help="Response that gives the others.")] = None,
    json: JsonOption = None,
) -> None:
    """Estimate the response (gamma) of a channel from an N-step capture; several stacks may follow one another."""
    from quadfringe.calibration.response import estimate_from_files
    from quadfringe.data import ResponseCalibration
    from quadfringe.files import require_suffix

    require_suffix(out, (".json",))
    known = None if base is None else ResponseCalibration.load(base)
    names = None if channel is ChannelName.all else (channel.value,)
    found = estimate_from_files(files, steps, names, known)
    found.calibration.save(out)
    table(f"{out}: linear = max(I / (1 - knee I^20) - offset, 0) ^ exponent", found.figures, json)
    write_figures(found.figures, json)
