"""`quadfringe convert`: a saved shape as a file for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import say

__all__ = ["convert"]


def convert(
    shape: Annotated[Path, typer.Argument(metavar="SHAPE.npz", help="Shape that decode or measure saved.")],
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="Result by suffix: .glb, .stl or .obj mesh, .ply, .pcd or .e57 points, .tif depth, .npz copy.",
        ),
    ],
    faces: Annotated[bool, typer.Option("--faces", help="Write a mesh to a .ply in place of points.")] = False,
    step: Annotated[
        int, typer.Option(metavar="N", help="Take every N-th pixel of every N-th row, for a smaller mesh.")
    ] = 1,
    fill_holes_px: Annotated[
        int, typer.Option("--fill-holes", metavar="PX", help="Fill holes of at most PX pixels in the mesh, up to 1000.")
    ] = 0,
) -> None:
    """Convert a saved shape to a mesh, points or a depth map. Lengths are mm, in .glb metres."""
    import numpy as np

    from quadfringe.data import Shape
    from quadfringe.data.shape import SUFFIXES
    from quadfringe.data.shape_files import check_choices
    from quadfringe.files import require_suffix

    check_choices(out, require_suffix(out, SUFFIXES), faces=faces, step=step, fill_holes_px=fill_holes_px)
    loaded = Shape.load(shape)
    loaded.save(out, faces=faces, step=step, fill_holes_px=fill_holes_px)
    depth_mm = loaded.depth_mm
    known = loaded.returned if depth_mm is None else np.isfinite(depth_mm)
    say(f"{out}: {out.stat().st_size / 1e6:.1f} MB, from {int(known.sum())} points")
