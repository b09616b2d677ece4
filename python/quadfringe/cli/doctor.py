"""`quadfringe doctor`: what is wrong with the installation, a shot or a calibration, and the fix for each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import Bayer, JsonOption, say, write_record

if TYPE_CHECKING:
    from quadfringe.data import AnyShot, Calibration
    from quadfringe.doctor import Finding

__all__ = ["doctor"]

FAULT = 1
MARKS = {"good": "ok     ", "warning": "WARNING", "fault": "FAULT  "}


def doctor(
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[PATH]...",
            help="A folder with a shot (red, green, blue, ir .png, or raw and ir), a calibration .json, or both.",
        ),
    ] = None,
    fringes: Annotated[
        tuple[float, float, float], typer.Option(metavar="N N N", help="Fringe numbers of the shot.")
    ] = (36.0, 35.0, 30.0),
    projector_width: Annotated[int, typer.Option(min=2, help="Columns that the fringes cover.")] = 912,
    bayer: Annotated[Bayer | None, typer.Option(help="Colours of the first 2 x 2 pixels of raw.png.")] = None,
    json: JsonOption = None,
) -> None:
    """Say what is wrong with the installation, or with a shot or a calibration, and how to mend it.

    The status is 1 when a fault is found.
    """
    from quadfringe.config import Fringes
    from quadfringe.data import Calibration
    from quadfringe.decoding import Plan
    from quadfringe.doctor import examine_calibration, examine_installation, examine_shot
    from quadfringe.errors import InputError

    given = files or []
    folders = [path for path in given if path.is_dir()]
    calibrations = [path for path in given if path.suffix.lower() == ".json"]
    if len(folders) > 1 or len(calibrations) > 1 or len(folders) + len(calibrations) < len(given):
        wrong = ", ".join(str(path) for path in given)
        raise InputError(f"expected one folder with a shot, one calibration .json, or both, got {wrong}")
    calibration: Calibration | None = None
    found: list[Finding] = [] if given else examine_installation()
    if calibrations:
        calibration = Calibration.load(calibrations[0])
        found += examine_calibration(calibration)
    if folders:
        plan = Plan(projector_width, Fringes(numbers=fringes), calibration)
        found += examine_shot(_shot_in(folders[0], bayer), plan)
    for one in found:
        say(f"{MARKS[one.grade]} {one.name}: {one.found}", json)
        if one.fix:
            say(f"        fix: {one.fix}", json)
    faults, warnings = (sum(one.grade == grade for one in found) for grade in ("fault", "warning"))
    say(f"{faults} faults, {warnings} warnings", json)
    write_record({"findings": [vars(one) for one in found]}, json)
    if faults:
        raise typer.Exit(FAULT)


def _shot_in(folder: Path, bayer: Bayer | None) -> AnyShot:
    from quadfringe.data.shot_files import read_folder
    from quadfringe.errors import InputError

    if bayer is None and (folder / "raw.png").exists():
        raise InputError(f"{folder}: holds a raw mosaic; say its pattern with --bayer")
    return read_folder(folder, None if bayer is None else bayer.value)
