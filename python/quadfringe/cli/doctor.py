"""`quadfringe doctor`: find what is wrong with the installation, a shot or a calibration, and say how to fix it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from quadfringe.cli._options import (
    Bayer,
    Bits,
    BitsOption,
    ColumnRangeOption,
    ColumnsOption,
    EncodingOption,
    FringesOption,
    JsonOption,
    PeriodOption,
    decode_settings,
    fringes_from,
    one_or_two,
)
from quadfringe.cli._output import say, write_record
from quadfringe.cli._screens import say_picture_modes
from quadfringe.cli._system import CameraOption, system_of

if TYPE_CHECKING:
    from quadfringe.data import AnyShot
    from quadfringe.decoding import Plan
    from quadfringe.doctor import Finding

__all__ = ["doctor"]

FAULT = 1
MARKS = {"fault": "FAULT  ", "warning": "WARNING", "note": "note   ", "good": "ok     "}
GRADES = tuple(MARKS)  # in the order in which they are printed
PathsArgument = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="[PATH]...",
        help="A folder with a shot (red, green, blue and ir, or raw and ir, .png), a calibration .json, or both; "
        "with --board or --plane several folders and a calibration; without a path, the installation is examined.",
    ),
]
BayerOption = Annotated[
    Bayer | None, typer.Option(help="Filter colours of the first 2 x 2 pixels of raw.png; needed for a raw mosaic.")
]
BoardOption = Annotated[
    bool, typer.Option("--board", help="The shots show a calibration board: compare its decoded points with it.")
]
TargetOption = Annotated[
    Path | None,
    typer.Option(
        "--target", metavar="FILE", help="Board of --board, .json of quadfringe target; default: the ring board."
    ),
]
PlaneOption = Annotated[
    bool, typer.Option("--plane", help="The shots show a flat plate that fills most of the image: measure its bow.")
]
SystemOption = Annotated[
    Path | None,
    typer.Option("--system", metavar="FILE", help="System file, .toml: examine its camera, screens and settings."),
]


def doctor(
    files: PathsArgument = None,
    fringes: FringesOption = None,
    encoding: EncodingOption = None,
    columns: ColumnRangeOption = None,
    projector_width: ColumnsOption = 912,
    bayer: BayerOption = None,
    bits: BitsOption = None,
    period_px: PeriodOption = None,
    board: BoardOption = False,
    target: TargetOption = None,
    plane: PlaneOption = False,
    system: SystemOption = None,
    camera: CameraOption = None,
    json: JsonOption = None,
) -> None:
    """Examine the installation, or a shot, a calibration or a system; say what is wrong and how to fix it.

    With --board or --plane, tell a fault of the calibration from one of the decoding. With --system or --camera, open
    the camera, look through some frames, and compare settings and screens. The exit status is 1 when a fault is found.
    """
    from quadfringe.data import Calibration
    from quadfringe.decoding import Plan
    from quadfringe.doctor import examine_calibration, examine_digest, examine_installation

    if system is not None or camera is not None:
        _report(_of_system(system, camera, files), json)
        return
    surface = _surface(board, target, plane)
    given = _sorted_paths(files or [], several=surface is not None)
    calibration = None if given.calibration is None else Calibration.load(given.calibration)
    found: list[Finding] = [] if files else examine_installation()
    settings = decode_settings({"period_px": one_or_two(period_px)})
    plan = Plan(projector_width, fringes_from(encoding, fringes, columns), calibration, decode=settings)
    for folder in given.shots:
        one = _examined(_shot_in(folder, bayer, bits), plan, surface)
        found += [replace(each, name=f"{folder.name} {each.name}") for each in one] if len(given.shots) > 1 else one
    if calibration is not None and given.calibration is not None:
        found += [examine_digest(given.calibration), *examine_calibration(calibration)]
    _report(found, json)


def _of_system(system: Path | None, camera: str | None, files: list[Path] | None) -> list[Finding]:
    """Examine a system, and print what must be checked by hand."""
    from quadfringe.config import HdmiProjectorConfig
    from quadfringe.doctor import examine_system
    from quadfringe.errors import InputError

    if files:
        raise InputError("--system and --camera examine devices, and paths name files; give one of them")
    config = system_of(system, camera)
    assert config is not None  # one of them was given
    if config.projectors is not None and isinstance(config.projectors.visible, HdmiProjectorConfig):
        say_picture_modes()
    return examine_system(config)


Examined = Callable[["AnyShot", "Plan"], "list[Finding]"]


def _surface(board: bool, target: Path | None, plane: bool) -> Examined | None:
    """Give the check of what the shots show, where it is known; raise `InputError` for options that contradict."""
    from quadfringe.calibration.targets import Target
    from quadfringe.config import checked
    from quadfringe.data.calibration import stored_values
    from quadfringe.doctor import examine_board, examine_plane
    from quadfringe.errors import InputError

    if board and plane:
        raise InputError("--board checks that the board is flat, too; leave out --plane")
    if target is not None and not board:
        raise InputError("--target describes the board of --board; add --board")
    if plane:
        return examine_plane
    if not board:
        return None
    shown = None if target is None else checked(Target, stored_values(target), str(target))
    return lambda shot, plan: examine_board(shot, plan, shown)


def _examined(shot: AnyShot, plan: Plan, surface: Examined | None) -> list[Finding]:
    """Examine a shot, and what it shows; the verdict on calibration and decoding comes first."""
    from quadfringe.doctor import examine_shot

    return ([] if surface is None else surface(shot, plan)) + examine_shot(shot, plan)


class _Paths(NamedTuple):
    """The folders of shots and the file of a calibration, where given."""

    shots: list[Path]
    calibration: Path | None


def _sorted_paths(paths: Sequence[Path], *, several: bool) -> _Paths:
    """Tell shots from the calibration; raise `InputError` for anything else, and for two unless `several` may be."""
    from quadfringe.errors import InputError

    folders = [path for path in paths if path.is_dir()]
    calibrations = [path for path in paths if path.suffix.lower() == ".json"]
    wrong = ", ".join(str(path) for path in paths)
    if several and not (folders and len(calibrations) == 1 and len(folders) + 1 == len(paths)):
        raise InputError(f"--board and --plane: expected folders with shots and one calibration .json, got {wrong}")
    if len(calibrations) > 1 or len(folders) + len(calibrations) < len(paths) or (len(folders) > 1 and not several):
        raise InputError(f"expected one folder with a shot, one calibration .json, or both, got {wrong}")
    return _Paths(folders, calibrations[0] if calibrations else None)


def _shot_in(folder: Path, bayer: Bayer | None, bits: Bits | None) -> AnyShot:
    from quadfringe.data import read_shot
    from quadfringe.errors import InputError

    if bayer is None and (folder / "raw.png").exists():
        raise InputError(f"{folder}: holds a raw mosaic; name its filter pattern with --bayer")
    return read_shot(folder, None if bits is None else int(bits), bayer=None if bayer is None else bayer.value)


def _report(found: Sequence[Finding], json: Path | None) -> None:
    """Print the findings with their fixes, the faults first, and exit with status 1 when there is one."""
    found = sorted(found, key=lambda one: GRADES.index(one.grade))
    for one in found:
        say(f"{MARKS[one.grade]} {one.name}: {one.found}", json)
        if one.fix:
            say(f"        {'by hand' if one.grade == 'note' else 'fix'}: {one.fix}", json)
    faults, warnings = (sum(one.grade == grade for one in found) for grade in ("fault", "warning"))
    say(f"{faults} faults, {warnings} warnings", json)
    write_record({"findings": [vars(one) | {"value": _finite(one.value)} for one in found]}, json)
    if faults:
        raise typer.Exit(FAULT)


def _finite(value: float | None) -> float | None:
    """Give a number that JSON can hold: a calibration may be infinitely wrong."""
    return value if value is not None and isfinite(value) else None
