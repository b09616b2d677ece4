"""`quadfringe decode --steps`: the images of a reference measurement to absolute phase and shape."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._options import Bits

if TYPE_CHECKING:
    from quadfringe.data import Shape
    from quadfringe.decoding.reference import Channel

__all__ = ["Beam", "BeamOption", "NumbersOption", "OrderOption", "StepOrder", "StepWords", "StepsOption", "decoded_steps", "separated"]


class StepOrder(StrEnum):
    """How the images of a reference measurement follow each other."""

    frequency = "frequency"
    step = "step"


class Beam(StrEnum):
    """The projector that shows the steps."""

    visible = "visible"
    infrared = "infrared"


BeamOption = Annotated[
    Beam | None, typer.Option(help="Projector that shows the steps; default: visible. Its calibration is used.")
]
StepsOption = Annotated[
    int | None,
    typer.Option(
        min=3, help="Number of equal phase shifts at each of the --numbers; FILES are then the images of all steps."
    ),
]
NumbersOption = Annotated[
    list[float] | None,
    typer.Option(
        metavar="N...",
        help="Numbers of fringes over the projector width of the --steps, one or more; the phase is that of the first.",
    ),
]
OrderOption = Annotated[
    StepOrder | None,
    typer.Option(
        help="Whether all steps of one of the --numbers follow each other (frequency, the default) or the numbers "
        "alternate (step).",
    ),
]
def separated(sources: list[str] | None, numbers: list[float] | None) -> tuple[list[float], list[Path]]:
    """Give the fringe numbers and the files: an option takes one value, so the numbers after the first come as files."""
    found, files = list(numbers or []), []
    for word in sources or []:
        if numbers and not Path(word).exists():
            with suppress(ValueError):
                found.append(float(word))
                continue
        files.append(Path(word))
    return found, files


@dataclass(frozen=True)
class StepWords:
    """What the command line says about step images."""

    files: list[Path]
    numbers: list[float]
    steps: int | None
    order: StepOrder | None
    beam: Beam | None
    bits: Bits | None


def decoded_steps(
    words: StepWords,
    projector_width: int,
    calibration: Path | None,
    response: str,
    others: Mapping[str, object],
) -> Shape:
    """Read the images and decode them; `InputError` for any of the `others`, options that only a single shot has."""
    from quadfringe.decoding import StepSettings, decode_steps, read_steps
    from quadfringe.errors import InputError

    given = [f"--{name.replace('_', '-')}" for name, value in others.items() if value is not None]
    if given:
        raise InputError(f"{', '.join(given)}: only for a single shot; leave out, or leave out --steps and --numbers")
    if words.steps is None or not words.numbers or not words.files:
        raise InputError("step images need --steps N, --numbers N..., and their folder or FILES")
    order = (words.order or StepOrder.frequency).value
    stacks = read_steps(words.files, len(words.numbers), words.steps, order)
    wide = words.bits is not None and stacks[0].dtype.itemsize == 2
    channel: Channel = "ir" if words.beam is Beam.infrared else "green"
    settings = StepSettings(channel=channel, full_scale=float(2 ** int(words.bits) - 1) if wide and words.bits else None)
    return decode_steps(
        stacks, words.numbers, projector_width, calibration=calibration, response=response, settings=settings
    )
