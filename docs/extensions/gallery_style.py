"""The look of the pictures in the gallery: light on a dark ground, so that surfaces and fringes stand out."""

from __future__ import annotations

from typing import Any

from cycler import cycler
from matplotlib import rcParams, rcParamsDefault

# The ground is that of `quadfringe.view.movie.solid_picture`.
GROUND, INK, FAINT = "#181818", "#dfe3ea", "#8b95a5"
# Told apart by people who see no red or green as well, and bright enough for the ground.
CYCLE = ("#5ec8cf", "#f2a65a", "#e58fc0", "#9bd770", "#8fa8ff", "#f4e285")
LOOK: dict[str, Any] = {
    "figure.facecolor": GROUND,
    "figure.figsize": (9.6, 4.2),
    "figure.dpi": 100,
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.h_pad": 0.12,
    "figure.constrained_layout.w_pad": 0.08,
    "figure.titlesize": 12,
    "savefig.facecolor": GROUND,
    "savefig.dpi": 100,
    "font.family": ["DejaVu Sans"],
    "font.size": 9.5,
    "text.color": INK,
    "axes.facecolor": GROUND,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.titlelocation": "left",
    "axes.titlesize": 10.5,
    "axes.linewidth": 0.8,
    "axes.grid": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.prop_cycle": cycler(color=CYCLE),
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "grid.color": "#2b323d",
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "image.interpolation": "antialiased",
    "image.cmap": "viridis",
}


def apply(_settings: Any, _script: str) -> None:
    """Set the look before each script; sphinx-gallery calls this."""
    rcParams.update(rcParamsDefault)
    rcParams.update(LOOK)
