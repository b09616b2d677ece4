"""`quadfringe target`: a calibration board for the printer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._output import say

if TYPE_CHECKING:
    from quadfringe.calibration.targets import Target

__all__ = ["target"]


class Kind(StrEnum):
    """Kinds of calibration board."""

    rings = "rings"
    circles = "circles"
    asymmetric = "asymmetric"
    charuco = "charuco"


class Page(StrEnum):
    """Paper sizes in landscape orientation; fit is a page of the size of the board."""

    fit = "fit"
    a4 = "a4"
    a3 = "a3"
    a2 = "a2"
    letter = "letter"


KindArgument = Annotated[
    Kind, typer.Argument(help="Rings as in the paper, discs, discs with every second row offset, or ChArUco.")
]
OutOption = Annotated[
    Path,
    typer.Option(metavar="FILE", help="Board file, .pdf, .svg or .png; a .json file that describes it is written too."),
]
RowsOption = Annotated[int | None, typer.Option(help="Rows of rings, discs or squares; default: 9 (asymmetric: 11).")]
ColumnsOption = Annotated[
    int | None, typer.Option(help="Columns of rings, discs or squares; default: 12 (asymmetric: 6).")
]
PitchOption = Annotated[
    float | None,
    typer.Option(help="Distance of neighbours in a row, or side of a square, mm; default: 20 (asymmetric: 32)."),
]
DiameterOption = Annotated[
    float | None,
    typer.Option(help="Diameter of rings or discs, mm; default: 0.6 (rings), 0.5 or 0.36 (asymmetric) of the pitch."),
]
HoleOption = Annotated[
    float | None, typer.Option(help="Diameter of the hole in a ring, mm; default: half the ring diameter.")
]
MarkerOption = Annotated[float | None, typer.Option(help="Side of a ChArUco marker, mm; default: 0.75 of a square.")]
MarksOption = Annotated[
    bool, typer.Option(help="Print two dots that show the orientation of the board and whether it is mirrored.")
]
PageOption = Annotated[Page, typer.Option(help="Paper size, landscape.")]
DpiOption = Annotated[int, typer.Option(min=72, max=2400, help="Resolution of a PNG, dots per inch.")]


def target(
    kind: KindArgument,
    out: OutOption,
    rows: RowsOption = None,
    columns: ColumnsOption = None,
    pitch: PitchOption = None,
    diameter: DiameterOption = None,
    hole: HoleOption = None,
    marker: MarkerOption = None,
    marks: MarksOption = True,
    page: PageOption = Page.a4,
    dpi: DpiOption = 600,
) -> None:
    """Draw a calibration board to scale. Print it at 100 %, glue it to a flat plate, measure its bar and pitch."""
    from quadfringe.calibration.printing import write_target
    from quadfringe.files import atomic, require_suffix

    suffix = require_suffix(out, (".pdf", ".svg", ".png"))
    given = {"rows": rows, "columns": columns, "pitch_mm": pitch, "diameter_mm": diameter, "hole_mm": hole}
    given |= {"marker_mm": marker, "marks": None if marks else False}
    board = _board(kind, {name: value for name, value in given.items() if value is not None})
    size = write_target(out, board, page.value, dpi)
    described = out.with_suffix(".json")
    with atomic(described) as temporary:
        temporary.write_text(board.model_dump_json(indent=2, exclude_none=True) + "\n")
    across, down = board.size_mm
    paper = f"{size.width_mm:g} x {size.height_mm:g} mm"
    say(f"{out}: board {across:g} x {down:g} mm on {paper}; {described} describes it")
    if suffix != ".png":
        say("print at 100 %, not fitted to the page; then measure the bar and the distance of the outer points")


@dataclass(frozen=True)
class _Maker:
    """How to make a kind of board, and the settings that this kind does not have."""

    make: Callable[..., Target]
    without: frozenset[str]


def _board(kind: Kind, given: Mapping[str, Any]) -> Target:
    """Make the board; raise `InputError` for a setting that this kind does not have."""
    from quadfringe.calibration import targets
    from quadfringe.errors import InputError

    maker = {
        Kind.rings: _Maker(targets.ring_board, frozenset({"marker_mm"})),
        Kind.circles: _Maker(targets.circle_grid, frozenset({"marker_mm", "hole_mm"})),
        Kind.asymmetric: _Maker(targets.asymmetric_grid, frozenset({"marker_mm", "hole_mm"})),
        Kind.charuco: _Maker(targets.charuco_board, frozenset({"diameter_mm", "hole_mm", "marks"})),
    }[kind]
    for name in sorted(maker.without & set(given)):
        raise InputError(f"--{name.removesuffix('_mm')}: a {kind} board has none; leave it out")
    return maker.make(**given)
