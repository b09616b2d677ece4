"""Report of one shot as a PNG: fringes, wrapped phases, absolute phase, depth and error.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from quadfringe.view.report import Graph, Panel, draw_panels, drawn, write_report
>>> depth_mm = np.linspace(790, 810, 48).reshape(6, 8)
>>> row = Graph("row", "column, px", "depth, mm", {"row 3": (np.arange(8), depth_mm[3])})
>>> panels = [Panel("depth", depth_mm, "mm"), row]
>>> len(drawn(panels[0], (3.0, 2.0), 72)) > 1000  # a PNG
True
>>> with TemporaryDirectory() as folder:
...     draw_panels(Path(folder) / "page.png", "two panels", [panels])
...     (Path(folder) / "page.png").stat().st_size > 1000
True
>>> write_report(Path("report.png"), "face", shot, shape, wrapped, comparison)  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape, xyz_mm_of
from quadfringe.decoding.compare import ShapeComparison
from quadfringe.errors import require
from quadfringe.files import atomic

__all__ = ["Graph", "Panel", "draw_panels", "drawn", "write_report"]

NO_DATA = "#d8d8d8"


class Panel:
    """One picture of a page: an array with title, unit, colour map and range; the default range skips outliers."""

    def __init__(
        self,
        title: str,
        image: NDArray[Any],
        unit: str = "",
        colours: str = "viridis",
        limits: tuple[float, float] | None = None,
    ) -> None:
        self.title, self.image, self.unit = title, image, unit
        self.colours, self.limits = colours, limits or _limits(image)

    def draw(self, figure: Any, axes: Any) -> None:
        """Draw the picture with its colour bar."""
        low, high = self.limits
        drawn = axes.imshow(self.image, cmap=self.colours, vmin=low, vmax=high, interpolation="nearest")
        axes.set_facecolor(NO_DATA)
        axes.set_title(self.title, fontsize=10)
        axes.tick_params(labelsize=7)
        if self.unit:
            bar = figure.colorbar(drawn, ax=axes, shrink=0.85)
            bar.set_label(self.unit, fontsize=8)
            bar.ax.tick_params(labelsize=7)


@dataclass(frozen=True)
class Graph:
    """Lines or points, x and y by name, over a common axis; `limit` is a named dashed line.

    `spread` adds symmetric error bars to the points of that name; `ticks` name the x positions 0, 1, 2 and so on.
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

    def draw(self, _figure: Any, axes: Any) -> None:
        """Draw the lines with a legend."""
        for name, (x, y) in self.lines.items():
            marker = "." if self.points or len(x) < 50 else None
            if name in self.spread:
                axes.errorbar(x, y, yerr=self.spread[name], label=name, fmt="o", markersize=4, capsize=4)
                continue
            axes.plot(x, y, label=name, linewidth=0 if self.points else 1.2, marker=marker, markersize=4)
        if self.ticks:
            axes.set_xticks(range(len(self.ticks)), self.ticks)
            axes.set_xlim(-0.5, len(self.ticks) - 0.5)
            axes.axhline(0, color="black", linewidth=0.5)
        if self.limit is not None:
            axes.axhline(self.limit[1], color="black", linestyle="--", linewidth=0.9, label=self.limit[0])
        if self.log:
            axes.set_yscale("log")
        axes.set_title(self.title, fontsize=10)
        axes.set_xlabel(self.x_label, fontsize=8)
        axes.set_ylabel(self.y_label, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=6.5, framealpha=0.6)


def _limits(image: NDArray[Any]) -> tuple[float, float]:
    finite = image[np.isfinite(image)]
    if not finite.size:
        return (0.0, 1.0)
    low, high = (float(v) for v in np.quantile(finite, (0.005, 0.995)))
    return (low, high if high > low else low + 1.0)


def draw_panels(path: Path, title: str, rows: Sequence[Sequence[Panel | Graph]]) -> None:
    """Write rows of panels and graphs to one PNG; needs matplotlib (extra `plot`)."""
    columns = max(len(row) for row in rows)
    figure = _figure((4.2 * columns, 3.4 * len(rows)))
    figure.suptitle(title, fontsize=14)
    grid = figure.add_gridspec(len(rows), columns)
    for i, row in enumerate(rows):
        for j, panel in enumerate(row):
            panel.draw(figure, figure.add_subplot(grid[i, j]))
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png")


def drawn(panel: Panel | Graph, inches: tuple[float, float], dpi: int) -> bytes:
    """Give one panel or graph as the bytes of a PNG of this width and height; needs matplotlib (extra `plot`)."""
    figure = _figure(inches)
    panel.draw(figure, figure.add_subplot())
    stream = BytesIO()
    figure.savefig(stream, format="png", dpi=dpi)
    return stream.getvalue()


def _figure(inches: tuple[float, float]) -> Any:
    require("matplotlib", "plot")
    from matplotlib.figure import Figure

    return Figure(figsize=inches, layout="constrained")


def fringe_panels(shot: AnyShot) -> list[Panel]:
    """Return panels of the four channels as captured."""
    full = (0.0, shot.full_scale_value)
    return [Panel(f"captured {name}", image, "", "gray", full) for name, image in shot.channels.items()]


def write_report(
    path: Path,
    title: str,
    shot: AnyShot,
    shape: Shape,
    wrapped: Sequence[NDArray[np.float32]],
    found: ShapeComparison,
    *,
    quadrature: bool = True,
) -> None:
    """Write the report of a calibrated shape and of its comparison with the truth to a PNG.

    Without `quadrature` each of three colours has a wrapped phase.
    """
    first, *others = (
        ("red and blue, two-step", "green", "infrared") if quadrature else ("red, Fourier", "green", "blue")
    )
    names = [first, *(f"{name}, Fourier" for name in others)][: len(wrapped)]
    turn = (-np.pi, np.pi)
    rms_mm = found.overall.rms
    error_mm = 4 * rms_mm if np.isfinite(rms_mm) else 1.0
    rows = [
        fringe_panels(shot),
        [
            *(Panel(f"wrapped: {n}", w, "rad", "twilight", turn) for n, w in zip(names, wrapped, strict=True)),
            Panel("modulation", shape.modulation, "fraction of full scale", "gray"),
        ],
        [
            Panel("absolute phase", shape.phase_rad, "rad", "turbo"),
            Panel("quality", shape.quality, "", "viridis"),
            Panel("depth", xyz_mm_of(shape)[:, :, 2], "mm", "viridis_r"),
            Panel("depth error", found.difference, "mm", "coolwarm", (-error_mm, error_mm)),
        ],
    ]
    draw_panels(path, f"{title}: depth RMS {rms_mm:.3f} mm", rows)
