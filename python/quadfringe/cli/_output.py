"""Where commands write: results go to standard output or a file, progress and errors to standard error."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import Any, TextIO, TypeVar
from unicodedata import bidirectional, category

import typer

from quadfringe.files import atomic, figures_text

__all__ = [
    "caution",
    "cautions",
    "complain",
    "note",
    "printable",
    "progress",
    "rows",
    "say",
    "stop_requested",
    "stoppable",
    "table",
    "write_figures",
    "write_record",
]

Item = TypeVar("Item")
DIRECTIONS = ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")  # texts that read otherwise than they are


def complain(message: str) -> None:
    """Print an error on standard error."""
    typer.echo(printable(f"error: {message}"), err=True)


def caution(message: str) -> None:
    """Print a warning on standard error."""
    typer.echo(printable(f"warning: {message}"), err=True)


def note(message: str) -> None:
    """Print on standard error what a result does not tell, which is no sign of a fault."""
    typer.echo(printable(f"note: {message}"), err=True)


@contextmanager
def cautions() -> Iterator[None]:
    """Print warnings of recordings and cameras in the form of `caution`, each once."""
    from quadfringe.errors import CameraWarning, RecordingWarning

    seen: set[str] = set()
    with warnings.catch_warnings():
        others = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if not issubclass(category, (CameraWarning, RecordingWarning)):
                others(message, category, filename, lineno, file, line)
            elif str(message) not in seen:
                seen.add(str(message))
                caution(str(message))

        for kind in (CameraWarning, RecordingWarning):
            warnings.simplefilter("always", kind)
        warnings.showwarning = show
        yield


def say(message: str, json: Path | None = None) -> None:
    """Print a message for a person; on standard error when `json` occupies standard output."""
    typer.echo(printable(message), err=_is_stdout(json))


def printable(text: str) -> str:
    """Escape what a terminal would obey instead of showing it: texts of files, and names of files, reach messages."""
    return "".join(letter if letter in "\n\t" or _shown(letter) else _escaped(letter) for letter in text)


def _shown(letter: str) -> bool:
    """Say whether a letter is shown: no control, no change of the direction of writing, no half of a letter."""
    return category(letter) not in ("Cc", "Cs") and bidirectional(letter) not in DIRECTIONS


def _escaped(letter: str) -> str:
    return letter.encode("unicode_escape").decode()


def _is_stdout(json: Path | None) -> bool:
    return json is not None and str(json) == "-"


def table(title: str, figures: Mapping[str, float], json: Path | None = None) -> None:
    """Print figures as a table of two columns; on standard error as in `say`."""
    rows(title, ("figure", "value"), figures.items(), json)


def rows(
    title: str, head: Sequence[str], lines: Iterable[Sequence[str | int | float]], json: Path | None = None
) -> None:
    """Print a table with a title and column heads, first column left-aligned; on standard error as in `say`."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    drawn = Table()
    for column, name in enumerate(head):
        drawn.add_column(name, justify="right" if column else "left")
    for line in lines:
        words = (f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in line)
        drawn.add_row(*(Text(printable(one)) for one in words))  # a Text is not markup, whatever is in brackets
    console = Console(stderr=_is_stdout(json))
    console.print(Text(printable(title)), highlight=False, soft_wrap=True)
    console.print(drawn)


def write_figures(figures: Mapping[str, float], json: Path | None, **more: list[str]) -> None:
    """Write {"figures": {...}, ...} to a file, or to standard output for "-"; do nothing without `json`."""
    _write(figures_text(figures, **more), json)


def write_record(record: Mapping[str, Any], json: Path | None) -> None:
    """Write plain data as JSON to a file, or to standard output for "-"; do nothing without `json`."""
    from json import dumps

    _write(dumps(record, indent=2, allow_nan=False) + "\n", json)


def _write(text: str, json: Path | None) -> None:
    if json is None:
        return
    if _is_stdout(json):
        sys.stdout.write(text)
        return
    with atomic(json) as temporary:
        temporary.write_text(text)


@contextmanager
def progress(items: Iterable[Item], title: str, total: int | None = None) -> Iterator[Iterable[Item]]:
    """Iterate with a progress bar on standard error; without a bar when standard error is not a terminal."""
    from rich.console import Console
    from rich.progress import track

    console = Console(stderr=True)
    yield track(items, description=title, total=total, console=console, transient=True, disable=not console.is_terminal)


@contextmanager
def stoppable() -> Iterator[None]:
    """Let Ctrl-C, or the SIGTERM of a service manager, end the block without an error."""
    import signal

    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    except KeyboardInterrupt:
        pass
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def stop_requested() -> Iterator[Event]:
    """Yield an event that Ctrl-C or SIGTERM sets; a second Ctrl-C raises KeyboardInterrupt.

    The block polls the event where it can stop safely. An exception from a signal handler could be raised inside a
    callback of a library, which would swallow it.
    """
    import signal

    requested = Event()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def request(*_: object) -> None:
        requested.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    for number in before:
        signal.signal(number, request)
    try:
        yield requested
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
