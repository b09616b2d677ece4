"""`quadfringe pattern`: the images that the projectors show."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._options import (
    ColumnRangeOption,
    EncodingOption,
    FringesOption,
    OutFolder,
    PredeformedOption,
    fringes_from,
)
from quadfringe.cli._output import say

__all__ = ["pattern"]


class Layout(StrEnum):
    """Arrangement of the projector mirrors: on a regular grid, or with odd rows shifted by half a column."""

    regular = "regular"
    diamond = "diamond"


def pattern(
    out: OutFolder,
    fringes: FringesOption = None,
    encoding: EncodingOption = None,
    columns: ColumnRangeOption = None,
    width: Annotated[int, typer.Option(min=2, help="Columns of the projector, px.")] = 912,
    height: Annotated[int, typer.Option(min=1, help="Rows of the projector, px.")] = 1140,
    layout: Annotated[
        Layout, typer.Option(help="Mirror layout of the projector; a LightCrafter 4500 is diamond.")
    ] = Layout.regular,
    calibration: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Calibration of both projectors, .json; needs --predeformed-z-mm."),
    ] = None,
    predeformed_z_mm: PredeformedOption = None,
) -> None:
    """Write the images to project: visible.png (red, green, blue), and infrared.png unless --encoding rgb; 8 bit.

    With --calibration and --predeformed-z-mm, the infrared image is pre-deformed for an infrared projector that is not
    aligned with the visible one. The correction is exact on the plane at that depth.
    """
    from quadfringe.data import Calibration
    from quadfringe.devices.light import predeformation
    from quadfringe.devices.pattern_files import write_patterns
    from quadfringe.errors import InputError

    if calibration is not None and predeformed_z_mm is None:
        raise InputError(
            "--calibration has no effect without --predeformed-z-mm, the depth of the reference plane; add it"
        )
    known = None if calibration is None else Calibration.load(calibration)
    others = {"layout": layout.value, "predeformed_z_mm": predeformed_z_mm}
    wanted = fringes_from(encoding, fringes, columns, **others)
    for path in write_patterns(out, wanted, (width, height), predeformation(wanted, known)):
        say(str(path))
