"""Measuring on a page: clicks mark one or two spots; the panel shows coordinates, distance, and the section between."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from quadfringe.errors import InputError
from quadfringe.view._items import Item
from quadfringe.view._scene import Scene
from quadfringe.view.measuring import Ray, Section, Spot, distance

if TYPE_CHECKING:
    import viser

__all__ = ["MeasuringPanel", "ray_of"]

HINT = "Click the shape for a point, and once more for distance and section."
NAMES = ("A", "B")
MISSED = "No surface there."
LINE, BAND = "#1c7ed6", "rgba(28, 126, 214, 0.25)"
SIGMAS = 2.0  # half the width of the band around a section
PLOT_PX = 260


class MeasuringPanel:
    """The folder of measuring, and the marks in the scene. All calls come from one thread at a time."""

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self._gui, self._scene = server.gui, scene
        self._spots: list[Spot] = []
        self._plot: Any = None
        self._folder = self._gui.add_folder("Measure")
        with self._folder:
            self._text = self._gui.add_markdown(HINT)
            self.forget_button = self._gui.add_button("Forget the points")

    def click(self, item: Item, ray: Ray) -> None:
        """Mark where a ray meets the item; a third spot begins anew."""
        spot = item.spot(ray)
        if spot is None:
            self._write(MISSED)
            return
        if len(self._spots) == len(NAMES):
            self._remove_plot()
            self._spots = []
        self._spots.append(spot)
        self._scene.mark([spot.place_mm for spot in self._spots])
        fault = self._show_section(item, ray) if len(self._spots) == len(NAMES) else ""
        self._write(fault)

    def forget(self) -> None:
        """Remove all marks and figures."""
        self._spots = []
        self._remove_plot()
        self._scene.mark([])
        self._text.content = HINT

    def _write(self, more: str) -> None:
        self._text.content = "\n\n".join(words for words in (text_of(self._spots), more) if words)

    def _show_section(self, item: Item, ray: Ray) -> str:
        """Draw the section; return why there is none."""
        try:
            section = item.section(self._spots[0], self._spots[1], ray.direction)
        except InputError as error:
            return str(error)
        if not np.isfinite(section.height_mm).any():
            return "The section has no surface."
        with self._folder:
            self._plot = self._gui.add_uplot(**plot_of(section), height=PLOT_PX)
        return ""

    def _remove_plot(self) -> None:
        if self._plot is not None:
            self._plot.remove()
            self._plot = None


def ray_of(origin_mm: Any, direction: Any) -> Ray | None:
    """Make a ray of what a page sent; None for one without a direction."""
    along = np.asarray(direction, np.float64)
    length = float(np.linalg.norm(along))
    return Ray(np.asarray(origin_mm, np.float64), along / length) if length > 0 else None


def text_of(spots: list[Spot]) -> str:
    """Write the spots and their distance as tables in Markdown.

    >>> print(text_of([Spot((1.0, -2.0, 800.0), (10, 20), 0.05)]))
    | | x, mm | y, mm | z, mm | row, column | ± z, mm |
    | --- | --- | --- | --- | --- | --- |
    | A | 1.000 | -2.000 | 800.000 | 10, 20 | 0.050 |
    """
    if not spots:
        return ""
    lines = ["| | x, mm | y, mm | z, mm | row, column | ± z, mm |", "| --- | --- | --- | --- | --- | --- |"]
    for name, spot in zip(NAMES, spots, strict=False):
        place = " | ".join(f"{value:.3f}" for value in spot.place_mm)
        pixel = "-" if spot.pixel is None else f"{spot.pixel[0]}, {spot.pixel[1]}"
        lines.append(f"| {name} | {place} | {pixel} | {_or_dash(spot.uncertainty_mm)} |")
    if len(spots) == len(NAMES):
        found = distance(spots[0], spots[1])
        parts = " | ".join(f"{value:.3f}" for value in found.parts_mm)
        lines.append(f"| B\u00a0-\u00a0A | {parts} | | |")
        noise = "" if found.uncertainty_mm is None else f" ± {found.uncertainty_mm:.3f} mm (noise, one sigma)"
        lines += ["", f"**distance {found.length_mm:.3f} mm**{noise}"]
    return "\n".join(lines)


def _or_dash(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def plot_of(section: Section) -> dict[str, Any]:
    """Give the plot of a section for viser: the profile, and a band of two standard deviations where they are known."""
    heights = [section.height_mm.astype(np.float64)]
    series: list[dict[str, Any]] = [
        {"label": f"along, {section.unit}"},
        {"label": f"{section.height}, mm", "stroke": LINE, "width": 1.5, "points": {"show": False}},
    ]
    more: dict[str, Any] = {}
    if section.uncertainty_mm is not None:
        wide = SIGMAS * section.uncertainty_mm.astype(np.float64)
        heights += [heights[0] + wide, heights[0] - wide]
        series += [{"label": name, "stroke": BAND, "points": {"show": False}} for name in ("+2 sigma", "-2 sigma")]
        more["bands"] = ({"series": (2, 3), "fill": BAND},)
    down = -1 if section.unit == "px" else 1  # depth grows away from the camera, so the near end is drawn above
    scales = {"x": {"time": False}, "y": {"dir": down}}
    axes = ({"label": f"along the line, {section.unit}"}, {"label": f"{section.height}, mm", "size": 60})
    return {"data": (section.along, *heights), "series": tuple(series), "scales": scales, "axes": axes, **more}
