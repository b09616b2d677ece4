"""`quadfringe decode --steps`: the images of a reference measurement to absolute phase and shape."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._options import Bits

if TYPE_CHECKING:
    from quadfringe.data import Shape
    from quadfringe.decoding.reference import Channel
    from quadfringe.decoding.step_files import Order

__all__ = [
    "Beam",
    "BeamOption",
    "NumbersOption",
    "OrderOption",
    "StepOrder",
    "StepWords",
    "StepsOption",
    "from_steps",
    "step_words",
]


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


@dataclass(frozen=True)
class StepWords:
    """What the command line says about step images."""

    files: list[Path]
    numbers: list[float]
    steps: int | None
    order: StepOrder | None
    beam: Beam | None
    bits: Bits | None

    @property
    def given(self) -> bool:
        """Whether step images are meant."""
        return bool(self.steps or self.numbers or self.order or self.beam)


def step_words(
    sources: list[str] | None,
    numbers: list[float] | None,
    steps: int | None,
    order: StepOrder | None,
    beam: Beam | None,
    bits: Bits | None,
) -> StepWords:
    """Sort the words of the command line. An option takes one value, so the other numbers come among the files."""
    found, files = list(numbers or []), []
    for word in sources or []:
        if numbers and not Path(word).exists():
            with suppress(ValueError):
                found.append(float(word))
                continue
        files.append(Path(word))
    return StepWords(files, found, steps, order, beam, bits)


def from_steps(
    words: StepWords,
    projector_width: int,
    calibration: Path | None,
    response: str,
    others: Mapping[str, Any],
) -> Shape:
    """Read the images and decode them; `InputError` for any of the `others`, options that only a single shot has."""
    from quadfringe.decoding import StepSettings, decode_steps, read_steps
    from quadfringe.errors import DecodeWarning, InputError

    single = (name for name, value in others.items() if value is not None and name != "depth_range_mm")
    given = [f"--{name.replace('_', '-')}" for name in single]
    if given:
        raise InputError(f"{', '.join(given)}: only for a single shot; leave out, or leave out --steps and --numbers")
    if words.steps is None or not words.numbers or not words.files:
        raise InputError("step images need --steps N, --numbers N..., and their folder or FILES")
    order: Order = "step" if words.order is StepOrder.step else "frequency"
    stacks = read_steps(words.files, len(words.numbers), words.steps, order)
    full_scale = float(2 ** int(words.bits) - 1) if words.bits and stacks[0].dtype == "uint16" else None
    channel: Channel = "ir" if words.beam is Beam.infrared else "green"
    settings = StepSettings(channel, full_scale, depth_range_mm=others["depth_range_mm"])
    with warnings.catch_warnings():  # they are printed in the words of the shape
        warnings.simplefilter("ignore", DecodeWarning)
        return decode_steps(
            stacks, words.numbers, projector_width, calibration=calibration, response=response, settings=settings
        )
