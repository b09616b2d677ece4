"""`quadfringe decode`: the image files of one shot, or of a reference measurement, to absolute phase and shape."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._options import (
    METHODS,
    Bayer,
    Bits,
    BitsOption,
    CalibrationOption,
    ColumnRangeOption,
    ColumnsOption,
    EncodingOption,
    FringesOfShotOption,
    InstantsOption,
    JsonOption,
    PeriodOption,
    PredeformedOption,
    decode_settings,
    fringes_from,
    method_named,
    one_or_two,
)
from quadfringe.cli._output import caution, note, say, write_figures
from quadfringe.cli._results import response_told, uncertainty_told
from quadfringe.cli._steps import (
    BeamOption,
    NumbersOption,
    OrderOption,
    StepsOption,
    from_steps,
    step_words,
)

if TYPE_CHECKING:
    from quadfringe.config import BayerPattern
    from quadfringe.data import AnyShot, Shape
    from quadfringe.decoding import Plan

__all__ = ["Unwrapping", "decode"]


class Unwrapping(StrEnum):
    """How unwrapping treats the infrared projector: as coaxial with the visible one, or at its calibrated pose."""

    coaxial = "coaxial"
    pair = "pair"


ResultOption = Annotated[
    Path,
    typer.Option(metavar="FILE", help="Result: .npz, or with --calibration also .ply .pcd .stl .obj .glb .e57 .tif."),
]
SourcesArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[FOLDER | FILES...]",
        help="Folder with red.png, green.png, blue.png and ir.png (or rgb.png and ir.png; with --bayer raw.png and "
        "ir.png; with --encoding rgb no ir.png), in place of the options of single images. With --steps, the images of "
        "the steps or their folder, sorted by name.",
    ),
]
ImageOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Image of this channel: PNG, TIFF or BMP, 8 or 16 bit.")
]
RgbOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="One colour image in place of --red, --green and --blue.")
]
RawOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Raw Bayer mosaic in place of --red, --green and --blue; needs --bayer."),
]
BayerOption = Annotated[
    Bayer | None,
    typer.Option(help="Filter colours of the first 2 x 2 pixels of --raw, or of raw.png in FOLDER, row by row."),
]
ResponseOption = Annotated[
    str | None,
    typer.Option(
        metavar="auto|linear|FILE",
        help="Camera response to correct: auto (default) takes that of --calibration, else estimates it from the shot; "
        "linear corrects none; FILE is a .json of `calibrate response`.",
    ),
]
LinearOption = Annotated[bool, typer.Option("--linear", help="The same as --response linear.")]
MethodOption = Annotated[
    str | None,
    typer.Option(
        metavar=METHODS,
        parser=method_named,
        help="Decoding method; default: joint, the more accurate one. Use published to reproduce the paper.",
    ),
]
UnwrappingOption = Annotated[
    Unwrapping | None,
    typer.Option(
        help="Treat the projectors as coaxial (default), or search along the camera ray with both projectors where "
        "--calibration puts them (pair); use pair when they are not aligned.",
    ),
]
DepthRangeOption = Annotated[
    tuple[float, float] | None,
    typer.Option(
        metavar="MM MM", help="Nearest and farthest depth, mm; points outside are no data. Needs --calibration."
    ),
]
DetailOption = Annotated[
    float | None,
    typer.Option(
        metavar="FACTOR",
        help="Detail against noise, 0.25 to 4; default: 1, what the shot itself suggests. 2 keeps relief half as wide, "
        "with more noise; 0.5 gives a smoother surface.",
    ),
]
ReportOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write the page of `quadfringe report`, .html, as well; needs the extra plot."),
]


def decode(
    projector_width: ColumnsOption,
    out: ResultOption,
    sources: SourcesArgument = None,
    fringes: FringesOfShotOption = None,
    encoding: EncodingOption = None,
    columns: ColumnRangeOption = None,
    steps: StepsOption = None,
    numbers: NumbersOption = None,
    order: OrderOption = None,
    beam: BeamOption = None,
    red: ImageOption = None,
    green: ImageOption = None,
    blue: ImageOption = None,
    ir: ImageOption = None,
    rgb: RgbOption = None,
    raw: RawOption = None,
    bayer: BayerOption = None,
    response: ResponseOption = None,
    linear: LinearOption = False,
    calibration: CalibrationOption = None,
    method: MethodOption = None,
    unwrapping: UnwrappingOption = None,
    depth_range_mm: DepthRangeOption = None,
    predeformed_z_mm: PredeformedOption = None,
    bits: BitsOption = None,
    period_px: PeriodOption = None,
    channel_instants_us: InstantsOption = None,
    detail: DetailOption = None,
    report: ReportOption = None,
    json: JsonOption = None,
) -> None:
    """Decode the images of one shot, or of --steps, to absolute phase, and with --calibration to millimetres."""
    _check_given(out, report, calibration, depth_range_mm)
    words = step_words(sources, numbers, steps, order, beam, bits)
    images = {"red": red, "green": green, "blue": blue, "ir": ir, "rgb": rgb, "raw": raw}
    settings = _settings(method, unwrapping, depth_range_mm, period_px, channel_instants_us) | {"detail": detail}
    code: dict[str, Any] = {"fringes": fringes, "encoding": encoding, "columns": columns, "bayer": bayer}
    code["predeformed_z_mm"] = predeformed_z_mm
    if words.given:
        shape = from_steps(words, projector_width, calibration, _response(response, linear), code | images | settings)
        return _save(shape, _Results(out, report), json)
    plan = _plan(projector_width, code, calibration, _response(response, linear), settings)
    return _save(_decoded(_shot(words.files, images, bayer, bits), plan), _Results(out, report), json)


def _settings(
    method: str | None,
    unwrapping: Unwrapping | None,
    depth_range_mm: tuple[float, float] | None,
    period_px: tuple[float, ...] | None,
    channel_instants_us: tuple[float, ...] | None,
) -> dict[str, Any]:
    """Give the options of the method by the names of the settings."""
    given: dict[str, Any] = {"method": method, "unwrapping": unwrapping and unwrapping.value}
    given |= {"depth_range_mm": depth_range_mm, "channel_instants_us": channel_instants_us}
    given["period_px"] = one_or_two(period_px)
    return given


def _plan(
    projector_width: int,
    fringes: Mapping[str, Any],
    calibration: Path | None,
    response: str,
    settings: Mapping[str, Any],
) -> Plan:
    from quadfringe import decoding
    from quadfringe.errors import InputError

    numbers, encoding = fringes["fringes"], fringes["encoding"]
    if numbers is None:
        raise InputError(
            "a single shot needs --fringes N N N, or --encoding rgb --fringes N N [N] without infrared, step images "
            "--steps N and --numbers N...; give one"
        )
    others = {"predeformed_z_mm": fringes["predeformed_z_mm"]}
    found = fringes_from(encoding, numbers, fringes["columns"], **others)
    return decoding.Plan(projector_width, found, calibration, response, decode_settings(settings))


def _decoded(shot: AnyShot, plan: Plan) -> Shape:
    """Decode quietly; the warnings are printed in the words of the shape."""
    from quadfringe import decoding
    from quadfringe.errors import DecodeWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DecodeWarning)
        return decoding.decode(shot, plan)


@dataclass(frozen=True)
class _Results:
    """The files to write: the shape, and its page if there is to be one."""

    shape: Path
    page: Path | None


def _check_given(out: Path, report: Path | None, calibration: Path | None, depths: tuple[float, float] | None) -> None:
    """Refuse result files that could not be written, and depths without a calibration, before anything is decoded."""
    from quadfringe.data.shape import SUFFIXES
    from quadfringe.errors import InputError, require
    from quadfringe.files import require_suffix

    if report is not None:
        require_suffix(report, (".html", ".htm"))
        require("matplotlib", "plot")
    if require_suffix(out, SUFFIXES) != ".npz" and calibration is None:
        raise InputError(f"{out}: millimetres need --calibration FILE; without a calibration, write .npz")
    if depths is not None and calibration is None:
        raise InputError("--depth-range-mm needs --calibration FILE: without a calibration there are no depths")


def _response(response: str | None, linear: bool) -> str:
    """Return the response that the two options state together."""
    from quadfringe.errors import InputError

    if linear and response not in (None, "linear"):
        raise InputError("--response and --linear contradict each other; give one of them")
    return "linear" if linear else response or "auto"


def _shot(folders: list[Path], files: Mapping[str, Path | None], bayer: Bayer | None, bits: Bits | None) -> AnyShot:
    """Read the shot from a folder, or from separate images, a colour image, or a raw mosaic."""
    from quadfringe.data import read_shot
    from quadfringe.errors import InputError

    if len(folders) > 1:
        raise InputError(f"expected one folder, got {len(folders)} files and folders; step images need --steps")
    folder = folders[0] if folders else None
    given = [f"--{name}" for name, path in files.items() if path is not None]
    if folder is not None and given:
        raise InputError(f"{folder}: a folder holds all images; leave out {', '.join(given)}, or the folder")
    pattern: BayerPattern | None = None if bayer is None else bayer.value
    return read_shot(files if folder is None else folder, None if bits is None else int(bits), bayer=pattern)


def _save(shape: Shape, results: _Results, json: Path | None) -> None:
    """Save the shape and its page, print a summary and its warnings, and write its figures."""
    out = results.shape
    shape.save(out)
    if results.page is not None:
        from quadfringe.view.page import write_page

        write_page(results.page, shape, out.name)
    for text in shape.warnings:
        caution(text)
    if shape.geometry.startswith("rows not"):
        note(shape.geometry)
    figures = shape.figures()
    pixels = f"{figures['returned_percent']:.1f} % of {shape.phase_rad.size} pixels returned"
    say(f"{out}: {pixels}{uncertainty_told(figures)}", json)
    if shape.config["response"] is not None and shape.config["response_from"] == "shots":
        figures = {**figures, **response_told(shape, json)}
    write_figures(figures, json, warnings=list(shape.warnings), notes=[shape.geometry] if shape.geometry else [])
