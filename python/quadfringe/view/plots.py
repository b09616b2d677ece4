"""Plots of records with matplotlib (extra `plot`), which give back their axes to draw more into."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from quadfringe.config import Response
from quadfringe.data import AnyShot, Calibration, Shape
from quadfringe.view.report import Panel
from quadfringe.view.rig import sights
from quadfringe.view.style import CHANNELS, CYCLE, below, styled

__all__ = ["plot_calibration", "plot_shape", "plot_shot"]

PANEL_INCHES = (4.6, 3.7)
CURVE = np.linspace(0, 1, 65)
KNEE_POWER = 20  # as `ChannelResponse` defines it


def plot_shape(shape: Shape) -> Any:
    """Draw the maps of a shape that it has: depth, quality, uncertainty and phase; see `Shape.plot`."""
    known = shape.uncertainty_mm if shape.uncertainty_rad is None else shape.uncertainty_rad
    unit = "mm" if shape.uncertainty_rad is None else "rad"
    panels = [
        Panel("absolute phase", shape.phase_rad, "rad", "turbo"),
        Panel("quality", shape.quality, "0 to 1", "viridis", (0.0, 1.0)),
    ]
    if known is not None:
        top = float(np.nanquantile(known, 0.98)) if np.isfinite(known).any() else 1.0
        panels.insert(0, Panel("uncertainty, one standard deviation", known, unit, "magma", (0.0, max(top, 1e-9))))
    if shape.depth_mm is not None:
        panels.insert(0, Panel("depth", shape.depth_mm, "mm", "viridis_r"))
    return _drawn(panels)


def plot_shot(shot: AnyShot) -> Any:
    """Draw the channels of a shot; see `Shot.plot`."""
    full = (0.0, shot.full_scale_value)
    return _drawn([Panel(name, image, "counts", "gray", full) for name, image in shot.channels.items()])


def plot_calibration(calibration: Calibration) -> Any:
    """Draw the devices from above, and the responses of the channels if they are known; see `Calibration.plot`."""
    responses = {"camera": calibration.response, "projector": calibration.projector_response}
    known = {name: response for name, response in responses.items() if response is not None}
    with styled():
        axes = _axes(1 + len(known))
        _plot_rig(axes[0], calibration)
        for each, (name, response) in zip(axes[1:], known.items(), strict=True):
            _plot_response(each, name, response)
    return axes


def _plot_rig(axes: Any, calibration: Calibration) -> None:
    for sight, colour in zip(sights(calibration), (CYCLE[-1], CYCLE[0], CYCLE[1]), strict=False):
        x, z = sight.outline_mm[[0, 1, 2, 0]][:, [0, 2]].T
        axes.fill(x, z, color=colour, alpha=0.10, linewidth=0)
        axes.plot(x, z, color=colour, label=sight.name)
        axes.plot(x[0], z[0], "o", color=colour, markersize=6)
    axes.set(title="the rig from above", xlabel="x, mm", ylabel="z, mm (depth)", aspect="equal")
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 0.0), ncols=3, **below(axes.figure, axes))


def _plot_response(axes: Any, name: str, response: Response) -> None:
    for channel, row, colour in zip(("R", "G", "B", "IR"), response.rows, CHANNELS, strict=True):
        offset, exponent, knee = row
        linear = np.maximum(CURVE / (1 - knee * CURVE**KNEE_POWER) - offset, 0) ** exponent
        axes.plot(CURVE, linear, color=colour, label=channel)
    axes.plot((0, 1), (0, 1), color="#999999", linewidth=0.7, linestyle=":")
    axes.set(title=f"response of the {name}", xlabel="stored, share of full scale", ylabel="linear light, share")
    axes.legend(loc="best")


def _drawn(panels: list[Panel]) -> Any:
    with styled():
        axes = _axes(len(panels))
        for panel, each in zip(panels, _flat(axes), strict=True):
            panel.draw(each.figure, each)
    return axes


def _axes(count: int) -> Any:
    """Give `count` axes of a new figure in an array: one row, or two of two."""
    from matplotlib import pyplot

    rows, columns = (2, 2) if count == 4 else (1, count)
    size = (PANEL_INCHES[0] * columns, PANEL_INCHES[1] * rows)
    _, axes = pyplot.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
    return axes if rows > 1 else axes[0]


def _flat(axes: Any) -> Iterable[Any]:
    return iter(np.ravel(axes))
