"""`quadfringe calibrate`: what a bench must know of itself before it measures."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from quadfringe.cli._output import JsonOption, say, table, write_figures, write_record

__all__ = ["app"]

app = typer.Typer(help="Calibrate a bench, step by step.", no_args_is_help=True)
NOT_GOOD = 1


class ChannelName(StrEnum):
    """Which channel a stack of images belongs to."""

    all = "all"
    red = "red"
    green = "green"
    blue = "blue"
    ir = "ir"


@app.callback()
def calibrate() -> None:
    """Calibrate a bench, step by step: run does it all, on the virtual bench or with the captures of a folder."""


@app.command()
def run(
    out: Annotated[Path, typer.Option(metavar="FILE", help="The calibration, .json.")],
    captures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of captures, see plan; else the virtual bench.")
    ] = None,
    rig: Annotated[str | None, typer.Option(help="Name of the bench that the captures must be of.")] = None,
    system: Annotated[
        Path | None, typer.Option(metavar="FILE", help="System of the virtual bench, .toml, without --captures.")
    ] = None,
    poses: Annotated[int, typer.Option(min=4, max=60, help="Poses of the board on the virtual bench.")] = 12,
    pictures: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for coverage, residuals and the rest as PNG.")
    ] = None,
    heights: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The height polynomial of every pixel, .npz.")
    ] = None,
    json: JsonOption = None,
) -> None:
    """Do every step whose captures are there: say what is missing, what came out, and whether it is good.

    The status is 1 when a needed step is missing, in which case nothing is written, or when a step is not good.
    """
    from quadfringe.calibration.session import FolderCaptures, guide
    from quadfringe.calibration.session.geometry import height_calibration
    from quadfringe.calibration.session.virtual import VirtualCaptures, virtual_session
    from quadfringe.errors import InputError
    from quadfringe.evaluation.simulate import virtual_bench_config
    from quadfringe.files import require_suffix

    require_suffix(out, (".json",))
    if heights is not None:
        require_suffix(heights, (".npz",))
    if captures is not None and system is not None:
        raise InputError(
            "--captures and --system: the one is a folder of images, the other the virtual bench; give one"
        )
    if captures is not None:
        found = guide(FolderCaptures(captures, rig), lambda words: say(words, json))
    else:
        config = virtual_bench_config(system, noise=None if system else 0.01)
        if config.capture.kind != "virtual":
            raise InputError(
                f"{system}: has a camera, not the virtual bench: take its captures with quadfringe calibrate capture "
                "DIR --system FILE, then calibrate run --captures DIR"
            )
        found = guide(VirtualCaptures(config, virtual_session(config, poses)), lambda words: say(words, json))
    if found.calibration is None:
        say("no calibration: take the missing captures and run this again", json)
        raise typer.Exit(NOT_GOOD)
    if pictures is not None:
        from quadfringe.calibration.session.pictures import write_pictures

        say("\n".join(str(path) for path in write_pictures(pictures, found)), json)
    planes = found.outcome("planes")
    polynomial = None if planes is None else height_calibration(planes)
    if heights is not None and polynomial is not None:
        polynomial.save(heights)
    found.calibration.save(out)
    say(f"{out}: {'every step is good' if found.good else 'NOT every step is good; see above'}", json)
    write_record({"good": found.good, "steps": [one.step.model_dump(mode="json") for one in found.outcomes]}, json)
    if not found.good:
        raise typer.Exit(NOT_GOOD)


@app.command()
def plan(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the captures; made when missing.")],
    rig: Annotated[str, typer.Option(help="Name of the bench.")],
    poses: Annotated[int, typer.Option(min=4, max=60, help="Poses of the board.")] = 12,
) -> None:
    """Write session.json, whose settings may then be edited, and list every capture to take."""
    from quadfringe.calibration.session.settings import FILE, Session
    from quadfringe.errors import InputError
    from quadfringe.files import folder_for

    if (folder / FILE).exists():
        raise InputError(f"{folder / FILE}: is there already; edit it, or take another folder")
    session = Session(rig=rig, poses=poses)
    session.save(folder_for(folder) / FILE)
    _list_captures(folder)


@app.command()
def check(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of captures.")],
) -> None:
    """Say which captures of a folder are missing, step by step; the status is 1 when a needed one is."""
    if _list_captures(folder):
        raise typer.Exit(NOT_GOOD)


def _list_captures(folder: Path) -> bool:
    """Say what is there and what is not; tell whether a needed step is incomplete."""
    from quadfringe.calibration.session import FolderCaptures
    from quadfringe.calibration.session.settings import STEPS

    captures, lacking = FolderCaptures(folder), False
    for step in STEPS:
        missing, total = captures.missing(step.name), len(captures.session.captures(step.name))
        need = "needed" if step.needed else "may be left out"
        say(f"{step.name}: {total - len(missing)} of {total} captures ({need})")
        if missing:
            say(f"  {step.how}")
            say("\n".join(f"  {folder / step.name / name}" for name in missing))
            lacking = lacking or step.needed
    if not lacking:
        say("nothing that is needed is missing: quadfringe calibrate run")
    return lacking


@app.command()
def capture(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of captures, made by plan.")],
    system: Annotated[Path, typer.Option(metavar="FILE", help="System with the camera and both projectors, .toml.")],
    step: Annotated[list[str] | None, typer.Option(metavar="STEP", help="Only this step; may be repeated.")] = None,
) -> None:
    """Take the captures that are missing: says what to put where, waits for Enter, shows the light and takes the shot.

    A pose in which the board is not seen is taken again at once. Interrupted, it goes on where it was. On the virtual
    bench nobody is asked.
    """
    from quadfringe.calibration.session import FolderCaptures, take_captures
    from quadfringe.calibration.session.settings import STEP_NAMES, step_named
    from quadfringe.calibration.session.virtual import VirtualCaptures
    from quadfringe.config import load_system
    from quadfringe.config.cameras import VirtualConfig

    told: set[str] = set()

    def person(step: str, name: str, _: object) -> None:
        if step not in told:
            say(step_named(step).how)
        if step not in told or step not in ("dark", "levels", "flat"):
            typer.prompt(f"{step}/{name}: Enter when it stands still", default="", show_default=False)
        told.add(step)

    config, session = load_system(system), FolderCaptures(folder).session
    virtual = isinstance(config.capture, VirtualConfig)
    hands = VirtualCaptures(config, session).hands if virtual else person
    taken = take_captures(config, folder, hands, step or STEP_NAMES, say)
    say(f"{folder}: {len(taken)} captures taken; now quadfringe calibrate check {folder}")


@app.command()
def rehearse(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the captures; made when missing.")],
    system: Annotated[Path | None, typer.Option(metavar="FILE", help="System of the virtual bench, .toml.")] = None,
    poses: Annotated[int, typer.Option(min=4, max=60, help="Poses of the board.")] = 12,
) -> None:
    """Write every capture of a calibration of the virtual bench as images, to see what a session looks like."""
    from quadfringe.calibration.session.virtual import VirtualCaptures, virtual_session
    from quadfringe.evaluation.simulate import virtual_bench_config

    config = virtual_bench_config(system, noise=None if system else 0.01)
    written = VirtualCaptures(config, virtual_session(config, poses)).write(folder)
    say(f"{folder}: {len(written)} captures; now quadfringe calibrate run --captures {folder} --out calibration.json")


@app.command("export")
def export_opencv(
    calibration: Annotated[Path, typer.Argument(metavar="FILE", help="Calibration, .json.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="OpenCV FileStorage: .yml, .yaml, .xml or .json.")],
) -> None:
    """Write the devices of a calibration for OpenCV."""
    from quadfringe.calibration.opencv_files import write_opencv
    from quadfringe.data import Calibration

    write_opencv(out, Calibration.load(calibration))
    say(str(out))


@app.command("import")
def import_opencv(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="OpenCV FileStorage: .yml, .yaml, .xml or .json.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Calibration, .json.")],
) -> None:
    """Make a calibration of the devices in a file of OpenCV."""
    from quadfringe.calibration.opencv_files import read_opencv

    read_opencv(file).save(out)
    say(str(out))


@app.command()
def response(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Images in the order of their shifts.")],
    steps: Annotated[int, typer.Option(min=4, max=64, help="Equal shifts in one period.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The response, .json.")],
    channel: Annotated[ChannelName, typer.Option(help="Channel that the images show.")] = ChannelName.all,
    base: Annotated[Path | None, typer.Option(metavar="FILE", help="Response that gives the others.")] = None,
    json: JsonOption = None,
) -> None:
    """Estimate the response (gamma) of a channel from an N-step capture; several stacks may follow one another."""
    from quadfringe.calibration.response import estimate_from_files
    from quadfringe.data import ResponseCalibration
    from quadfringe.files import require_suffix

    require_suffix(out, (".json",))
    known = None if base is None else ResponseCalibration.load(base)
    names = None if channel is ChannelName.all else (channel.value,)
    found = estimate_from_files(files, steps, names, known)
    found.calibration.save(out)
    table(f"{out}: linear = max(I / (1 - knee I^20) - offset, 0) ^ exponent", found.figures, json)
    write_figures(found.figures, json)
