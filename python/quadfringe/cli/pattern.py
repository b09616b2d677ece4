"""`quadfringe pattern`: the images that the projectors show."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import Fringes3, OutFolder, PredeformedOption, say

__all__ = ["pattern"]


class Layout(StrEnum):
    """How the mirrors of the projector are arranged."""

    regular = "regular"
    diamond = "diamond"


def pattern(
    out: OutFolder,
    fringes: Fringes3 = (36.0, 35.0, 30.0),
    width: Annotated[int, typer.Option(min=2, help="Columns of the projector.")] = 912,
    height: Annotated[int, typer.Option(min=1, help="Rows of the projector.")] = 1140,
    layout: Annotated[Layout, typer.Option(help="Mirror layout.")] = Layout.regular,
    calibration: Annotated[Path | None, typer.Option(metavar="FILE", help="Both projectors calibrated, JSON.")] = None,
    predeformed_z_mm: PredeformedOption = None,
) -> None:
    """Write the two images to project: visible.png (red, green, blue) and infrared.png, 8 bit.

    With --calibration and --predeformed-z-mm the infrared image makes up for an infrared projector that does not stand
    where the visible one does: exact on the plane at that depth.
    """
    from quadfringe.config import Fringes
    from quadfringe.data import Calibration
    from quadfringe.devices.light import predeformation
    from quadfringe.devices.pattern_files import write_patterns
    from quadfringe.errors import InputError

    if calibration is not None and predeformed_z_mm is None:
        raise InputError("--calibration changes nothing without --predeformed-z-mm, the depth of the reference plane")
    known = None if calibration is None else Calibration.load(calibration)
    asked = Fringes(numbers=fringes, layout=layout.value, predeformed_z_mm=predeformed_z_mm)
    for path in write_patterns(out, asked.numbers, (width, height), layout.value, predeformation(asked, known)):
        say(str(path))
