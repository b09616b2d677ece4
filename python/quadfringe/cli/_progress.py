"""Progress of long commands: a bar with the expected time on a terminal, plain lines elsewhere; on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from threading import Event, Thread
from time import monotonic
from typing import Protocol

import typer

from quadfringe.cli._output import printable

__all__ = ["Meter", "clock", "duration", "meter"]

BEAT_S = 1.0  # between two times on a terminal
EVERY_S = 10.0  # least time between two plain lines
SLOW_S = 5.0  # no plain line before this time: short commands say nothing


class Meter(Protocol):
    """Shows how far a command has come."""

    def begin(self, words: str) -> None:
        """Say what is done next."""

    def advance(self, amount: float = 1.0) -> None:
        """Count work that is done."""


def duration(seconds: float) -> str:
    """Give a time in words: 8 s, 3 min 20 s.

    >>> duration(200.4)
    '3 min 20 s'
    """
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


class _Lines:
    """Plain lines: the words of each part with `each`, else one line in ten seconds."""

    def __init__(self, title: str, total: float, expected_s: float | None, *, each: bool) -> None:
        self._title, self._total, self._expected_s, self._each = title, total, expected_s, each
        self._done, self._words = 0.0, ""
        self._start = monotonic()
        self._said = self._start - EVERY_S + SLOW_S

    def begin(self, words: str) -> None:
        self._words = words
        if self._each:
            self._say()

    def advance(self, amount: float = 1.0) -> None:
        self._done += amount
        if not self._each and monotonic() - self._said >= EVERY_S:
            self._say()

    def _say(self) -> None:
        self._said = monotonic()
        left_s = remaining_s(self._done, self._total, monotonic() - self._start, self._expected_s)
        rest = "" if left_s is None else f", about {duration(left_s)} to go"
        share = min(1.0, self._done / self._total) if self._total else 1.0
        typer.echo(printable(f"{self._title}: {share:.0%}, {self._words}{rest}"), err=True)


def remaining_s(done: float, total: float, spent_s: float, expected_s: float | None) -> float | None:
    """Give the time that is left: by the speed so far, at first by the expectation; None when neither is known."""
    if done <= 0:
        return None if expected_s is None else max(expected_s - spent_s, 0.0)
    return spent_s * max(total - done, 0.0) / done


@contextmanager
def meter(title: str, total: float, expected_s: float | None = None, *, each: bool = False) -> Iterator[Meter]:
    """Show the progress of `total` units of work while the block runs.

    `expected_s` is the time it takes by experience. With `each`, every part has a plain line where there is no
    terminal; otherwise there is at most one in ten seconds, and none of commands that take less than five.
    """
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _Lines(title, total, expected_s, each=each)
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[left]}"), TimeElapsedColumn())
    # Lines for standard output appear above the bar if both are the terminal, else where they were sent.
    above = sys.stdout.isatty()
    with Progress(*columns, console=console, transient=True, redirect_stdout=above) as progress:
        yield _Bar(progress, title, total, expected_s)


@contextmanager
def clock(title: str, expected_s: float) -> Iterator[None]:
    """Show the time spent of the time that the block takes by experience, which does not say how far it is."""
    from rich.console import Console

    console, start, over = Console(stderr=True), monotonic(), Event()
    with ExitStack() as stack:
        if console.is_terminal:
            from rich.status import Status

            status = stack.enter_context(Status(title, console=console))
            tell: Callable[[str], None] = status.update
        else:
            tell = partial(typer.echo, err=True)

        def tick() -> None:
            tell(f"{title}: about {duration(expected_s)} on two cores")
            while not over.wait(BEAT_S if console.is_terminal else EVERY_S):
                tell(f"{title}: {duration(monotonic() - start)} of about {duration(expected_s)}")

        thread = Thread(target=tick, daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()


class _Bar:
    """A bar of rich."""

    def __init__(self, progress: object, title: str, total: float, expected_s: float | None) -> None:
        from rich.progress import Progress

        assert isinstance(progress, Progress)
        self._progress, self._title, self._total, self._expected_s = progress, title, total, expected_s
        self._done, self._start = 0.0, monotonic()
        self._task = progress.add_task(title, total=total, left="")
        self._show()

    def begin(self, words: str) -> None:
        self._progress.update(self._task, description=printable(f"{self._title}: {words}"))
        self._show()

    def advance(self, amount: float = 1.0) -> None:
        self._done += amount
        self._show()

    def _show(self) -> None:
        left_s = remaining_s(self._done, self._total, monotonic() - self._start, self._expected_s)
        words = "" if left_s is None else f"about {duration(left_s)} to go"
        self._progress.update(self._task, completed=self._done, left=words)
