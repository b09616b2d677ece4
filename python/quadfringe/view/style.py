"""The look of every picture that is drawn with matplotlib: one type face, thin lines, and colours that tell the truth.

Pictures are drawn inside `styled`. `NO_DATA` is the colour of pixels without data: a grey that no colour map of
`MAPS` contains, so that it cannot be taken for zero or for any other value. Differences use `DIVERGING`, whose zero is
white, over limits from `symmetric`.

>>> from quadfringe.view.style import lettered, symmetric
>>> lettered(27, "depth")
'(ab) depth'
>>> symmetric([[-1.0, 0.5]], share=1)
(-1.0, 1.0)
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from quadfringe.errors import require

__all__ = [
    "CHANNELS",
    "CYCLE",
    "DIVERGING",
    "MAPS",
    "NO_DATA",
    "NO_DATA_ON_GREY",
    "below",
    "lettered",
    "mark_no_data",
    "no_data_of",
    "styled",
    "symmetric",
]

NO_DATA = "#7f7f7f"
NO_DATA_ON_GREY = "#5a86b8"  # in grey pictures
DIVERGING = "RdBu_r"  # white at zero
MAPS = ("viridis", "viridis_r", "turbo", "magma", "twilight", "Blues", "Greens", DIVERGING)
# Told apart by people who see no red or green as well (Okabe and Ito).
CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
CHANNELS = ("#d55e00", "#009e73", "#0072b2", "#555555")  # of R, G, B, IR
LETTERS = "abcdefghijklmnopqrstuvwxyz"
BELOW_POINTS = 31.0  # from the axes to a legend below it: past the numbers and the label of x
LOOK: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["Liberation Sans", "Arial", "Helvetica", "DejaVu Sans"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "lines.linewidth": 1.1,
    "lines.markersize": 3.5,
    "figure.titlesize": 12.0,
    "savefig.dpi": 110,
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw in the style of the package; needs matplotlib (extra `plot`). Create and save the figure inside."""
    require("matplotlib", "plot")
    from cycler import cycler
    from matplotlib import rc_context

    look: Any = LOOK | {"axes.prop_cycle": cycler(color=CYCLE)}
    with rc_context(look):
        yield


def lettered(number: int, title: str) -> str:
    """Give a title with the letter of the panel: (a) for 0, (b) for 1, (aa) for 26."""
    high, low = divmod(number, len(LETTERS))
    return f"({LETTERS[high - 1] if high else ''}{LETTERS[low]}) {title}"


def symmetric(*maps: ArrayLike, share: float = 0.995, least: float = 1e-6) -> tuple[float, float]:
    """Give limits about zero that hold this share of the values of each map; (-`least`, `least`) without any."""
    top = least
    for one in maps:
        size = np.abs(np.asarray(one, np.float64))
        finite = size[np.isfinite(size)]
        top = max(top, float(np.quantile(finite, share))) if finite.size else top
    return (-top, top)


def no_data_of(colours: str) -> str:
    """Give the colour of missing data for a colour map."""
    return NO_DATA_ON_GREY if colours in ("gray", "grey") else NO_DATA


def below(figure: Any, axes: Any) -> dict[str, Any]:
    """Give the placement of a legend below the axes and its label, where it hides no curve."""
    from matplotlib.transforms import ScaledTranslation

    moved = axes.transAxes + ScaledTranslation(0.0, -BELOW_POINTS / 72, figure.dpi_scale_trans)
    return {"bbox_transform": moved, "borderaxespad": 0.0}


def mark_no_data(figure: Any, axes: Any, colour: str = NO_DATA) -> None:
    """Paint the ground of an image in the colour of missing data, and name the colour below it."""
    from matplotlib.patches import Patch

    axes.set_facecolor(colour)
    patch = Patch(facecolor=colour, label="no data")
    axes.legend(handles=[patch], loc="upper right", bbox_to_anchor=(1.0, 0.0), handlelength=1.0, **below(figure, axes))
