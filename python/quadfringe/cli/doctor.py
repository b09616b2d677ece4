"""`quadfringe doctor`: find what is wrong with the installation, a shot or a calibration, and say how to fix it."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from quadfringe.cli._options import Bayer, Bits, BitsOption, ColumnsOption, JsonOption
from quadfringe.cli._output import say, write_record

if TYPE_CHECKING:
    from quadfringe.data import AnyShot
    from quadfringe.doctor import Finding

__all__ = ["doctor"]

FAULT = 1
MARKS = {"good": "ok     ", "warning": "WARNING", "fault": "FAULT  "}
PathsArgument = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="[PATH]...",
        help="A folder with a shot (red, green, blue and ir, or raw and ir, .png), a calibration .json, or both; "
        "without a path, the installation is examined.",
    ),
]
FringesOption = Annotated[
    tuple[float, float, float],
    typer.Option(metavar="N N N", help="Fringe numbers of the shot: of red and blue, of green, of infrared."),
]
BayerOption = Annotated[
    Bayer | None, typer.Option(help="Filter colours of the first 2 x 2 pixels of raw.png; needed for a raw mosaic.")
]


def doctor(
    files: PathsArgument = None,
    fringes: FringesOption = (36.0, 35.0, 30.0),
    projector_width: ColumnsOption = 912,
    bayer: BayerOption = None,
    bits: BitsOption = None,
    json: JsonOption = None,
) -> None:
    """Examine the installation, or a shot or a calibration; say what is wrong and how to fix it.

    The exit status is 1 when a fault is found.
    """
    from quadfringe.config import Fringes, checked
    from quadfringe.data import Calibration
    from quadfringe.decoding import Plan
    from quadfringe.doctor import examine_calibration, examine_digest, examine_installation, examine_shot

    given = _sorted_paths(files or [])
    calibration = None if given.calibration is None else Calibration.load(given.calibration)
    found: list[Finding] = [] if files else examine_installation()
    if calibration is not None and given.calibration is not None:
        found += [examine_digest(given.calibration), *examine_calibration(calibration)]
    if given.shot is not None:
        plan = Plan(projector_width, checked(Fringes, {"numbers": fringes}, "--fringes"), calibration)
        found += examine_shot(_shot_in(given.shot, bayer, bits), plan)
    _report(found, json)


class _Paths(NamedTuple):
    """The folder of a shot and the file of a calibration, where given."""

    shot: Path | None
    calibration: Path | None


def _sorted_paths(paths: Sequence[Path]) -> _Paths:
    """Tell the shot from the calibration; raise `InputError` for anything else, and for two of a kind."""
    from quadfringe.errors import InputError

    folders = [path for path in paths if path.is_dir()]
    calibrations = [path for path in paths if path.suffix.lower() == ".json"]
    if len(folders) > 1 or len(calibrations) > 1 or len(folders) + len(calibrations) < len(paths):
        wrong = ", ".join(str(path) for path in paths)
        raise InputError(f"expected one folder with a shot, one calibration .json, or both, got {wrong}")
    return _Paths(folders[0] if folders else None, calibrations[0] if calibrations else None)


def _shot_in(folder: Path, bayer: Bayer | None, bits: Bits | None) -> AnyShot:
    from quadfringe.data import read_shot
    from quadfringe.errors import InputError

    if bayer is None and (folder / "raw.png").exists():
        raise InputError(f"{folder}: holds a raw mosaic; name its filter pattern with --bayer")
    return read_shot(folder, None if bits is None else int(bits), bayer=None if bayer is None else bayer.value)


def _report(found: Sequence[Finding], json: Path | None) -> None:
    """Print the findings with their fixes, and exit with status 1 when one is a fault."""
    for one in found:
        say(f"{MARKS[one.grade]} {one.name}: {one.found}", json)
        if one.fix:
            say(f"        fix: {one.fix}", json)
    faults, warnings = (sum(one.grade == grade for one in found) for grade in ("fault", "warning"))
    say(f"{faults} faults, {warnings} warnings", json)
    write_record({"findings": [vars(one) | {"value": _finite(one.value)} for one in found]}, json)
    if faults:
        raise typer.Exit(FAULT)


def _finite(value: float | None) -> float | None:
    """Give a number that JSON can hold: a calibration may be infinitely wrong."""
    return value if value is not None and isfinite(value) else None
