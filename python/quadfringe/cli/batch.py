"""`quadfringe batch`: all shots of many recordings, on all cores or on a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import JsonOption, rows, say, steps, write_figures

if TYPE_CHECKING:
    from quadfringe.recording.batch import Outcome

__all__ = ["batch"]

SHOWN_ERRORS = 10


def batch(
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help="Recordings (.h5).")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for zarr and PLY; run again to go on.")],
    system: Annotated[Path | None, typer.Option(metavar="FILE", help="Settings in place of the recorded ones.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes of this machine; default: its cores.")] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Use this dask scheduler's workers.")] = None,
    ply: Annotated[bool, typer.Option(help="Write a PLY of every shot.")] = True,
    json: JsonOption = None,
) -> None:
    """Decode every shot of recordings into OUT/NAME.zarr and OUT/NAME/shot_000000.ply.

    Finished shots are not done again: a run that was stopped or killed goes on with the same command, and ends with the
    same files. Shots without a shape are listed in OUT/NAME/errors.json and make the exit status 1.
    """
    from quadfringe.config import load_system
    from quadfringe.errors import BatchError, InputError
    from quadfringe.recording import Recording
    from quadfringe.recording.batch import decode_recordings

    if workers is not None and scheduler is not None:
        raise InputError("--workers is for this machine, --scheduler for a cluster; give one of them")
    config = None if system is None else load_system(system)
    total = 0
    for path in recordings:
        with Recording(path) as take:
            total += len(take)
    outcomes: dict[tuple[str, int], Outcome] = {}
    work = decode_recordings(recordings, out, config, ply=ply, workers=workers, scheduler=scheduler)
    with steps(work, "decoding", total) as tracked:
        for outcome in tracked:
            outcomes[str(outcome.recording), outcome.shot] = outcome
    errors = [outcome for outcome in outcomes.values() if outcome.error is not None]
    figures = {"shots": total, "decoded": len(outcomes) - len(errors), "errors": len(errors)}
    figures["finished_before"] = total - len(outcomes)
    say(f"{out}: {figures['decoded']} shots decoded, {figures['finished_before']} finished before", json)
    write_figures(figures, json)
    if errors:
        listed = sorted((o.recording.name, o.shot, str(o.error)) for o in errors)[:SHOWN_ERRORS]
        rows("without a shape", ("recording", "shot", "why"), listed, json)
        raise BatchError(f"{len(errors)} of {total} shots have no shape; {out} lists them in errors.json")
