"""`quadfringe record` and `recover`: raw shots on disk, and what a crash left of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import JsonOption, SystemFile, complain, say, steps, stop_asked, write_figures

if TYPE_CHECKING:
    from threading import Event

    from quadfringe.data import AnyShot
    from quadfringe.recording import Recorder
    from quadfringe.scanner import Scanner

__all__ = ["record", "recover"]

ShotsOption = Annotated[int | None, typer.Option(min=1, help="End after so many shots.")]
SecondsOption = Annotated[float | None, typer.Option(min=0, help="End after so many seconds.")]
FileSize = Annotated[float | None, typer.Option(min=0.01, help="Begin a new file at this size, GB.")]


def record(
    out: Annotated[Path, typer.Option(metavar="FILE.h5", help="The recording; never overwritten.")],
    system: SystemFile = None,
    shots: ShotsOption = None,
    seconds: SecondsOption = None,
    file_gb: FileSize = None,
    json: JsonOption = None,
) -> None:
    """Record raw shots with stamps, settings and calibration, until Ctrl-C, SIGTERM, --shots or --seconds.

    Nothing is decoded. Every shot that was written can be read after a crash or on a full disk.
    """
    from quadfringe.errors import RecordingError
    from quadfringe.recording import Recorder
    from quadfringe.scanner import open_system

    with (
        open_system(system) as scanner,
        Recorder(out, scanner.config, scanner.calibration, file_gb=file_gb) as recorder,
        stop_asked() as asked,
        steps(_shots(scanner, shots, seconds, asked), "recording", shots) as taken,
    ):
        _write_all(taken, recorder)
        camera = scanner.camera.statistics()
    done = recorder.statistics()
    files = ", ".join(str(path) for path in done.files) or "nothing"
    say(f"{files}: {done.written} shots, {done.image_bytes / 1e6:.0f} MB; the camera dropped {camera.dropped}", json)
    write_figures({"written": done.written, "refused": done.refused, "dropped": camera.dropped}, json)
    if done.refused:
        raise RecordingError(f"{done.refused} shots were not recorded: {done.fault or 'the disk was full for a while'}")


def _write_all(shots: Iterable[AnyShot], recorder: Recorder) -> None:
    """Write shots, and say at once when the disk refuses them and when it takes them again."""
    fault = None
    for shot in shots:
        recorder.write(shot)
        now = recorder.statistics().fault
        if (now is None) != (fault is None):
            complain(now) if now else say("recording goes on in a new file")
        fault = now


def _shots(scanner: Scanner, shots: int | None, seconds: float | None, asked: Event) -> Iterator[AnyShot]:
    """Give shots of the camera until one of the limits, or until the end is asked for."""
    from contextlib import closing
    from time import monotonic

    scanner.projector.show(scanner.config.fringes)
    end_s = None if seconds is None else monotonic() + seconds
    with closing(scanner.camera.stream(shots, keep="all")) as stream:  # type: ignore[type-var]
        for shot in stream:
            yield shot
            if asked.is_set() or (end_s is not None and monotonic() >= end_s):
                return


def recover(
    file: Annotated[Path, typer.Argument(help="A recording whose writer was killed, or that was damaged.")],
    out: Annotated[Path, typer.Option(metavar="FILE.h5", help="Where the whole recording goes.")],
    json: JsonOption = None,
) -> None:
    """Copy every whole shot of a recording into a new one that any HDF5 program opens; the old file is only read."""
    from quadfringe.recording import recover as recover_file

    found = recover_file(file, out)
    damaged = f", {len(found.damaged)} damaged ones left behind" if found.damaged else ""
    say(f"{out}: {found.shots} shots{damaged}", json)
    write_figures({"shots": found.shots, "damaged": len(found.damaged)}, json)
