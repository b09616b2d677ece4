"""The controls of the live page. A page can send any value, so each is put within its limits where it is read."""

from __future__ import annotations

from math import isfinite
from typing import Any, Literal, TypeVar, get_args

from quadfringe.errors import InputError
from quadfringe.view.colours import COLOURINGS, Colouring

__all__ = [
    "CLOUDS_PER_S",
    "DRAWN",
    "STRIDES",
    "Colouring",
    "Controls",
    "Drawn",
    "check_choice",
    "check_controls",
    "one_of",
    "within",
]

Drawn = Literal["surface", "points"]
DRAWN: tuple[Drawn, ...] = get_args(Drawn)
# Points are the default of the live page: a browser without a graphics card shows 1.3 surfaces and 1.9 pictures per
# second, or 3.2 clouds and 6.6 pictures, on a machine with other load (python benches/live.py --browser [--surface]).
CLOUDS_PER_S = 4.0  # the default: a browser without a graphics card keeps up with it
CLOUD_RATES = (0.1, 100.0)
STRIDES = ("1", "2", "4", "8", "16")
LARGEST_STRIDE = 64
Choice = TypeVar("Choice", bound=str)


class Controls:
    """What is drawn, colouring, stride, rate of clouds, least quality, and whether the page holds still."""

    def __init__(self, gui: Any, stride: int, clouds_per_s: float, colouring: Colouring, drawn: Drawn) -> None:
        self._first_rate = float(clouds_per_s)
        self._strides = sorted({str(stride), *STRIDES}, key=int)
        self._first_stride, self._first_colouring, self._first_drawn = str(stride), colouring, drawn
        self._drawn = gui.add_dropdown("Show", DRAWN, initial_value=drawn)
        self._colouring = gui.add_dropdown("Colour", COLOURINGS, initial_value=colouring)
        self._stride = gui.add_dropdown("Every n-th point", self._strides, initial_value=str(stride))
        self._clouds_per_s = gui.add_slider(
            "Shapes a second",
            min=min(1.0, clouds_per_s),
            max=max(20.0, clouds_per_s),
            step=0.5,
            initial_value=clouds_per_s,
        )
        self._quality = gui.add_slider("Least quality", min=0.0, max=1.0, step=0.05, initial_value=0.0)
        self._still = gui.add_checkbox("Hold still", initial_value=False)

    @property
    def surface(self) -> bool:
        """Whether the surface is drawn, and not points."""
        return one_of(DRAWN, self._drawn.value, self._first_drawn) == "surface"

    @property
    def colouring(self) -> Colouring:
        """What the colours of the points show."""
        return one_of(COLOURINGS, self._colouring.value, self._first_colouring)

    @property
    def stride(self) -> int:
        """Every n-th pixel of every n-th row is shown, n >= 1."""
        return int(one_of(self._strides, self._stride.value, self._first_stride))

    @property
    def clouds_per_s(self) -> float:
        """Largest number of clouds a second, 0.1 to 100."""
        return within(CLOUD_RATES, self._clouds_per_s.value, self._first_rate)

    @property
    def quality(self) -> float:
        """Least quality of the points that are shown, 0 to 1."""
        return within((0.0, 1.0), self._quality.value, 0.0)

    @property
    def still(self) -> bool:
        """Whether the page keeps its shape."""
        return self._still.value is True


def check_controls(stride: int, clouds_per_s: float, colouring: str, drawn: str) -> None:
    """Raise `InputError` for first values out of their limits."""
    if not (isinstance(stride, int) and 1 <= stride <= LARGEST_STRIDE):
        raise InputError(f"stride: expected a whole number from 1 to {LARGEST_STRIDE}, got {stride!r}")
    least, most = CLOUD_RATES
    if not (isinstance(clouds_per_s, int | float) and least <= clouds_per_s <= most):
        raise InputError(f"clouds_per_s: expected {least:g} to {most:g}, got {clouds_per_s!r}")
    check_choice("colouring", colouring, COLOURINGS)
    check_choice("drawn", drawn, DRAWN)


def check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    """Raise `InputError` for a value that is none of the choices."""
    if value not in choices:
        raise InputError(f"{name}: expected {', '.join(choices)}, got {value!r}")


def one_of(choices: tuple[Choice, ...] | list[Choice], value: object, otherwise: Choice) -> Choice:
    """Give the choice that a page sent, or another one when it sent none of them."""
    return next((choice for choice in choices if choice == value), otherwise)


def within(limits: tuple[float, float], value: object, otherwise: float) -> float:
    """Give the number that a page sent, put within its limits, or another one when it sent no number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        return otherwise
    return min(max(float(value), limits[0]), limits[1])
