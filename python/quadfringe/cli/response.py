"""`quadfringe calibrate response`: the response of channels, from files or by a walk-through on the bench."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._options import JsonOption
from quadfringe.cli._output import caution, say, table, write_figures
from quadfringe.cli._screens import say_picture_modes
from quadfringe.cli._system import CameraOption, system_of

if TYPE_CHECKING:
    from quadfringe.calibration.response import EstimatedResponse
    from quadfringe.config import SystemConfig
    from quadfringe.data import ResponseCalibration

__all__ = ["response"]

FORMULA = "linear = max(I / (1 - knee I^20) - offset, 0) ^ exponent"
STEPS = 16  # of a walk-through: harmonics up to the fourteenth are separated


class ChannelName(StrEnum):
    """The channel that a stack of images shows."""

    all = "all"
    red = "red"
    green = "green"
    blue = "blue"
    ir = "ir"


OutOption = Annotated[Path, typer.Option(metavar="FILE", help="Response to write, .json.")]
FilesArgument = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="[FILES...]",
        help="Images of one fringe pattern in the order of its phase shifts; several stacks may follow. Without them, "
        "--system or --camera: the steps are shown and taken here.",
    ),
]
StepsOption = Annotated[
    int | None, typer.Option(min=4, max=64, help="Number of equal phase shifts per period; default without FILES: 16.")
]
ChannelOption = Annotated[
    ChannelName, typer.Option(help="Channel that FILES show; all gives every channel this response.")
]
BaseOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Response file for the other channels, .json; default: linear.")
]
SystemOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="System file with projector and camera, .toml: show and take the steps."),
]
NumberOption = Annotated[float, typer.Option(min=1.0, help="Fringes over the projector width that --system shows.")]


def response(
    out: OutOption,
    files: FilesArgument = None,
    steps: StepsOption = None,
    channel: ChannelOption = ChannelName.all,
    base: BaseOption = None,
    system: SystemOption = None,
    camera: CameraOption = None,
    number: NumberOption = 8.0,
    json: JsonOption = None,
) -> None:
    """Estimate the response (gamma) of channels from an N-step capture: from FILES, or taken here with --system.

    With --system the projector shows each step, the camera takes it, and every channel gets its response. Put a matt
    white surface in front of the bench that fills the image; nothing may move.
    """
    from quadfringe.data import ResponseCalibration
    from quadfringe.errors import InputError
    from quadfringe.files import require_suffix

    require_suffix(out, (".json",))
    known = None if base is None else ResponseCalibration.load(base)
    config = system_of(system, camera)
    if files and config is not None:
        raise InputError("FILES are images that exist, and --system or --camera take new ones; give one of them")
    if not files and config is None:
        raise InputError("give the FILES of an N-step capture, or --system FILE to show and take the steps")
    if config is None:
        found = _from_files(files or [], steps, channel, known)
    elif channel is not ChannelName.all:
        raise InputError("--channel says what FILES show; --system takes all channels, so leave --channel out")
    else:
        found = _taken(config, STEPS if steps is None else steps, number, known, lambda words: say(words, json))
    found.calibration.save(out)
    table(f"{out}: {FORMULA}", found.figures, json)
    for words in found.doubts:
        caution(words)
    say(f'{out}: use it with decode --response, or [decode] response = "{out.name}" in the system file', json)
    write_figures(found.figures, json)


def _from_files(
    files: list[Path], steps: int | None, channel: ChannelName, known: ResponseCalibration | None
) -> EstimatedResponse:
    from quadfringe.calibration.response import estimate_from_files
    from quadfringe.errors import InputError

    if steps is None:
        raise InputError("--steps is missing: how many of the FILES make one stack?")
    return estimate_from_files(files, steps, None if channel is ChannelName.all else (channel.value,), known)


def _taken(
    config: SystemConfig, steps: int, number: float, known: ResponseCalibration | None, tell: Callable[[str], None]
) -> EstimatedResponse:
    """Show the steps and take them; a person puts the surface in place first, unless the bench is virtual."""
    from quadfringe.calibration.response import WalkThrough, estimate_from_steps, take_steps
    from quadfringe.devices.light import Levels
    from quadfringe.scanner import open_system

    # Files that this command leads to may be named already, and need not exist yet.
    linear = config.decode.model_copy(update={"response": "linear"})
    config = config.model_copy(update={"calibration": None, "decode": linear})
    projectors = config.projectors
    virtual = config.capture.kind == "virtual"
    infrared = virtual if projectors is None else projectors.infrared is not None
    with open_system(config) as scanner:
        say_picture_modes(scanner.projector, tell)
        if not virtual:
            scanner.projector.show(Levels((1.0,) * 4))
            tell("put a matt white surface that fills the image in front of the bench; no part may be saturated")
            typer.prompt("press Enter when everything is still", default="", show_default=False, err=True)
        beams = ("visible", "infrared") if infrared else ("visible",)
        taken = take_steps(scanner.projector, scanner.camera, WalkThrough(steps, number, beams), tell)
    return estimate_from_steps(taken, known)
