"""`quadfringe batch`: decode every shot of many recordings, on all cores or on a cluster."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._options import JsonOption
from quadfringe.cli._output import progress, rows, say, write_figures

if TYPE_CHECKING:
    from quadfringe.recording.batch import Outcome

__all__ = ["batch"]

SHOWN_ERRORS = 10


RecordingsArgument = Annotated[list[Path], typer.Argument(metavar="RECORDING...", help="Recordings, .h5.")]
OutOption = Annotated[Path, typer.Option(metavar="DIR", help="Folder for zarr stores and PLY files.")]
SettingsOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="System file whose settings replace the recorded ones, .toml.")
]
WorkersOption = Annotated[
    int | None, typer.Option(min=1, help="Number of processes on this machine; default: one per core.")
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Address of a dask scheduler, such as tcp://host:8786, for a cluster."),
]
PlyOption = Annotated[bool, typer.Option(help="Write a PLY file of every shot as well.")]


def batch(
    recordings: RecordingsArgument,
    out: OutOption,
    system: SettingsOption = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    ply: PlyOption = True,
    json: JsonOption = None,
) -> None:
    """Decode every shot of recordings into OUT/NAME.zarr and OUT/NAME/shot_000000.ply.

    The same command continues a run that was stopped or killed: it skips finished shots and ends with the same files.
    OUT/NAME/errors.json lists the shots without a shape; any such shot makes the exit status 1.
    """
    from quadfringe.config import load_system
    from quadfringe.errors import BatchError, InputError
    from quadfringe.recording import Recording
    from quadfringe.recording.batch import decode_recordings

    if workers is not None and scheduler is not None:
        raise InputError("--workers is for this machine and --scheduler for a cluster; give one of them")
    config = None if system is None else load_system(system)
    total = 0
    for path in recordings:
        with Recording(path) as recording:
            total += len(recording)
    outcomes: dict[tuple[str, int], Outcome] = {}
    work = decode_recordings(recordings, out, config, ply=ply, workers=workers, scheduler=scheduler)
    with progress(work, "decoding", total) as tracked:
        for outcome in tracked:
            outcomes[str(outcome.recording), outcome.shot] = outcome
    errors = [outcome for outcome in outcomes.values() if outcome.error is not None]
    figures = {"shots": total, "decoded": len(outcomes) - len(errors), "errors": len(errors)}
    figures["finished_before"] = total - len(outcomes)
    say(f"{out}: {figures['decoded']} shots decoded, {figures['finished_before']} were already finished", json)
    write_figures(figures, json)
    if errors:
        listed = sorted((o.recording.name, o.shot, str(o.error)) for o in errors)[:SHOWN_ERRORS]
        rows("shots without a shape", ("recording", "shot", "reason"), listed, json)
        raise BatchError(f"{len(errors)} of {total} shots have no shape; errors.json below {out} lists them")
