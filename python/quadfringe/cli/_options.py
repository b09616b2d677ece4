"""Command line options that several commands share."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from quadfringe.config import DecodeConfig, Fringes

__all__ = [
    "METHODS",
    "AllowHostOption",
    "Bayer",
    "Bits",
    "BitsOption",
    "BoardPosesOption",
    "CalibrationOption",
    "ChannelsOfCode",
    "Colouring",
    "ColumnRangeOption",
    "ColumnsOption",
    "EncodingOption",
    "FileSizeOption",
    "FringesOfShotOption",
    "FringesOption",
    "HostOption",
    "InstantsOption",
    "JsonOption",
    "OutFolder",
    "PeriodOption",
    "PortOption",
    "PredeformedOption",
    "ShotsOption",
    "SystemFile",
    "VirtualSystemOption",
    "decode_settings",
    "fringes_from",
    "in_words",
    "joined_numbers",
    "method_named",
    "one_or_two",
]


class Bayer(StrEnum):
    """Filter colours of a Bayer chip: the first two pixels of the first row, then those of the second row."""

    rggb = "rggb"
    grbg = "grbg"
    gbrg = "gbrg"
    bggr = "bggr"


class Bits(StrEnum):
    """Significant bits of 16-bit files."""

    eight = "8"
    nine = "9"
    ten = "10"
    eleven = "11"
    twelve = "12"
    thirteen = "13"
    fourteen = "14"
    fifteen = "15"
    sixteen = "16"


class Colouring(StrEnum):
    """What the colours of a page show: the surface itself, depth, quality, or uncertainty."""

    texture = "texture"
    height = "height"
    quality = "quality"
    uncertainty = "uncertainty"


JsonOption = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", help="Write the figures as JSON to this file; - writes to standard output."),
]
BitsOption = Annotated[
    Bits | None, typer.Option(help="Significant bits of 16-bit files; default: 16. Use it for cameras of 8 to 14 bits.")
]
OutFolder = Annotated[Path, typer.Option(metavar="DIR", help="Folder for the files; created when it is missing.")]
SystemFile = Annotated[
    Path | None, typer.Argument(metavar="[SYSTEM.toml]", help="System file; without one, the virtual bench.")
]
VirtualSystemOption = Annotated[
    Path | None,
    typer.Option(
        "--system", metavar="FILE", help="System file of the virtual bench, .toml; default: the built-in one."
    ),
]


class ChannelsOfCode(StrEnum):
    """The channels of a shot: three colours and infrared, or three colours of one projector."""

    rgb_ir = "rgb-ir"
    rgb = "rgb"


class SomeNumbers(tuple[float, ...]):
    """The numbers of one option, whose count may differ."""


def _some_numbers(words: str) -> SomeNumbers:
    """Read the numbers of one option; the settings check their count."""
    try:
        return SomeNumbers(float(word) for word in words.split())
    except ValueError:
        raise typer.BadParameter(f"expected numbers, such as 36 35 30, got {words!r}") from None


def joined_numbers(words: list[str]) -> list[str]:
    """Join the numbers after an option that has as many as the encoding needs to one word; an option takes one."""
    for option, most in SEVERAL_NUMBERS.items():
        if option in words:
            first = words.index(option) + 1
            count = 0
            while count < most and first + count < len(words) and _is_number(words[first + count]):
                count += 1
            if count:
                words = [*words[:first], " ".join(words[first : first + count]), *words[first + count :]]
    return words


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


FRINGES_3 = (36.0, 35.0, 30.0)
# Options, and how many numbers they have at most.
SEVERAL_NUMBERS = {"--fringes": 3, "--channel-instants-us": 4, "--period-px": 2}
FRINGES_HELP = (
    "Number of fringes over the projector width: of red and blue, of green, of infrared; with --encoding rgb "
    "of red, green, blue, or two: of red and blue in quadrature, and of green."
)
FringesOption = Annotated[
    SomeNumbers | None,
    typer.Option("--fringes", metavar="N N [N]", parser=_some_numbers, help=f"{FRINGES_HELP} Default: 36 35 30."),
]
# Of images that were taken before, nobody but the user knows the numbers: other ones give a wrong shape.
FringesOfShotOption = Annotated[
    SomeNumbers | None,
    typer.Option(
        "--fringes",
        metavar="N N [N]",
        parser=_some_numbers,
        help=f"{FRINGES_HELP} Required for a single shot; step images have --numbers instead.",
    ),
]
InstantsOption = Annotated[
    SomeNumbers | None,
    typer.Option(
        "--channel-instants-us",
        metavar="R G B [IR]",
        parser=_some_numbers,
        help="Time at which each channel is exposed, us, relative to the instant of the result; use it for moving "
        "objects when the projector shows the colours one after another. Default: all at once.",
    ),
]
PeriodOption = Annotated[
    SomeNumbers | None,
    typer.Option(
        "--period-px",
        metavar="PX [PX]",
        parser=_some_numbers,
        help="Fringe period across the fringes, camera pixels, or the shortest and the longest one; default: estimated "
        "from the shot. Give it if the estimate fails, as on an object narrower than two fringes.",
    ),
]
EncodingOption = Annotated[
    ChannelsOfCode | None,
    typer.Option(
        "--encoding", help="rgb-ir (default) has infrared of a second projector; rgb is for one projector without."
    ),
]
ColumnRangeOption = Annotated[
    tuple[float, float] | None,
    typer.Option(
        "--columns",
        metavar="PX PX",
        help="First and last projector column that can light the scene; fewer columns permit more fringes. Default: "
        "all.",
    ),
]
ColumnsOption = Annotated[
    int, typer.Option("--projector-width", min=2, help="Columns of the projector that the fringes cover, px.")
]
CalibrationOption = Annotated[
    Path | None,
    typer.Option("--calibration", metavar="FILE", help="Calibration, .json; needed for millimetres."),
]
PredeformedOption = Annotated[
    float | None,
    typer.Option(
        "--predeformed-z-mm",
        min=1.0,
        metavar="MM",
        help="Depth of the reference plane, mm, for which the infrared pattern is pre-deformed; leave it out for "
        "coaxial projectors.",
    ),
]
BoardPosesOption = Annotated[
    int, typer.Option("--poses", min=4, max=60, help="Number of poses of the calibration board; 9 to 15 are good.")
]
ShotsOption = Annotated[int | None, typer.Option(min=1, help="Stop after this many shots; default: no limit.")]
FileSizeOption = Annotated[
    float | None,
    typer.Option(
        "--file-gb", min=0.01, help="Start a new file when one reaches this size, GB; default: one file of any size."
    ),
]
HostOption = Annotated[
    str,
    typer.Option(
        help="Address of this machine that the page is served on; 0.0.0.0 shows it to everybody in the network who has "
        "the token."
    ),
]
AllowHostOption = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME", help="A further host name under which the page may be opened; may be repeated."),
]
PortOption = Annotated[
    int, typer.Option(min=1, max=65535, help="Port of the page; when it is taken, the next free port is used.")
]
METHODS = "joint|published"


def method_named(name: str) -> str:
    """Return the method with this name; "best" is the name of joint in older scripts."""
    if name not in (*METHODS.split("|"), "best"):
        raise typer.BadParameter(f"expected {METHODS.replace('|', ' or ')}, got {name!r}")
    return "joint" if name == "best" else name


def fringes_from(
    encoding: ChannelsOfCode | None,
    numbers: tuple[float, ...] | None,
    columns_px: tuple[float, float] | None,
    **others: Any,
) -> Fringes:
    """Make the fringes of the options that were given; an error names the option."""
    from quadfringe.config import Fringes, checked

    values = {"encoding": encoding and encoding.value, "numbers": numbers, "columns_px": columns_px} | others
    return checked(Fringes, {name: value for name, value in values.items() if value is not None}, "--fringes")


def in_words(error: typer.BadParameter) -> str:
    """Give the message for a refused value of an option: what was expected, and what was given."""
    problems = getattr(error.__cause__, "errors", None)
    if problems is None:
        return error.message
    from quadfringe.config import reason

    problem = problems(include_url=False)[0]
    chosen = re.fullmatch(r"(?:Value error, )?('.*') is not one of (.*?)\.?", problem["msg"])
    return f"expected one of {chosen[2]}, got {chosen[1]}" if chosen else reason(problem)


def one_or_two(values: tuple[float, ...] | None) -> float | tuple[float, ...] | None:
    """Give the only one of several values as a number, as settings have it."""
    return values[0] if values and len(values) == 1 else values


def decode_settings(options: Mapping[str, Any]) -> DecodeConfig:
    """Make settings of the options that were given; an error names the options as they are typed."""
    from quadfringe.config import DecodeConfig, checked
    from quadfringe.errors import ConfigError

    given = {name: value for name, value in options.items() if value is not None}
    try:
        return checked(DecodeConfig, given, "options")
    except ConfigError as error:
        words = re.sub(r'\b(\w+) = "(\w+)"', r"--\1 \2", str(error))
        for name in options.keys() - {"method"}:  # the messages also use this one as a word
            words = re.sub(rf"(?<!-)\b{name}\b", f"--{name.replace('_', '-')}", words)
        raise ConfigError(words) from None
