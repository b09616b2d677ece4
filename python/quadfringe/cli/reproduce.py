"""`quadfringe reproduce`: a published figure, computed again."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import JsonOption, say, table, write_figures

__all__ = ["reproduce"]


class Published(StrEnum):
    """What can be reproduced."""

    hand = "hand"
    peaks = "peaks"
    pair_deviation = "pair-deviation"
    pair_tolerance = "pair-tolerance"
    pair_calibration = "pair-calibration"
    pair_correction = "pair-correction"
    pair_depth = "pair-depth"


def reproduce(
    name: Annotated[Published, typer.Argument(help="Which published result.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the figure.")] = Path("out/reproduce"),
    json: JsonOption = None,
) -> None:
    """Compute a published result again: its figure as PNG, its numbers as JSON."""
    from quadfringe.evaluation.reproduce import REPRODUCTIONS
    from quadfringe.files import folder_for

    figures, picture = REPRODUCTIONS[name.value](folder_for(out))
    table(f"reproduce {name.value}", figures, json)
    say(str(picture), json)
    write_figures(figures, json)
