"""`quadfringe measure`: one shot of a system, decoded and saved."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._options import SystemFile
from quadfringe.cli._output import say

__all__ = ["measure"]


def measure(
    out: Annotated[
        list[Path],
        typer.Option(metavar="FILE", help="Result file: .npz, .ply, .pcd, .stl, .obj, .glb or .tif; may be repeated."),
    ],
    system: SystemFile = None,
) -> None:
    """Take one shot with a system, decode it and save the shape."""
    from quadfringe.data.shape import SUFFIXES
    from quadfringe.files import require_suffix
    from quadfringe.scanner import open_system

    for path in out:
        require_suffix(path, SUFFIXES)
    with open_system(system) as scanner:
        shape = scanner.measure()
    for path in out:
        shape.save(path)
        say(f"{path}: {int(shape.returned.sum())} points")
