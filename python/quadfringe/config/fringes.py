"""Settings of the fringes: the table `[fringes]` of a system file.

>>> from quadfringe.config import Fringes
>>> Fringes(encoding="rgb").numbers
(16.0, 15.0)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from quadfringe import _core
from quadfringe.config._base import SIZE_MAX, Model, NotNegative, Positive, checked

__all__ = ["CHANNELS", "NUMBERS", "Encoding", "Fringes", "fringe_numbers"]

FringeNumbers = tuple[float, ...]
Encoding = Literal["rgb-ir", "rgb"]
# The channels of an encoding, and the numbers of fringes that it has by default.
CHANNELS: dict[Encoding, tuple[str, ...]] = {
    "rgb-ir": ("red", "green", "blue", "ir"),
    "rgb": ("red", "green", "blue"),
}
NUMBERS: dict[Encoding, FringeNumbers] = {"rgb-ir": (36.0, 35.0, 30.0), "rgb": (16.0, 15.0)}


def _some(numbers: Any) -> Any:
    wanted = "expected three fringe numbers, such as (36, 35, 30), or two without infrared, such as (16, 15)"
    if isinstance(numbers, (str, bytes)) or not isinstance(numbers, Iterable):
        raise ValueError(wanted)
    found = tuple(numbers)
    if len(found) not in (2, 3):
        raise ValueError(wanted)
    return found


Numbers = Annotated[tuple[Positive, ...], BeforeValidator(_some)]


class Fringes(Model):
    """The fringes that the projectors show; the fringe numbers must distinguish all columns that light the scene."""

    numbers: Numbers = Field(
        default=NUMBERS["rgb-ir"],
        description='Fringes over the full projector width: of red and blue, of green, of infrared; two for "rgb", by '
        "default 16 and 15.",
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
        if count != len(CHANNELS[encoding]) - 1:
            raise ValueError(_other_count(count, encoding))
        if self.predeformed_z_mm is not None and not self.infrared:
            raise ValueError('predeformed_z_mm is of the infrared image, which encoding = "rgb" lacks; leave it out')
        # A wider projector forbids no further numbers, so that numbers that fail here fail for every projector.
        try:
            if self.columns_px is None:
                _core.check_code(self.numbers, SIZE_MAX)
        except ValueError:
            raise ValueError(
                "numbers: expected fringe numbers whose joint range covers the projector, such as "
                f"{_listed(NUMBERS[encoding])}, got {_listed(self.numbers)}"
            ) from None
        return self

    @property
    def infrared(self) -> bool:
        """Whether the encoding has an infrared channel."""
        return self.encoding == "rgb-ir"

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels of a shot: red, green, blue, and ir of an encoding with infrared."""
        return CHANNELS[self.encoding]

    @property
    def channel_numbers(self) -> tuple[float, ...]:
        """The fringe number of each of the channels."""
        first, second, *third = self.numbers
        return (first, second, first, *third)


def _listed(numbers: FringeNumbers) -> str:
    return f"({', '.join(f'{number:g}' for number in numbers)})"


def _other_count(count: int, encoding: Encoding) -> str:
    """Say how many numbers the encoding has, and which encoding the given ones may be meant for."""
    if encoding == "rgb":
        return (
            'numbers: encoding = "rgb" has two fringe numbers, of red and blue, which are in quadrature, and of green, '
            f"such as (16, 15), and got {count}; give two, or leave the encoding out for a bench with infrared"
        )
    return (
        f"numbers: expected three fringe numbers, such as (36, 35, 30), got {count}; without infrared set "
        'encoding = "rgb" (--encoding rgb)'
    )


class _SomeNumbers(Model):
    numbers: Numbers = Field(description="Fringe numbers, which need not distinguish all columns.")


def fringe_numbers(given: Any) -> FringeNumbers:
    """Give two or three fringe numbers for one stage alone; raises `ConfigError` for anything else."""
    return checked(_SomeNumbers, {"numbers": given}, "fringe numbers").numbers
