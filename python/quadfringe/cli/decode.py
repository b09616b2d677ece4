"""`quadfringe decode`: image files of one shot to phase and shape."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli.output import Fringes3, JsonOption, say, write_figures

__all__ = ["Bits", "Method", "decode"]

ImageOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Image of this channel.")]


class Method(StrEnum):
    """The published way, or the best known one."""

    published = "published"
    best = "best"


class Bits(StrEnum):
    """Bits in use in a 16-bit file."""

    ten = "10"
    twelve = "12"
    fourteen = "14"
    sixteen = "16"


def decode(
    fringes: Fringes3,
    projector_width: Annotated[int, typer.Option(min=2, help="Columns that the fringes cover.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Result: .npz, or .ply, .tif when calibrated.")],
    red: ImageOption = None,
    green: ImageOption = None,
    blue: ImageOption = None,
    ir: ImageOption = None,
    rgb: Annotated[Path | None, typer.Option(metavar="FILE", help="One colour image for all three.")] = None,
    response: Annotated[Path | None, typer.Option(metavar="FILE", help="Response of the channels, JSON.")] = None,
    calibration: Annotated[Path | None, typer.Option(metavar="FILE", help="Calibration, JSON.")] = None,
    method: Annotated[Method | None, typer.Option(help="How to demodulate and unwrap.")] = None,
    bits: Annotated[Bits | None, typer.Option(help="Bits in use in 16-bit files.")] = None,
    json: JsonOption = None,
) -> None:
    """Decode the four images of one shot to absolute phase, and to millimetres when calibrated."""
    from quadfringe.config import DecodeConfig, Fringes
    from quadfringe.data import SUFFIXES, Calibration, ResponseCalibration
    from quadfringe.decoding import Plan
    from quadfringe.decoding import decode as decode_shot
    from quadfringe.errors import InputError
    from quadfringe.files import require_suffix
    from quadfringe.shots import read_shot

    if require_suffix(out, SUFFIXES) != ".npz" and calibration is None:
        raise InputError(f"{out}: millimetres need --calibration FILE; without it write .npz")
    plan = Plan(
        projector_width_px=projector_width,
        fringes=Fringes(numbers=fringes),
        calibration=None if calibration is None else Calibration.load(calibration),
        response=None if response is None else ResponseCalibration.load(response),
        settings=DecodeConfig(method=None if method is None else method.value),
    )
    files = {"red": red, "green": green, "blue": blue, "ir": ir, "rgb": rgb}
    shape = decode_shot(read_shot(files, None if bits is None else int(bits)), plan)
    shape.save(out)
    percent = 100.0 * float(shape.returned.mean())
    say(f"{out}: {percent:.1f} % of {shape.phase_rad.size} pixels returned", json)
    write_figures({"returned_percent": percent}, json)
