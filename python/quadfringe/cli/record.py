"""`quadfringe record` and `quadfringe recover`: write raw shots to disk, and rescue them after a crash."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._options import (
    EncodingOption,
    FileSizeOption,
    FringesOption,
    JsonOption,
    ShotsOption,
    SystemFile,
)
from quadfringe.cli._output import caution, complain, progress, say, stop_requested, write_figures
from quadfringe.cli._system import CameraOption, system_of

if TYPE_CHECKING:
    from threading import Event

    from quadfringe.data import AnyShot
    from quadfringe.recording import Recorder, RecorderStatistics
    from quadfringe.scanner import Scanner

__all__ = ["record", "recover", "require_all_recorded"]

SLOW = "the disk is slower than the camera; use a faster disk, a smaller image or a lower frame rate"
WATCH_S = 0.05  # how often a recording looks whether it shall end while no shot comes
CALM_S = 2.0  # so long no shot must be lost until recording counts as complete again

SecondsOption = Annotated[float | None, typer.Option(min=0, help="Stop after this many seconds; default: no limit.")]


def record(
    out: Annotated[
        Path, typer.Option(metavar="FILE.h5", help="Recording to create; an existing file is never overwritten.")
    ],
    system: SystemFile = None,
    camera: CameraOption = None,
    encoding: EncodingOption = None,
    fringes: FringesOption = None,
    shots: ShotsOption = None,
    seconds: SecondsOption = None,
    file_gb: FileSizeOption = None,
    json: JsonOption = None,
) -> None:
    """Record raw shots with their time stamps, settings and calibration until Ctrl-C, SIGTERM, --shots or --seconds.

    Nothing is decoded. Every shot on file stays readable after a crash and when the disk is full. While the disk is
    slower than the camera, up to 64 shots wait in memory; then shots are lost, counted, and make the exit status 1.
    """
    from quadfringe.recording import Recorder
    from quadfringe.scanner import open_system

    with (
        open_system(system_of(system, camera, encoding, fringes)) as scanner,
        Recorder(out, scanner.config, scanner.calibration, file_gb=file_gb) as recorder,
        stop_requested() as stop,
        progress(_shots(scanner, shots, seconds, stop), "recording", shots) as taken,
    ):
        _write_all(taken, recorder, lambda: scanner.camera.statistics().dropped)
        dropped = scanner.camera.statistics().dropped
    done = recorder.statistics()
    files = ", ".join(str(path) for path in done.files) or "nothing"
    say(f"{files}: {done.written} shots, {done.image_bytes / 1e6:.0f} MB; the camera dropped {dropped}", json)
    write_figures({"written": done.written, "refused": done.refused, "dropped": dropped}, json)
    require_all_recorded(done, dropped)


def require_all_recorded(done: RecorderStatistics, dropped: int) -> None:
    """Raise `RecordingError` when the disk refused shots, or some were dropped because it was slow."""
    from quadfringe.errors import RecordingError

    reasons = []
    if done.refused:
        fault = done.fault or "the disk was full for a while"
        reasons.append(f"{done.refused} shots were not recorded: {fault}; free disk space")
    if dropped:
        reasons.append(f"{dropped} shots were not recorded: {SLOW}")
    if reasons:
        raise RecordingError("; ".join(reasons))


def _write_all(shots: Iterable[AnyShot], recorder: Recorder, dropped: Callable[[], int]) -> None:
    """Write shots; print when the disk starts to refuse or lose them, and when recording resumes."""
    fault, slow = None, _SlowDisk()
    for shot in shots:
        recorder.write(shot)
        now = recorder.statistics().fault
        if (now is None) != (fault is None):
            complain(now) if now else say("recording resumes in a new file")
        fault = now
        slow.see(dropped())


class _SlowDisk:
    """Prints when shots begin to be lost, and when none was lost for `CALM_S`."""

    def __init__(self) -> None:
        self._dropped, self._since_s = 0, float("-inf")
        self._losing = False

    def see(self, dropped: int) -> None:
        """Take the number of shots that were lost so far."""
        if dropped > self._dropped:
            self._dropped, self._since_s = dropped, monotonic()
            if not self._losing:
                complain(f"shots are lost: {SLOW}")
            self._losing = True
        elif self._losing and monotonic() - self._since_s > CALM_S:
            self._losing = False
            caution(f"every shot is recorded again; {dropped} were lost so far")


def _shots(scanner: Scanner, shots: int | None, seconds: float | None, stop: Event) -> Iterator[AnyShot]:
    """Yield shots of the camera until a limit is reached or a stop is requested, also while none comes."""
    from contextlib import closing
    from threading import Event, Thread

    ended = Event()

    def interrupt() -> None:
        while not (stop.wait(WATCH_S) or ended.is_set() or (end_s is not None and monotonic() >= end_s)):
            pass
        while not ended.wait(WATCH_S):
            scanner.camera.interrupt()

    scanner.projector.show(scanner.config.fringes)
    end_s = None if seconds is None else monotonic() + seconds
    watch = Thread(target=interrupt, name="record", daemon=True)
    with closing(scanner.camera.stream(shots, keep="all")) as stream:  # type: ignore[type-var]
        watch.start()
        try:
            for shot in stream:
                yield shot
                if stop.is_set() or (end_s is not None and monotonic() >= end_s):
                    return
        finally:
            ended.set()
            watch.join()


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
