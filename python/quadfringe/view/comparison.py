"""A page of pictures of a comparison: the difference, its slow part, its distribution, and what it depends on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare import MeshComparison, Profile, ShapeComparison
from quadfringe.view.report import Graph, Panel, draw_panels
from quadfringe.view.style import DIVERGING

__all__ = ["write_comparison"]

Comparison = ShapeComparison | MeshComparison
BINS = 80
RANGE_SPREADS = 4.0  # half the range of the colours, in robust spreads of the difference around 0
LETTERS_PER_LINE = 100
PROFILES = ("modulation", "albedo", "surface angle", "fringe phase", "image column", "image row")


def write_comparison(path: Path, title: str, found: Comparison) -> None:
    """Write the page of a comparison to a PNG; needs matplotlib (extra `plot`)."""
    unit = found.overall.unit
    range_ = _range(found)
    sign = "A less B" if isinstance(found, ShapeComparison) else "from the surface, + towards the camera"
    maps = [
        Panel(f"difference, {sign}", found.difference, unit, DIVERGING, (-range_, range_)),
        Panel("its slow part (form)", found.bands.form, unit, DIVERGING, (-range_, range_)),
        _returned(found) if isinstance(found, ShapeComparison) else _histogram(found, range_),
    ]
    graphs: list[Panel | Graph] = [_graph(found.profiles[name], unit) for name in PROFILES if name in found.profiles]
    if isinstance(found, ShapeComparison):
        graphs = [_histogram(found, range_), *graphs]
    rows: list[Sequence[Panel | Graph]] = [maps, *(graphs[i : i + 3] for i in range(0, len(graphs), 3))]
    draw_panels(path, "\n".join([title, *_lines(found)]), rows)


def _lines(found: Comparison) -> list[str]:
    one = found.overall
    words = (
        f"bias {one.bias:+.4g}, RMS {one.rms:.4g}, robust {one.robust_rms:.4g}, 95 % within {one.p95:.4g} {one.unit}"
    )
    causes = [f"{cause.name} ({cause.share:.0%}): {cause.evidence}" for cause in found.causes]
    return [words, *(line for cause in causes for line in wrap(cause, LETTERS_PER_LINE))]


def _range(found: Comparison) -> float:
    values = found.difference[np.isfinite(found.bands.form)]
    if not values.size:
        return 1.0
    spread = 1.4826 * float(np.median(np.abs(values)))
    return RANGE_SPREADS * spread if spread > 0 else 1.0


def _returned(found: ShapeComparison) -> Panel:
    """Draw where both return (2), near edges (1), and where the orders differ (3)."""
    both = np.isfinite(found.difference_rad)
    image: NDArray[np.float64] = np.where(both, 2.0, np.nan)
    image[both & found.edge] = 1.0
    image[found.wrong_order] = 3.0
    off = f"half a fringe off: {found.wrong_order_percent:.2g} %, dark"
    words = f"both return {found.both_percent:.2f} %, light near edges\n{off}"
    return Panel(words, image, "", "Blues", (0.0, 3.0))


def _histogram(found: Comparison, range_: float) -> Graph:
    values = found.difference[np.isfinite(found.bands.form)]
    counts, edges = np.histogram(values, BINS, (-range_, range_))
    middles = (edges[1:] + edges[:-1]) / 2
    share = 100 * counts / max(1, values.size)
    inside = " / ".join(f"{percent:.1f}" for percent in found.overall.inside_percent)
    name = f"inside 1 / 2 / 3 sigma: {inside} %"
    return Graph("distribution", f"difference, {found.overall.unit}", "% of the pixels", {name: (middles, share)})


def _graph(profile: Profile, unit: str) -> Graph:
    """Draw the bias over a quantity, between the robust spreads around it."""
    lines = {
        "median": (profile.at, profile.bias),
        "+ robust spread": (profile.at, profile.bias + profile.spread),
        "- robust spread": (profile.at, profile.bias - profile.spread),
    }
    return Graph(f"bias over {profile.name}", f"{profile.name}, {profile.unit}", unit, lines, limit=("no bias", 0.0))
