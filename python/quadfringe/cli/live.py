"""`quadfringe live`: show the moving shape in a browser, and optionally record the shots."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._options import (
    AllowHostOption,
    ChannelsOfCode,
    Colouring,
    EncodingOption,
    FileSizeOption,
    FringesOption,
    HostOption,
    PortOption,
    ShotsOption,
    SomeNumbers,
    SystemFile,
)
from quadfringe.cli._output import caution, say, stoppable
from quadfringe.cli._system import CameraOption, system_of
from quadfringe.cli.record import require_all_recorded

if TYPE_CHECKING:
    from quadfringe.config import SystemConfig
    from quadfringe.recording import Recorder
    from quadfringe.scanner import Scanner
    from quadfringe.scanner.streaming import StreamStatistics
    from quadfringe.view.viewer import Viewer

__all__ = ["live"]


RecordOption = Annotated[
    Path | None, typer.Option(metavar="FILE.h5", help="Also record every raw shot into this new file.")
]
StrideOption = Annotated[
    int, typer.Option(min=1, max=64, help="Show every n-th pixel of every n-th row; raise it for a slow browser.")
]
CloudsOption = Annotated[
    float,
    typer.Option(min=0.1, max=100.0, help="Largest number of shapes per second; a graphics card manages 10."),
]
ColourOption = Annotated[Colouring, typer.Option(help="Initial colouring.")]
SurfaceOption = Annotated[
    bool, typer.Option("--surface/--points", help="Show a shaded surface, which takes a faster browser, or points.")
]


def live(
    system: SystemFile = None,
    camera: CameraOption = None,
    encoding: EncodingOption = None,
    fringes: FringesOption = None,
    record: RecordOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    view_stride: StrideOption = 2,
    clouds_per_s: CloudsOption = 4.0,
    colour: ColourOption = Colouring.texture,
    surface: SurfaceOption = True,
    shots: ShotsOption = None,
    file_gb: FileSizeOption = None,
    allow_host: AllowHostOption = None,
) -> None:
    """Measure continuously and show the shape, the channels and the figures in a browser, until Ctrl-C or --shots.

    Without a system and a camera, the virtual bench measures a moving hand, 512 x 384, by the published method.
    Only this machine can open the page, unless --host says otherwise; then its address contains a token. Shots that
    --record loses on a full or slow disk are counted, and make the exit status 1.
    """
    from contextlib import ExitStack

    from quadfringe.recording import Recorder
    from quadfringe.scanner import open_system
    from quadfringe.view.viewer import Viewer

    with ExitStack() as stack:
        # Before the scanner, so that a wrong address is reported before a camera is taken.
        shown: dict[str, Any] = {"stride": view_stride, "colouring": colour.value, "clouds_per_s": clouds_per_s}
        shown["drawn"] = "surface" if surface else "points"
        viewer = stack.enter_context(Viewer(host, port, allow_hosts=allow_host or (), **shown))
        scanner = stack.enter_context(open_system(_live_system_of(system, camera, encoding, fringes)))
        recorder = None
        if record is not None:
            recorder = stack.enter_context(Recorder(record, scanner.config, scanner.calibration, file_gb=file_gb))
        measured = _follow(scanner, viewer, recorder, shots)
    _report(viewer, recorder, measured)


def _live_system_of(
    system: Path | None, camera: str | None, encoding: ChannelsOfCode | None, numbers: SomeNumbers | None
) -> SystemConfig | None:
    """Give the settings of the options; without a system and a camera, those of the moving hand."""
    from quadfringe.evaluation.demo import live_system

    config = system_of(system, camera, encoding, numbers)
    if system is not None or camera is not None:
        return config
    return live_system() if config is None else live_system(config.fringes)


def _report(viewer: Viewer, recorder: Recorder | None, stream: StreamStatistics) -> None:
    if viewer.fault is not None:
        caution(viewer.fault)
    if recorder is not None:
        done = recorder.statistics()
        dropped = stream.camera.dropped + stream.queues["record"].dropped
        files = ", ".join(str(path) for path in done.files) or "nothing"
        say(f"{files}: {done.written} shots recorded, {done.refused} refused by the disk, {dropped} dropped")
        require_all_recorded(done, dropped)


def _follow(scanner: Scanner, viewer: Viewer, recorder: Recorder | None, shots: int | None) -> StreamStatistics:
    """Show and record until the shots or the user end it; return the counts."""
    from threading import Event

    taps = {} if recorder is None else {"record": recorder.write}
    stream = scanner.stream(shots, taps=taps, resume=True)
    with stoppable():
        with stream:
            say("live; stop with Ctrl-C; the page is at")
            say(viewer.url)
            viewer.follow(stream, recorder.statistics if recorder else None, scanner.projector_width_px)
        if shots is None:
            say("the camera delivers no more shots; the page keeps the last shape until Ctrl-C")
            Event().wait()
    return stream.statistics()
