"""`quadfringe decode`: image files of one shot to phase and shape."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import Bayer, Fringes3, JsonOption, PredeformedOption, say, write_figures

if TYPE_CHECKING:
    from quadfringe.config import BayerPattern, Response

__all__ = ["Bits", "Method", "Unwrapping", "decode"]

ImageOption = Annotated[Path | None, typer.Option(metavar="FILE", help="Image of this channel.")]


class Method(StrEnum):
    """The published way, or the best known one."""

    published = "published"
    best = "best"


class Unwrapping(StrEnum):
    """Infrared light as coaxial with the visible, or where the calibrated pair really puts it."""

    coaxial = "coaxial"
    pair = "pair"


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
    raw: Annotated[Path | None, typer.Option(metavar="FILE", help="Raw mosaic for all three, with --bayer.")] = None,
    bayer: Annotated[Bayer | None, typer.Option(help="Colours of the first 2 x 2 pixels of --raw.")] = None,
    response: Annotated[Path | None, typer.Option(metavar="FILE", help="Response of the channels, JSON.")] = None,
    linear: Annotated[
        bool, typer.Option("--linear", help="The light is linear; else its response is estimated from the shot.")
    ] = False,
    calibration: Annotated[Path | None, typer.Option(metavar="FILE", help="Calibration, JSON.")] = None,
    method: Annotated[Method | None, typer.Option(help="How to demodulate and unwrap.")] = None,
    unwrapping: Annotated[
        Unwrapping | None, typer.Option(help="Take both projectors as one, or where --calibration puts them.")
    ] = None,
    depth_range_mm: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="MM MM", help="Nearest and farthest depth that --unwrapping pair searches."),
    ] = None,
    predeformed_z_mm: PredeformedOption = None,
    bits: Annotated[Bits | None, typer.Option(help="Bits in use in 16-bit files.")] = None,
    channel_instants_us: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option(metavar="R G B IR", help="When each channel is seen, us from the instant of the result."),
    ] = None,
    json: JsonOption = None,
) -> None:
    """Decode the images of one shot to absolute phase, and to millimetres when calibrated."""
    from quadfringe.config import DecodeConfig, Fringes, checked
    from quadfringe.data import AnyShot, Calibration
    from quadfringe.data.shape import SUFFIXES
    from quadfringe.data.shot_files import read_bayer_shot, read_shot
    from quadfringe.decoding import Plan
    from quadfringe.decoding import decode as decode_shot
    from quadfringe.errors import InputError
    from quadfringe.files import require_suffix

    if require_suffix(out, SUFFIXES) != ".npz" and calibration is None:
        raise InputError(f"{out}: millimetres need --calibration FILE; without it write .npz")
    settings = {
        "method": None if method is None else method.value,
        "unwrapping": None if unwrapping is None else unwrapping.value,
        "depth_range_mm": depth_range_mm,
        "channel_instants_us": channel_instants_us,
    }
    plan = Plan(
        projector_width_px=projector_width,
        fringes=Fringes(numbers=fringes, predeformed_z_mm=predeformed_z_mm),
        calibration=None if calibration is None else Calibration.load(calibration),
        response=_response(response, linear),
        decode=checked(DecodeConfig, settings, "options"),
    )
    bits_in_use = None if bits is None else int(bits)
    files = {"red": red, "green": green, "blue": blue, "ir": ir, "rgb": rgb}
    if raw is None and bayer is None:
        shot: AnyShot = read_shot(files, bits_in_use)
    else:
        shot = read_bayer_shot(*_mosaic(raw, bayer, files), bits_in_use)
    shape = decode_shot(shot, plan)
    shape.save(out)
    figures = shape.figures()
    percent = figures["returned_percent"]
    say(f"{out}: {percent:.1f} % of {shape.phase_rad.size} pixels returned{_sureness(figures)}", json)
    if shape.config.get("response_of_shot"):
        exponents = {name: channel["exponent"] for name, channel in shape.config["response"].items()}
        listed = ", ".join(f"{name} {exponent:.2f}" for name, exponent in exponents.items())
        say(f"response estimated from the shot, exponents: {listed} (--linear leaves it as it is)", json)
        figures = {**figures, **{f"response_exponent_{name}": value for name, value in exponents.items()}}
    write_figures(figures, json)


def _response(file: Path | None, linear: bool) -> Response | None:
    """Give what the options say of the response; None leaves it to the shot."""
    from quadfringe.config import Response
    from quadfringe.data import ResponseCalibration
    from quadfringe.errors import InputError

    if file is not None and linear:
        raise InputError("--response and --linear contradict each other; give one of them")
    if file is not None:
        return ResponseCalibration.load(file)
    return Response() if linear else None


def _sureness(figures: Mapping[str, float]) -> str:
    """Tell how sure the pixels are, in words."""
    for unit in ("mm", "rad"):
        if (sigma := figures.get(f"uncertainty_median_{unit}")) is not None:
            wrong = figures.get("wrong_orders_at_most", 0.0)
            return f", uncertainty {sigma:.3g} {unit} (median), at most {wrong:.3g} wrong orders to be expected"
    return ""


def _mosaic(raw: Path | None, bayer: Bayer | None, files: Mapping[str, Path | None]) -> tuple[Path, BayerPattern, Path]:
    """Give the mosaic, its pattern and the infrared image; raise when one is missing or there is too much."""
    from quadfringe.errors import InputError

    ir = files["ir"]
    missing = [
        option for option, value in (("--raw FILE", raw), ("--bayer NAME", bayer), ("--ir FILE", ir)) if not value
    ]
    if raw is None or bayer is None or ir is None:
        raise InputError(f"a raw mosaic needs --raw, --bayer and --ir: add {' and '.join(missing)}")
    if more := [name for name, path in files.items() if path is not None and name != "ir"]:
        raise InputError(f"--raw already holds red, green and blue; leave out --{' --'.join(more)}")
    return raw, bayer.value, ir
