"""`quadfringe reproduce`: compute a published result again."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._options import JsonOption
from quadfringe.cli._output import say, table, write_figures

__all__ = ["reproduce"]


class Published(StrEnum):
    """Results of the paper, and of the projector pair, that can be reproduced."""

    hand = "hand"
    peaks = "peaks"
    pair_deviation = "pair-deviation"
    pair_tolerance = "pair-tolerance"
    pair_calibration = "pair-calibration"
    pair_correction = "pair-correction"
    pair_depth = "pair-depth"


def reproduce(
    name: Annotated[Published, typer.Argument(help="The result to compute.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the picture.")] = Path("out/reproduce"),
    json: JsonOption = None,
) -> None:
    """Compute a published result again: write its figure as PNG (the hand: MP4) and print its numbers."""
    from quadfringe.evaluation.reproduce import REPRODUCTIONS
    from quadfringe.files import folder_for

    figures, picture = REPRODUCTIONS[name.value](folder_for(out))
    table(f"reproduce {name.value}", figures, json)
    say(str(picture), json)
    write_figures(figures, json)
