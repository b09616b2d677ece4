"""`quadfringe calibrate`: the guided calibration of a bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._calibrating import RENDER_S, images_of, meter_of, progress_of
from quadfringe.cli._options import BoardPosesOption, JsonOption, VirtualSystemOption
from quadfringe.cli._output import say, write_record
from quadfringe.cli.response import response

if TYPE_CHECKING:
    from quadfringe.calibration.session import Captures, Guided
    from quadfringe.calibration.session.outcome import Outcome

__all__ = ["app"]

app = typer.Typer(help="Calibrate a bench, step by step.", no_args_is_help=True)
NOT_GOOD = 1


CapturesFolder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of captures, made by calibrate plan.")]
NewFolder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the captures; created when it is missing.")]
OpencvHelp = "OpenCV FileStorage: .yml, .yaml, .xml or .json."
CapturesOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Folder of captures, made by calibrate plan; default: the virtual bench."),
]
RigOption = Annotated[
    str | None, typer.Option(help="Name of the bench; captures of another bench are refused. Default: any bench.")
]
PicturesOption = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="Write board coverage, residuals and other pictures into this folder, PNG."),
]
HeightsOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the height polynomial of every pixel, .npz.")
]


@app.callback()
def calibrate() -> None:
    """Calibrate a bench step by step: plan, capture, check, then run; run alone rehearses on the virtual bench."""


@app.command()
def run(
    out: Annotated[Path, typer.Option(metavar="FILE", help="Calibration to write, .json.")],
    captures: CapturesOption = None,
    rig: RigOption = None,
    system: VirtualSystemOption = None,
    poses: BoardPosesOption = 12,
    pictures: PicturesOption = None,
    heights: HeightsOption = None,
    json: JsonOption = None,
) -> None:
    """Do every step whose captures exist; print missing captures, results, and whether the results are good.

    The exit status is 1 when a needed step is missing, in which case no file is written, or when a step is not good.
    """
    from quadfringe.calibration.session import guide
    from quadfringe.files import require_suffix

    require_suffix(out, (".json",))
    if heights is not None:
        require_suffix(heights, (".npz",))
    chosen = _captures(captures, rig, system, poses)
    with progress_of("calibrate run", chosen, rendered=captures is None) as counted:
        found = guide(counted, lambda words: say(words, json), lambda outcome: _picture(outcome, pictures, json))
    if found.calibration is None:
        say("no calibration: take the missing captures and run this command again", json)
        raise typer.Exit(NOT_GOOD)
    _write_heights(found, heights)
    found.calibration.save(out)
    say(f"{out}: {'every step is good' if found.good else 'NOT every step is good; see above'}", json)
    say(
        f'use it with calibration = "{out.name}" in the system file; it holds the responses, so leave response out',
        json,
    )
    write_record({"good": found.good, "steps": [one.step.model_dump(mode="json") for one in found.outcomes]}, json)
    if not found.good:
        raise typer.Exit(NOT_GOOD)


def _captures(folder: Path | None, rig: str | None, system: Path | None, poses: int) -> Captures:
    """Return the captures of a folder, or those of the virtual bench."""
    from quadfringe.calibration.session import FolderCaptures
    from quadfringe.calibration.session.virtual import VirtualCaptures, virtual_session
    from quadfringe.errors import InputError
    from quadfringe.evaluation.simulate import virtual_bench_config

    if folder is not None and system is not None:
        raise InputError("--captures names a folder of images and --system a virtual bench; give one of them")
    if folder is not None:
        return FolderCaptures(folder, rig)
    config = virtual_bench_config(system, noise=None if system else 0.01)
    if config.capture.kind != "virtual":
        raise InputError(
            f"{system}: names a camera, not the virtual bench; take the captures with quadfringe calibrate capture DIR "
            "--system FILE, then calibrate run --captures DIR"
        )
    return VirtualCaptures(config, virtual_session(config, poses))


def _picture(outcome: Outcome, folder: Path | None, json: Path | None) -> None:
    """Write the picture of a step as soon as it is done, so that it exists also when a later step fails."""
    if folder is None:
        return
    from quadfringe.calibration.session.pictures import write_picture

    if (path := write_picture(folder, outcome)) is not None:
        say(f"  {path}", json)


def _write_heights(found: Guided, heights: Path | None) -> None:
    """Write the height polynomials, when they are wanted."""
    from quadfringe.calibration.session.geometry import height_calibration

    planes = found.outcome("planes")
    polynomial = None if planes is None else height_calibration(planes)
    if heights is not None and polynomial is not None:
        polynomial.save(heights)


@app.command()
def plan(
    folder: NewFolder,
    rig: Annotated[str, typer.Option(help="Name of the bench, kept in the calibration.")],
    poses: BoardPosesOption = 12,
    system: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="System file, .toml: plan for its fringes, projectors and camera. Default: two "
            "LightCrafters and a camera with infrared.",
        ),
    ] = None,
    target: Annotated[
        Path | None,
        typer.Option(
            "--target", metavar="FILE", help="Calibration board, .json of quadfringe target; default: the ring board."
        ),
    ] = None,
) -> None:
    """Write session.json, whose settings you may edit afterwards, and list every capture to take."""
    from quadfringe.calibration.session import session_of
    from quadfringe.calibration.session.settings import FILE
    from quadfringe.calibration.targets import Target
    from quadfringe.config import SystemConfig, checked, load_system
    from quadfringe.data.calibration import stored_values
    from quadfringe.errors import InputError
    from quadfringe.files import folder_for

    if (folder / FILE).exists():
        raise InputError(f"{folder / FILE}: exists already; edit it, or choose another folder")
    board = {} if target is None else {"target": checked(Target, stored_values(target), str(target))}
    config = SystemConfig() if system is None else load_system(system)
    session = session_of(config, rig, poses=poses, **board)
    session.save(folder_for(folder) / FILE)
    _list_captures(folder)


@app.command()
def check(
    folder: CapturesFolder,
) -> None:
    """List the missing captures of a folder, step by step; the exit status is 1 when a needed one is missing."""
    if _list_captures(folder):
        raise typer.Exit(NOT_GOOD)


def _list_captures(folder: Path) -> bool:
    """Print which captures exist and which are missing; return whether a needed step is incomplete."""
    from quadfringe.calibration.session import FolderCaptures
    from quadfringe.calibration.session.settings import STEPS

    captures, lacking = FolderCaptures(folder), False
    for step in STEPS:
        missing, total = captures.missing(step.name), len(captures.session.captures(step.name))
        need = "needed" if step.needed else "optional"
        say(f"{step.name}: {total - len(missing)} of {total} captures ({need})")
        if missing:
            say(f"  {step.how}")
            say("\n".join(f"  {folder / step.name / name}" for name in missing))
            lacking = lacking or step.needed
    if not lacking:
        say("every needed capture exists; next: quadfringe calibrate run")
    return lacking


@app.command()
def capture(
    folder: CapturesFolder,
    system: Annotated[Path, typer.Option(metavar="FILE", help="System file with camera and projectors, .toml.")],
    step: Annotated[
        list[str] | None,
        typer.Option(metavar="STEP", help="Take the captures of this step only; may be repeated; default: all steps."),
    ] = None,
) -> None:
    """Take the missing captures: say what to place in front of the camera, wait for Enter, project, take the shot.

    A pose in which the board is not found is repeated at once. Run the command again to continue an interrupted
    session. Without --step, all steps are taken, also the optional ones. On the virtual bench it does not wait for
    Enter. With files:FOLDER it says which exposure to set in the program of the camera, and waits for each image.
    """
    from quadfringe.calibration.session import FolderCaptures, take_captures
    from quadfringe.calibration.session.settings import STEP_NAMES
    from quadfringe.calibration.session.virtual import VirtualCaptures
    from quadfringe.config import load_system
    from quadfringe.config.cameras import VirtualConfig

    config, session = load_system(system), FolderCaptures(folder).session
    virtual = isinstance(config.capture, VirtualConfig)
    hands = VirtualCaptures(config, session).hands if virtual else _Person().hands
    taken = take_captures(config, folder, hands, step or STEP_NAMES, say, _expose)
    say(f"{folder}: {len(taken)} captures taken; next: quadfringe calibrate check {folder}")


class _Person:
    """Asks a person to put the object of each capture in place, and explains each step once."""

    def __init__(self) -> None:
        self._explained: set[str] = set()

    def hands(self, step: str, name: str, _: object) -> None:
        """Wait until a person has put the object of a capture in place."""
        from quadfringe.calibration.session import step_named

        first = step not in self._explained
        if first:
            say(step_named(step).how)
            self._explained.add(step)
        if first or step not in ("dark", "levels", "flat"):
            _wait(f"{step}/{name}: press Enter when everything is still")


def _expose(share: float) -> None:
    """Wait until a person has set the exposure in the program of the camera."""
    to = f"set it to {share:.0%} of the full one" if share != 1 else "set it back to the full one"
    _wait(f"exposure of the camera: {to}, in the program of the camera, and press Enter")


def _wait(words: str) -> None:
    typer.prompt(words, default="", show_default=False)


@app.command()
def rehearse(
    folder: NewFolder,
    system: VirtualSystemOption = None,
    poses: BoardPosesOption = 12,
) -> None:
    """Render every capture of a calibration on the virtual bench as image files, as an example of a session."""
    from quadfringe.calibration.session.virtual import VirtualCaptures, virtual_session
    from quadfringe.evaluation.simulate import virtual_bench_config

    config = virtual_bench_config(system, noise=None if system else 0.01)
    captures = VirtualCaptures(config, virtual_session(config, poses))
    with meter_of("calibrate rehearse", captures.session, RENDER_S) as shown:
        written = captures.write(folder, done=lambda step, _: shown.advance(images_of(captures.session, step)))
    say(f"{folder}: {len(written)} captures; next: quadfringe calibrate run --captures {folder} --out calibration.json")


@app.command("export")
def export_opencv(
    calibration: Annotated[Path, typer.Argument(metavar="FILE", help="Calibration to read, .json.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help=OpencvHelp)],
) -> None:
    """Write the camera and projectors of a calibration in the format of OpenCV."""
    from quadfringe.calibration.opencv_files import write_opencv
    from quadfringe.data import Calibration

    write_opencv(out, Calibration.load(calibration))
    say(str(out))


@app.command("import")
def import_opencv(
    file: Annotated[Path, typer.Argument(metavar="FILE", help=OpencvHelp)],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Calibration to write, .json.")],
) -> None:
    """Convert the camera and projectors of an OpenCV file into a calibration."""
    from quadfringe.calibration.opencv_files import read_opencv

    read_opencv(file).save(out)
    say(str(out))


app.command()(response)
