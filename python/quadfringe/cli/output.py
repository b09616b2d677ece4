"""What commands say and where: results to stdout or a file, progress and complaints to stderr."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from quadfringe.files import atomic, figures_text

__all__ = ["Bayer", "Fringes3", "JsonOption", "complain", "say", "steps", "table", "write_figures"]

Item = TypeVar("Item")

JsonOption = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", help="Write the figures as JSON; - is standard output."),
]
Fringes3 = Annotated[
    tuple[float, float, float],
    typer.Option("--fringes", metavar="N N N", help="Fringe numbers: red and blue, green, infrared."),
]


class Bayer(StrEnum):
    """Colours of the first two pixels of the first row and of the second row of a chip."""

    rggb = "rggb"
    grbg = "grbg"
    gbrg = "gbrg"
    bggr = "bggr"


def complain(message: str) -> None:
    """Say what is wrong, on stderr."""
    typer.echo(f"error: {message}", err=True)


def say(message: str, json: Path | None = None) -> None:
    """Tell a person what was done; on stderr when stdout carries JSON."""
    typer.echo(message, err=_stdout_is_taken(json))


def _stdout_is_taken(json: Path | None) -> bool:
    return json is not None and str(json) == "-"


def table(title: str, figures: Mapping[str, float], json: Path | None = None) -> None:
    """Print figures as a table; on stderr when stdout carries JSON."""
    from rich.console import Console
    from rich.table import Table

    drawn = Table()
    drawn.add_column("figure")
    drawn.add_column("value", justify="right")
    for name, value in figures.items():
        drawn.add_row(name, f"{value:.4g}")
    console = Console(stderr=_stdout_is_taken(json))
    console.print(title, highlight=False, soft_wrap=True)
    console.print(drawn)


def write_figures(figures: Mapping[str, float], json: Path | None) -> None:
    """Write {"figures": {...}} to the file, or to stdout for "-"."""
    if json is None:
        return
    if _stdout_is_taken(json):
        sys.stdout.write(figures_text(figures))
        return
    with atomic(json) as temporary:
        temporary.write_text(figures_text(figures))


@contextmanager
def steps(items: Iterable[Item], title: str) -> Iterator[Iterable[Item]]:
    """Walk over long work with a progress bar on stderr; silent when stderr is not a terminal."""
    from rich.console import Console
    from rich.progress import track

    console = Console(stderr=True)
    yield track(items, description=title, console=console, transient=True, disable=not console.is_terminal)
