"""`quadfringe compare`: two shapes of one camera, or a shape and a mesh, and why they differ."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._options import JsonOption
from quadfringe.cli._output import caution, say, table, write_record

if TYPE_CHECKING:
    from quadfringe.decoding.compare import MeshComparison, ShapeComparison

__all__ = ["compare"]

FirstArgument = Annotated[Path, typer.Argument(metavar="A", help="The shape that is judged, .npz.")]
SecondArgument = Annotated[
    Path,
    typer.Argument(
        metavar="B", help="What it is compared with: a shape, .npz, or a mesh: .stl .ply .obj in mm, .glb in metres."
    ),
]
AlignOption = Annotated[bool, typer.Option("--align", help="Move A onto the surface of B first, by a rigid motion.")]
CausesOption = Annotated[
    bool, typer.Option("--causes/--no-causes", help="Name the causes of the difference; takes seconds.")
]
FolderOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Write difference.npz (map and slow part) and comparison.png (extra plot) here."),
]


def compare(
    a: FirstArgument,
    b: SecondArgument,
    align: AlignOption = False,
    causes: CausesOption = True,
    json: JsonOption = None,
    out: FolderOption = None,
) -> None:
    """Compare two shapes of one camera pixel by pixel, or a shape with a mesh, and say why they differ.

    Differences are A less B, positive where A is farther from the camera; distances from a mesh are positive towards
    the camera.
    """
    from quadfringe.decoding.compare import compare as compared

    found = compared(a, b, align=align, causes=causes)
    for words in found.warnings:
        caution(words)
    figures = {name: value for name, value in found.figures().items() if value == value}
    table(f"{a.name} compared with {b.name}", figures, json)
    for cause in found.causes:
        say(f"{cause.name}, {cause.share:.0%} of the mean square: {cause.evidence}", json)
    if causes and not found.causes:
        say("no cause stands out", json)
    if out is not None:
        _write(out, f"{a.name} compared with {b.name}", found, json)
    write_record(_record(figures, found), json)


def _record(figures: dict[str, float], found: ShapeComparison | MeshComparison) -> dict[str, Any]:
    from quadfringe.decoding.compare import MeshComparison

    named = [vars(cause) for cause in found.causes]
    record = {"figures": figures, "causes": named, "warnings": list(found.warnings)}
    return record | ({"transform": found.transform.tolist()} if isinstance(found, MeshComparison) else {})


def _write(out: Path, title: str, found: ShapeComparison | MeshComparison, json: Path | None) -> None:
    """Write the map and the page into a folder, which is made."""
    import numpy as np

    from quadfringe.files import folder_for
    from quadfringe.io.export import write_npz
    from quadfringe.view.comparison import write_comparison

    folder = folder_for(out)
    unit = found.overall.unit
    maps = {f"difference_{unit}": found.difference, f"form_{unit}": found.bands.form.astype(np.float32)}
    write_npz(folder / "difference.npz", maps, {})
    write_comparison(folder / "comparison.png", title, found)
    for name in ("difference.npz", "comparison.png"):
        say(str(folder / name), json)
