"""The controls of the live page. A page can send any value, so each is put within its limits where it is read."""

from __future__ import annotations

from math import isfinite
from typing import Any, Literal, TypeVar, get_args

from quadfringe.errors import InputError

__all__ = ["CLOUDS_PER_S", "Colouring", "Controls", "check_controls"]

Colouring = Literal["texture", "height", "quality"]
COLOURINGS: tuple[Colouring, ...] = get_args(Colouring)
CLOUDS_PER_S = 4.0  # the default: a browser without a graphics card keeps up with it
CLOUD_RATES = (0.1, 100.0)
STRIDES = ("1", "2", "4", "8", "16")
LARGEST_STRIDE = 64
Choice = TypeVar("Choice", bound=str)


class Controls:
    """Colouring, stride, rate of clouds, least quality, and whether the page holds still."""

    def __init__(self, gui: Any, stride: int, clouds_per_s: float, colouring: Colouring) -> None:
        self._first_rate = float(clouds_per_s)
        self._strides = sorted({str(stride), *STRIDES}, key=int)
        self._first_stride, self._first_colouring = str(stride), colouring
        self._colouring = gui.add_dropdown("Colour", COLOURINGS, initial_value=colouring)
        self._stride = gui.add_dropdown("Every n-th point", self._strides, initial_value=str(stride))
        self._clouds_per_s = gui.add_slider(
            "Clouds a second",
            min=min(1.0, clouds_per_s),
            max=max(20.0, clouds_per_s),
            step=0.5,
            initial_value=clouds_per_s,
        )
        self._quality = gui.add_slider("Least quality", min=0.0, max=1.0, step=0.05, initial_value=0.0)
        self._still = gui.add_checkbox("Hold still", initial_value=False)

    @property
    def colouring(self) -> Colouring:
        """What the colours of the points show."""
        return _one_of(COLOURINGS, self._colouring.value, self._first_colouring)

    @property
    def stride(self) -> int:
        """Every n-th pixel of every n-th row is shown, n >= 1."""
        return int(_one_of(self._strides, self._stride.value, self._first_stride))

    @property
    def clouds_per_s(self) -> float:
        """Largest number of clouds a second, 0.1 to 100."""
        return _within(CLOUD_RATES, self._clouds_per_s.value, self._first_rate)

    @property
    def quality(self) -> float:
        """Least quality of the points that are shown, 0 to 1."""
        return _within((0.0, 1.0), self._quality.value, 0.0)

    @property
    def still(self) -> bool:
        """Whether the page keeps its shape."""
        return self._still.value is True


def check_controls(stride: int, clouds_per_s: float, colouring: str) -> None:
    """Raise `InputError` for first values out of their limits."""
    if not (isinstance(stride, int) and 1 <= stride <= LARGEST_STRIDE):
        raise InputError(f"stride: expected a whole number from 1 to {LARGEST_STRIDE}, got {stride!r}")
    least, most = CLOUD_RATES
    if not (isinstance(clouds_per_s, int | float) and least <= clouds_per_s <= most):
        raise InputError(f"clouds_per_s: expected {least:g} to {most:g}, got {clouds_per_s!r}")
    if colouring not in COLOURINGS:
        raise InputError(f"colouring: expected {', '.join(COLOURINGS)}, got {colouring!r}")


def _one_of(choices: tuple[Choice, ...] | list[Choice], value: object, otherwise: Choice) -> Choice:
    return next((choice for choice in choices if choice == value), otherwise)


def _within(limits: tuple[float, float], value: object, otherwise: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        return otherwise
    return min(max(float(value), limits[0]), limits[1])
