"""`quadfringe record` and `quadfringe recover`: write raw shots to disk, and rescue them after a crash."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._options import FileSizeOption, JsonOption, ShotsOption, SystemFile
from quadfringe.cli._output import complain, progress, say, stop_requested, write_figures

if TYPE_CHECKING:
    from threading import Event

    from quadfringe.data import AnyShot
    from quadfringe.recording import Recorder
    from quadfringe.scanner import Scanner

__all__ = ["record", "recover"]

SecondsOption = Annotated[float | None, typer.Option(min=0, help="Stop after this many seconds; default: no limit.")]


def record(
    out: Annotated[
        Path, typer.Option(metavar="FILE.h5", help="Recording to create; an existing file is never overwritten.")
    ],
    system: SystemFile = None,
    shots: ShotsOption = None,
    seconds: SecondsOption = None,
    file_gb: FileSizeOption = None,
    json: JsonOption = None,
) -> None:
    """Record raw shots with their time stamps, settings and calibration until Ctrl-C, SIGTERM, --shots or --seconds.

    Nothing is decoded. Every shot on file stays readable after a crash and when the disk is full.
    """
    from quadfringe.errors import RecordingError
    from quadfringe.recording import Recorder
    from quadfringe.scanner import open_system

    with (
        open_system(system) as scanner,
        Recorder(out, scanner.config, scanner.calibration, file_gb=file_gb) as recorder,
        stop_requested() as stop,
        progress(_shots(scanner, shots, seconds, stop), "recording", shots) as taken,
    ):
        _write_all(taken, recorder)
        camera = scanner.camera.statistics()
    done = recorder.statistics()
    files = ", ".join(str(path) for path in done.files) or "nothing"
    say(f"{files}: {done.written} shots, {done.image_bytes / 1e6:.0f} MB; the camera dropped {camera.dropped}", json)
    write_figures({"written": done.written, "refused": done.refused, "dropped": camera.dropped}, json)
    if done.refused:
        raise RecordingError(
            f"{done.refused} shots were not recorded: {done.fault or 'the disk was full for a while'}; free disk space"
        )


def _write_all(shots: Iterable[AnyShot], recorder: Recorder) -> None:
    """Write shots; print when the disk starts to refuse them, and when recording resumes."""
    fault = None
    for shot in shots:
        recorder.write(shot)
        now = recorder.statistics().fault
        if (now is None) != (fault is None):
            complain(now) if now else say("recording resumes in a new file")
        fault = now


def _shots(scanner: Scanner, shots: int | None, seconds: float | None, stop: Event) -> Iterator[AnyShot]:
    """Yield shots of the camera until a limit is reached or a stop is requested."""
    from contextlib import closing
    from time import monotonic

    scanner.projector.show(scanner.config.fringes)
    end_s = None if seconds is None else monotonic() + seconds
    with closing(scanner.camera.stream(shots, keep="all")) as stream:  # type: ignore[type-var]
        for shot in stream:
            yield shot
            if stop.is_set() or (end_s is not None and monotonic() >= end_s):
                return


def recover(
    file: Annotated[Path, typer.Argument(help="Recording whose writer was killed, or which is damaged.")],
    out: Annotated[
        Path,
        typer.Option(
            metavar="FILE.h5", help="New recording for the whole shots; an existing file is never overwritten."
        ),
    ],
    json: JsonOption = None,
) -> None:
    """Copy every whole shot of a damaged recording into a new one, which any HDF5 program opens.

    The damaged file is only read. Settings or a calibration that were changed are left out.
    """
    from quadfringe.recording import recover as recover_file
    from quadfringe.recording.reader import listed

    found = recover_file(file, out)
    damaged = f", {len(found.damaged)} damaged shots left out ({listed(found.damaged)})" if found.damaged else ""
    say(f"{out}: {found.shots} shots{damaged}", json)
    write_figures({"shots": found.shots, "damaged": len(found.damaged)}, json)
