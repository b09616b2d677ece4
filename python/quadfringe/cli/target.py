"""`quadfringe target`: a calibration board for the printer."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

__all__ = ["target"]


class Kind(StrEnum):
    """Boards."""

    rings = "rings"
    circles = "circles"
    asymmetric = "asymmetric"
    charuco = "charuco"


class Page(StrEnum):
    """Sizes of paper, lying."""

    fit = "fit"
    a4 = "a4"
    a3 = "a3"
    a2 = "a2"
    letter = "letter"


def target(
    kind: Annotated[Kind, typer.Argument(help="Rings as published, discs, discs in offset rows, or ChArUco.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The board, .pdf, .svg or .png; .json describes it.")],
    rows: Annotated[int | None, typer.Option(help="Rows of points, or of squares.")] = None,
    columns: Annotated[int | None, typer.Option(help="Columns of points, or of squares.")] = None,
    pitch: Annotated[
        float | None, typer.Option(help="Distance of neighbours in a row, or side of a square, mm.")
    ] = None,
    diameter: Annotated[float | None, typer.Option(help="Diameter of rings or discs, mm.")] = None,
    hole: Annotated[float | None, typer.Option(help="Diameter of the hole of a ring, mm.")] = None,
    marker: Annotated[float | None, typer.Option(help="Side of a ChArUco marker, mm.")] = None,
    marks: Annotated[bool, typer.Option(help="Two dots that tell how the board is turned, or mirrored.")] = True,
    page: Annotated[Page, typer.Option(help="Paper to print on.")] = Page.a4,
    dpi: Annotated[int, typer.Option(min=72, max=2400, help="Resolution of a PNG.")] = 600,
) -> None:
    """Draw a calibration board to scale. Print it at 100 %, glue it to something flat, measure its bar and pitch."""
    from quadfringe.calibration import targets
    from quadfringe.calibration.printing import write_target
    from quadfringe.errors import InputError
    from quadfringe.files import atomic, require_suffix

    suffix = require_suffix(out, (".pdf", ".svg", ".png"))
    given = {"rows": rows, "columns": columns, "pitch_mm": pitch, "diameter_mm": diameter, "hole_mm": hole}
    given |= {"marker_mm": marker, "marks": None if marks else False}
    takes: dict[Kind, tuple[Callable[..., targets.Target], set[str]]] = {
        Kind.rings: (targets.ring_board, {"marker_mm"}),
        Kind.circles: (targets.circle_grid, {"marker_mm", "hole_mm"}),
        Kind.asymmetric: (targets.asymmetric_grid, {"marker_mm", "hole_mm"}),
        Kind.charuco: (targets.charuco_board, {"diameter_mm", "hole_mm", "marks"}),
    }
    make, foreign = takes[kind]
    chosen = {name: value for name, value in given.items() if value is not None}
    for name in foreign & set(chosen):
        raise InputError(f"--{name.removesuffix('_mm')}: a board of {kind} has none")
    board = make(**chosen)
    width, height = write_target(out, board, page.value, dpi)
    described = out.with_suffix(".json")
    with atomic(described) as temporary:
        temporary.write_text(board.model_dump_json(indent=2, exclude_none=True) + "\n")
    across, down = board.size_mm
    typer.echo(f"{out}: board {across:g} x {down:g} mm on {width:g} x {height:g} mm; {described} describes it")
    if suffix != ".png":
        typer.echo("print at 100 % (no fitting to the page), then measure the bar and the distance of the outer points")
