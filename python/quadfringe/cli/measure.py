"""`quadfringe measure`: one shot or one reference measurement of a system, decoded and saved."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._options import EncodingOption, FringesOption, SystemFile
from quadfringe.cli._output import say
from quadfringe.cli._steps import Beam, BeamOption
from quadfringe.cli._system import CameraOption, system_of

__all__ = ["measure"]


def measure(
    out: Annotated[
        list[Path],
        typer.Option(
            metavar="FILE", help="Result file: .npz, .ply, .pcd, .stl, .obj, .glb, .e57 or .tif; may be repeated."
        ),
    ],
    system: SystemFile = None,
    camera: CameraOption = None,
    encoding: EncodingOption = None,
    fringes: FringesOption = None,
    reference: Annotated[
        bool,
        typer.Option(
            "--reference",
            help="Show and take phase steps of every fringe number in place of one shot; the object must keep still.",
        ),
    ] = False,
    steps: Annotated[
        int | None, typer.Option(min=3, help="Phase steps of each fringe number with --reference; default: 12.")
    ] = None,
    beam: BeamOption = None,
) -> None:
    """Take one shot, or a --reference, with a system, decode it and save the shape."""
    from quadfringe.data.shape import SUFFIXES
    from quadfringe.errors import InputError
    from quadfringe.files import require_suffix
    from quadfringe.scanner import open_system

    for path in out:
        require_suffix(path, SUFFIXES)
    if not reference and (steps is not None or beam is not None):
        raise InputError("--steps and --beam belong to --reference; give it too")
    given = {} if steps is None else {"steps": steps}
    with open_system(system_of(system, camera, encoding, fringes)) as scanner:
        shape = scanner.measure(reference=reference, infrared=beam is Beam.infrared, **given)
    for path in out:
        shape.save(path)
        say(f"{path}: {int(shape.returned.sum())} points")
