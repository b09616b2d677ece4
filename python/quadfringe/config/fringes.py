"""Settings of the fringes: the table `[fringes]` of a system file.

>>> from quadfringe.config import Fringes
>>> Fringes(encoding="rgb").numbers
(36.0, 35.0, 30.0)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from quadfringe import _core
from quadfringe.config._base import SIZE_MAX, Model, NotNegative, Positive, checked

__all__ = ["CHANNELS", "NUMBERS", "Encoding", "Fringes", "fringe_numbers", "is_code"]

FringeNumbers = tuple[float, ...]
Encoding = Literal["rgb-ir", "rgb"]
# The channels of an encoding, and the numbers of fringes that it has by default.
CHANNELS: dict[Encoding, tuple[str, ...]] = {
    "rgb-ir": ("red", "green", "blue", "ir"),
    "rgb": ("red", "green", "blue"),
}
# How many fringe numbers an encoding may have.
COUNTS: dict[Encoding, tuple[int, ...]] = {"rgb-ir": (3,), "rgb": (2, 3)}
PAIR: FringeNumbers = (16.0, 15.0)  # two numbers that distinguish all columns
NUMBERS: dict[Encoding, FringeNumbers] = {"rgb-ir": (36.0, 35.0, 30.0), "rgb": (36.0, 35.0, 30.0)}


def _some(numbers: Any) -> Any:
    wanted = "expected three fringe numbers, such as (36, 35, 30), or two without infrared, such as (16, 15)"
    if isinstance(numbers, (str, bytes)) or not isinstance(numbers, Iterable):
        raise ValueError(wanted)
    found = tuple(numbers)
    if len(found) not in (2, 3):
        raise ValueError(wanted)
    return found


def is_code(numbers: Any) -> bool:
    """Tell whether these are the four numbers that `Fringes.code` gives for three colours of different numbers."""
    return isinstance(numbers, Sequence) and not isinstance(numbers, str) and len(numbers) == 4 and numbers[3] == 0


Numbers = Annotated[tuple[Positive, ...], BeforeValidator(_some)]


class Fringes(Model):
    """The fringes that the projectors show; the fringe numbers must distinguish all columns that light the scene."""

    numbers: Numbers = Field(
        default=NUMBERS["rgb-ir"],
        description="Fringes over the full projector width: of red and blue, of green, of infrared. For "
        '"rgb" of red, of green and of blue, by default 36, 35 and 30; or two, of red and blue in quadrature, and of '
        "green.",
    )
    encoding: Encoding = Field(
        default="rgb-ir",
        description='"rgb-ir": red and blue in quadrature, green, and infrared from a second projector; "rgb": without '
        "infrared, for one projector and any colour camera.",
    )
    columns_px: tuple[NotNegative, Positive] | None = Field(
        default=None,
        description="First and last projector column that can light the scene. Fewer columns permit more fringes, and "
        "no others are decoded. Absent: all columns.",
    )
    layout: Literal["regular", "diamond"] = Field(
        default="regular",
        description="Mirrors of the projectors: a regular grid, or the diamond array of a LightCrafter 4500.",
    )
    predeformed_z_mm: Positive | None = Field(
        default=None,
        description="Depth in mm of the plane for which the infrared image is pre-deformed (S11), from the calibration "
        "of both projectors. Absent: the image is plain. For projectors that are not quite coaxial.",
    )

    @model_validator(mode="before")
    @classmethod
    def _numbers_of_the_encoding(cls, values: Any) -> Any:
        if isinstance(values, Mapping) and "numbers" not in values and values.get("encoding") == "rgb":
            return {**values, "numbers": NUMBERS["rgb"]}
        return values

    @field_validator("columns_px")
    @classmethod
    def _columns_grow(cls, columns: tuple[float, float] | None) -> tuple[float, float] | None:
        if columns is not None and not columns[0] < columns[1] <= SIZE_MAX:
            raise ValueError(f"expected two growing columns of the projector, such as (200, 700), got {columns}")
        return columns

    @model_validator(mode="after")
    def _numbers_distinguish_columns(self) -> Fringes:
        count, encoding = len(self.numbers), self.encoding
        if count not in COUNTS[encoding]:
            raise ValueError(_other_count(count))
        if not self.quadrature and len(set(self.numbers)) < count:
            raise ValueError(
                f"numbers: expected three different numbers, of red, green and blue, got {_listed(self.numbers)}; "
                'encoding = "rgb" with two numbers, such as (16, 15), has one for red and blue'
            )
        if self.predeformed_z_mm is not None and not self.infrared:
            raise ValueError('predeformed_z_mm is of the infrared image, which encoding = "rgb" lacks; leave it out')
        # A wider projector forbids no further numbers, so that numbers that fail here fail for every projector.
        try:
            if self.columns_px is None:
                _core.check_code(self.code, SIZE_MAX)
        except ValueError:
            raise ValueError(
                "numbers: expected fringe numbers whose joint range covers the projector, such as "
                f"{_listed(NUMBERS[encoding] if count > len(PAIR) else PAIR)}, got {_listed(self.numbers)}"
            ) from None
        return self

    @property
    def infrared(self) -> bool:
        """Whether the encoding has an infrared channel."""
        return self.encoding == "rgb-ir"

    @property
    def quadrature(self) -> bool:
        """Whether red and blue have one fringe number and are in quadrature; else each colour has a number."""
        return self.infrared or len(self.numbers) == len(CHANNELS["rgb"]) - 1

    @property
    def code(self) -> FringeNumbers:
        """The numbers as functions of the kernel take them.

        They are `numbers`, and for three colours of different numbers also 0 for the infrared that is absent.
        """
        return self.numbers if self.quadrature else (*self.numbers, 0.0)

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels of a shot: red, green, blue, and ir of an encoding with infrared."""
        return CHANNELS[self.encoding]

    @property
    def channel_numbers(self) -> tuple[float, ...]:
        """The fringe number of each of the channels."""
        first, second, *third = self.numbers
        return (first, second, first, *third) if self.quadrature else self.numbers


def _listed(numbers: FringeNumbers) -> str:
    return f"({', '.join(f'{number:g}' for number in numbers)})"


def _other_count(count: int) -> str:
    """Say how many numbers the encoding with infrared has, and which encoding the given ones may be meant for."""
    return (
        f"numbers: expected three fringe numbers, such as (36, 35, 30), got {count}; without infrared set "
        'encoding = "rgb" (--encoding rgb)'
    )


class _SomeNumbers(Model):
    numbers: Numbers = Field(description="Fringe numbers, which need not distinguish all columns.")


def fringe_numbers(given: Any) -> FringeNumbers:
    """Give fringe numbers for one stage alone, as `Fringes.code`; raises `ConfigError` for anything else."""
    alone = is_code(given)
    numbers = checked(_SomeNumbers, {"numbers": given[:3] if alone else given}, "fringe numbers").numbers
    return (*numbers, 0.0) if alone else numbers
