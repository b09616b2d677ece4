"""`quadfringe live`: the moving shape in a browser, and on disk when asked."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import SystemFile, say, stoppable
from quadfringe.cli.record import FileSize, ShotsOption

if TYPE_CHECKING:
    from quadfringe.recording import Recorder
    from quadfringe.scanner import Scanner
    from quadfringe.view.viewer import Viewer

__all__ = ["live"]


class Colour(StrEnum):
    """What the points are coloured by."""

    texture = "texture"
    height = "height"
    quality = "quality"


def live(
    system: SystemFile = None,
    record: Annotated[Path | None, typer.Option(metavar="FILE.h5", help="Record every raw shot as well.")] = None,
    host: Annotated[
        str, typer.Option(help="Address to serve; 0.0.0.0 shows the page to the whole network.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port of the page; the next free one if taken.")] = 8080,
    view_stride: Annotated[int, typer.Option(min=1, max=64, help="Every n-th pixel of every n-th row is shown.")] = 2,
    clouds_per_s: Annotated[
        float, typer.Option(min=0.1, max=100.0, help="Most clouds a second; with a graphics card 10 and more go.")
    ] = 4.0,
    colour: Annotated[Colour, typer.Option(help="Colour of the points at first.")] = Colour.texture,
    shots: ShotsOption = None,
    file_gb: FileSize = None,
) -> None:
    """Measure without pause and show the shape, the channels and the figures in a browser, until Ctrl-C or --shots.

    Nobody but this machine sees the page unless --host says so; there is no password.
    """
    from contextlib import ExitStack

    from quadfringe.recording import Recorder
    from quadfringe.scanner import open_system
    from quadfringe.view.viewer import Viewer

    with ExitStack() as stack:
        scanner = stack.enter_context(open_system(system))
        recorder = None
        if record is not None:
            recorder = stack.enter_context(Recorder(record, scanner.config, scanner.calibration, file_gb=file_gb))
        viewer = stack.enter_context(
            Viewer(host, port, stride=view_stride, clouds_per_s=clouds_per_s, colouring=colour.value)
        )
        say(f"live at {viewer.url}; Ctrl-C ends")
        with stoppable():
            _follow(scanner, viewer, recorder, shots)
            if shots is None:
                say("the camera gives no more shots; the last shape stays until Ctrl-C")
                _sleep()
    if recorder is not None:
        done = recorder.statistics()
        say(f"{record}: {done.written} shots recorded, {done.refused} not")


def _follow(scanner: Scanner, viewer: Viewer, recorder: Recorder | None, shots: int | None) -> None:
    columns = scanner.projector_width_px
    taps = {} if recorder is None else {"record": recorder.write}
    with scanner.stream(shots, taps=taps, resume=True) as stream:
        viewer.follow(stream, recorder.statistics if recorder else None, columns)


def _sleep() -> None:
    from threading import Event

    Event().wait()
