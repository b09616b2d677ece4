"""`quadfringe view`: saved shapes in a browser, shaded, to look at and to measure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._options import AllowHostOption, Colouring, HostOption, PortOption
from quadfringe.cli._output import say, stoppable

__all__ = ["view"]

FilesArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILE...",
        help="Saved shapes, .npz; series that batch wrote, .zarr; points or meshes, .ply; meshes, .glb .obj .stl.",
    ),
]
ColourOption = Annotated[Colouring, typer.Option(help="Initial colouring.")]
PointsOption = Annotated[bool, typer.Option("--points", help="Show points in place of the shaded surface at first.")]


def view(
    files: FilesArgument,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    colour: ColourOption = Colouring.texture,
    points: PointsOption = False,
    allow_host: AllowHostOption = None,
) -> None:
    """Show saved shapes in a browser until Ctrl-C: a shaded surface, with a slider over the shots of a series.

    A click shows the coordinates of a point, a second one the distance, with its noise, and the section between.
    Only this machine can open the page, unless --host says otherwise; then its address contains a token.
    """
    from contextlib import ExitStack
    from threading import Event

    from quadfringe.view.saved import SavedViewer

    with ExitStack() as stack:
        stack.enter_context(stoppable())
        viewer = SavedViewer(
            files,
            host,
            port,
            colouring=colour.value,
            drawn="points" if points else "surface",
            allow_hosts=allow_host or (),
        )
        stack.enter_context(viewer)
        say(f"view at {viewer.url}; stop with Ctrl-C")
        Event().wait()
