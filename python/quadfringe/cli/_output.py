"""What commands say and where: results to stdout or a file, progress and complaints to stderr."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from threading import Event
from typing import Annotated, Any, TypeVar

import typer

from quadfringe.files import atomic, figures_text

__all__ = [
    "Bayer",
    "Fringes3",
    "JsonOption",
    "OutFolder",
    "PredeformedOption",
    "SystemFile",
    "complain",
    "rows",
    "say",
    "steps",
    "stop_asked",
    "stoppable",
    "table",
    "write_figures",
    "write_record",
]

Item = TypeVar("Item")

JsonOption = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", help="Write the figures as JSON; - is standard output."),
]
Fringes3 = Annotated[
    tuple[float, float, float],
    typer.Option("--fringes", metavar="N N N", help="Fringe numbers: red and blue, green, infrared."),
]

OutFolder = Annotated[Path, typer.Option(metavar="DIR", help="Folder for the files; created when it is missing.")]
SystemFile = Annotated[
    Path | None, typer.Argument(metavar="[SYSTEM.toml]", help="System file; default: the virtual bench.")
]
PredeformedOption = Annotated[
    float | None,
    typer.Option(
        "--predeformed-z-mm", min=1.0, metavar="MM", help="Infrared pre-deformed for the plane at this depth."
    ),
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
    rows(title, ("figure", "value"), figures.items(), json)


def rows(
    title: str, head: Sequence[str], lines: Iterable[Sequence[str | int | float]], json: Path | None = None
) -> None:
    """Print lines of words and numbers under a head; the first column to the left; on stderr as in `say`."""
    from rich.console import Console
    from rich.table import Table

    drawn = Table()
    for column, name in enumerate(head):
        drawn.add_column(name, justify="right" if column else "left")
    for line in lines:
        drawn.add_row(*(f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in line))
    console = Console(stderr=_stdout_is_taken(json))
    console.print(title, highlight=False, soft_wrap=True)
    console.print(drawn)


def write_figures(figures: Mapping[str, float], json: Path | None) -> None:
    """Write {"figures": {...}} to the file, or to stdout for "-"."""
    _write(figures_text(figures), json)


def write_record(record: Mapping[str, Any], json: Path | None) -> None:
    """Write plain data to the file, or to stdout for "-"."""
    from json import dumps

    _write(dumps(record, indent=2, allow_nan=False) + "\n", json)


def _write(text: str, json: Path | None) -> None:
    if json is None:
        return
    if _stdout_is_taken(json):
        sys.stdout.write(text)
        return
    with atomic(json) as temporary:
        temporary.write_text(text)


@contextmanager
def steps(items: Iterable[Item], title: str, total: int | None = None) -> Iterator[Iterable[Item]]:
    """Walk over long work with a progress bar on stderr; silent when stderr is not a terminal."""
    from rich.console import Console
    from rich.progress import track

    console = Console(stderr=True)
    yield track(items, description=title, total=total, console=console, transient=True, disable=not console.is_terminal)


@contextmanager
def stoppable() -> Iterator[None]:
    """Let Ctrl-C, or the SIGTERM of a service, end the block in order."""
    import signal

    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    except KeyboardInterrupt:
        pass
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def stop_asked() -> Iterator[Event]:
    """Give an event that Ctrl-C or SIGTERM sets; the second Ctrl-C interrupts.

    Nothing is interrupted in the middle, and a signal cannot be lost in a callback of a library.
    """
    import signal

    asked = Event()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def ask(*_: object) -> None:
        asked.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    for number in before:
        signal.signal(number, ask)
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
