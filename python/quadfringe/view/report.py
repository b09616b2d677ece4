"""Pages of panels and graphs as PNG.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from quadfringe.view.report import Graph, Panel, draw_panels, drawn
>>> depth_mm = np.linspace(790, 810, 48).reshape(6, 8)
>>> row = Graph("row", "column, px", "depth, mm", {"row 3": (np.arange(8), depth_mm[3])})
>>> panels = [Panel("depth", depth_mm, "mm"), row]
>>> len(drawn(panels[0], (3.0, 2.0), 72)) > 1000  # a PNG
True
>>> with TemporaryDirectory() as folder:
...     draw_panels(Path(folder) / "page.png", "two panels", [panels])
...     (Path(folder) / "page.png").stat().st_size > 1000
True
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot
from quadfringe.files import atomic
from quadfringe.view.style import below, lettered, mark_no_data, no_data_of, styled

__all__ = ["Drawable", "Graph", "Panel", "draw_panels", "drawn"]

LEGEND_LETTERS, HANDLE_LETTERS = 58, 8  # of a line of a legend below a graph, and of the sign before each name
TITLE_LETTERS = 11  # of a title, for each inch of a panel
PANEL_INCHES = (4.3, 3.1)  # width of a panel with its labels and colour bar, height of a graph without its legend
IMAGE_INCHES = 2.6  # greatest height of the image in a panel
AROUND_INCHES = (1.5, 0.95)  # width of the labels and the colour bar around an image; height of title, labels, legend
TITLE_INCHES = 0.3
LINE_INCHES = 0.17  # height of a line of a legend


class Drawable(Protocol):
    """A panel of a page: a title, the width and height in inches that it needs, and how it is drawn.

    >>> from quadfringe.view.report import Drawable, Graph
    >>> one: Drawable = Graph("row", "column, px", "depth, mm", {})
    >>> one.title
    'row'
    """

    @property
    def title(self) -> str:
        """Title, without a letter."""

    @property
    def inches(self) -> tuple[float, float]:
        """Width and height with all that is around it."""

    def draw(self, figure: Any, axes: Any, title: str | None = None) -> None:
        """Draw it; `title` replaces the title, such as by one with a letter."""


class Panel:
    """One picture of a page: an array with title, unit, colour map and range; the default range skips outliers.

    Missing data have a colour that no value has, and are named where there are any. A picture that is no map of pixels
    is `bare`: it has no axes.
    """

    def __init__(
        self,
        title: str,
        image: NDArray[Any],
        unit: str = "",
        colours: str = "viridis",
        limits: tuple[float, float] | None = None,
        *,
        bare: bool = False,
    ) -> None:
        self.title, self.image, self.unit, self.bare = title, image, unit, bare
        self.colours, self.limits = colours, limits or _limits(image)

    @property
    def inches(self) -> tuple[float, float]:
        """Width and height that the picture needs with all that is around it."""
        rows, columns = self.image.shape[:2]
        height = min(IMAGE_INCHES, (PANEL_INCHES[0] - AROUND_INCHES[0]) * rows / columns)
        return height * columns / rows + AROUND_INCHES[0], height + AROUND_INCHES[1]

    def draw(self, figure: Any, axes: Any, title: str | None = None) -> None:
        """Draw the picture with its colour bar; `title` replaces the title, such as by one with a letter."""
        low, high = self.limits
        drawn = axes.imshow(self.image, cmap=self.colours, vmin=low, vmax=high, interpolation="nearest")
        axes.set_title(_wrapped(self.title if title is None else title, self.inches[0]), loc="left", parse_math=False)
        if self.bare:
            axes.set_axis_off()
            return
        axes.set(xlabel="column, px", ylabel="row, px")
        for side in ("top", "right"):
            axes.spines[side].set_visible(True)
        if self.image.ndim == 2 and not np.isfinite(self.image).all():
            mark_no_data(figure, axes, no_data_of(self.colours))
        if self.unit:
            place = axes.inset_axes((1.03, 0.0, 0.045, 1.0))  # as high as the image, whatever its shape
            bar = figure.colorbar(drawn, cax=place, extend=_beyond(self.image, self.limits))
            bar.set_label(self.unit, parse_math=False)
            bar.outline.set_linewidth(0.5)


@dataclass(frozen=True)
class Graph:
    """Lines or points, x and y by name, over a common axis; `limit` is a named dashed line.

    `spread` adds symmetric error bars to the points of that name; `ticks` name the x positions 0, 1, 2 and so on.
    `marks` are named vertical lines, `dots` the names that are drawn as points, `colours` those of lines by name. The
    legend stands below the axes, where it hides nothing; a line without name is not in it.
    """

    title: str
    x_label: str
    y_label: str
    lines: Mapping[str, tuple[NDArray[Any], NDArray[Any]]]
    limit: tuple[str, float] | None = None
    log: bool = False
    points: bool = False
    spread: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    ticks: Sequence[str] = ()
    log_x: bool = False
    y_limits: tuple[float, float] | None = None
    dots: Sequence[str] = ()
    colours: Mapping[str, str] = field(default_factory=dict)
    marks: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def inches(self) -> tuple[float, float]:
        """Width and height that the graph needs with its legend."""
        names = [*self.lines, *([self.limit[0]] if self.limit else []), *self.marks]
        lines = -(-len(names) // _legend_columns(names))
        return PANEL_INCHES[0], PANEL_INCHES[1] + LINE_INCHES * lines

    def draw(self, figure: Any, axes: Any, title: str | None = None) -> None:
        """Draw the lines with a legend below them; `title` replaces the title, such as by one with a letter."""
        for name, (x, y) in self.lines.items():
            marker = "." if len(x) < 50 else None
            if name in self.spread:
                axes.errorbar(x, y, yerr=self.spread[name], label=name, fmt="o", capsize=3)
                continue
            bare = self.points or name in self.dots
            axes.plot(
                x,
                y,
                label=name,
                linewidth=0 if bare else 1.1,
                marker="." if bare else marker,
                color=self.colours.get(name),
            )
        if self.ticks:
            axes.set_xticks(range(len(self.ticks)), self.ticks)
            axes.set_xlim(-0.5, len(self.ticks) - 0.5)
            axes.axhline(0, color="black", linewidth=0.5)
        if self.limit is not None:
            axes.axhline(self.limit[1], color="black", linestyle="--", linewidth=0.9, label=self.limit[0])
        for (name, places), dashes in zip(self.marks.items(), ("-.", ":") * len(self.marks), strict=False):
            for i, at in enumerate(places):
                axes.axvline(at, color="black", linestyle=dashes, linewidth=0.9, label="" if i else name)
        if self.log:
            axes.set_yscale("log")
        if self.log_x:
            axes.set_xscale("log")
        if self.y_limits is not None:
            axes.set_ylim(*self.y_limits)
        axes.set_title(_wrapped(self.title if title is None else title, self.inches[0]), loc="left", parse_math=False)
        axes.set_xlabel(self.x_label, parse_math=False)
        axes.set_ylabel(self.y_label, parse_math=False)
        axes.grid(color="#e4e4e4", linewidth=0.6)
        axes.set_axisbelow(True)
        self._legend(figure, axes)

    def _legend(self, figure: Any, axes: Any) -> None:
        handles, names = axes.get_legend_handles_labels()
        columns = _legend_columns(names)
        if names:
            axes.legend(
                handles, names, loc="upper left", bbox_to_anchor=(0.0, 0.0), ncols=columns, **below(figure, axes)
            )


def _wrapped(title: str, inches: float) -> str:
    """Break a title into lines that fit the width of its panel."""
    return "\n".join(fill(line, round(TITLE_LETTERS * inches)) for line in title.split("\n"))


def _legend_columns(names: Sequence[str]) -> int:
    longest = max((len(name) for name in names), default=0)
    return max(1, min(len(names), LEGEND_LETTERS // (longest + HANDLE_LETTERS)))


def _limits(image: NDArray[Any]) -> tuple[float, float]:
    finite = image[np.isfinite(image)]
    if not finite.size:
        return (0.0, 1.0)
    low, high = (float(v) for v in np.quantile(finite, (0.005, 0.995)))
    return (low, high if high > low else low + 1.0)


def _beyond(image: NDArray[Any], limits: tuple[float, float]) -> str:
    """Say at which ends of the colour bar values lie beyond it, in the words of matplotlib."""
    finite = image[np.isfinite(image)]
    low, high = bool((finite < limits[0]).any()), bool((finite > limits[1]).any())
    return {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[low, high]


def draw_panels(path: Path, title: str, rows: Sequence[Sequence[Drawable]]) -> None:
    """Write rows of panels and graphs, lettered (a), (b) and so on, to one PNG; needs matplotlib (extra `plot`)."""
    columns = max(len(row) for row in rows)
    widths = [max(row[j].inches[0] for row in rows if j < len(row)) for j in range(columns)]
    heights = [max(panel.inches[1] for panel in row) for row in rows]
    with styled():
        figure = _figure((sum(widths), sum(heights) + TITLE_INCHES * (1 + title.count("\n"))))
        figure.suptitle(title, parse_math=False)
        grid = figure.add_gridspec(len(rows), columns, width_ratios=widths, height_ratios=heights)
        places = [(i, j) for i, row in enumerate(rows) for j in range(len(row))]
        for number, (i, j) in enumerate(places):
            panel = rows[i][j]
            panel.draw(figure, figure.add_subplot(grid[i, j]), lettered(number, panel.title))
        with atomic(path) as temporary:
            figure.savefig(temporary, format="png")


def drawn(panel: Drawable, inches: tuple[float, float], dpi: int) -> bytes:
    """Give one panel or graph as the bytes of a PNG of this width and height; needs matplotlib (extra `plot`)."""
    with styled():
        figure = _figure(inches)
        panel.draw(figure, figure.add_subplot())
        stream = BytesIO()
        figure.savefig(stream, format="png", dpi=dpi)
    return stream.getvalue()


def _figure(inches: tuple[float, float]) -> Any:
    from matplotlib.figure import Figure

    return Figure(figsize=inches, layout="constrained")


def fringe_panels(shot: AnyShot) -> list[Panel]:
    """Return panels of the four channels as captured."""
    full = (0.0, shot.full_scale_value)
    return [Panel(f"captured {name}", image, "counts", "gray", full) for name, image in shot.channels.items()]
