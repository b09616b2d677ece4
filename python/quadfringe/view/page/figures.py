"""The pictures of a report, drawn as PNG: colour, depth, phase, quality, uncertainty and its histogram, and reasons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Reason, Shape
from quadfringe.view.page._params import BINS, PICTURE_DPI, PICTURE_INCHES, SHOWN
from quadfringe.view.report import Graph, Panel, drawn

__all__ = ["COLOURS", "Picture", "known_uncertainty", "pictures_of", "relief"]

# One colour for each reason, told apart by people who see no red or green as well (Okabe and Ito).
COLOURS = {
    Reason.RETURNED: "#e8e8e8",
    Reason.NO_IMAGE: "#000000",
    Reason.SATURATED: "#f0e442",
    Reason.SHADOW: "#3b4a6b",
    Reason.LOW_MODULATION: "#0072b2",
    Reason.MISFIT: "#d55e00",
    Reason.DISCONTINUITY: "#56b4e9",
    Reason.DOUBTFUL_ORDER: "#cc79a7",
    Reason.SMALL_PIECE: "#009e73",
    Reason.MOVED: "#e69f00",
    Reason.OUT_OF_RANGE: "#8c510a",
}
LIGHT = np.array([-0.35, -0.45, -0.82], np.float32)  # towards the light: left of the camera and above it


@dataclass(frozen=True)
class Picture:
    """A PNG and what it shows."""

    name: str
    png: bytes


@dataclass(frozen=True)
class _Uncertainty:
    """Standard deviations (H, W) and their unit."""

    sigma: NDArray[np.float32]
    unit: str


def pictures_of(shape: Shape) -> list[Picture]:
    """Draw what the shape holds."""
    panels: list[Panel | Graph] = [Panel("colour" if shape.albedo is not None else "modulation", shape.colour)]
    if shape.depth_mm is not None:
        panels.append(Panel("depth", shape.depth_mm, "mm", "viridis_r"))
    panels.append(Panel("absolute phase", shape.phase_rad, "rad", "turbo"))
    panels.append(Panel("quality: trust in the fringe order", shape.quality, "0 to 1", "viridis", (0.0, 1.0)))
    known = known_uncertainty(shape)
    if known is not None:
        panels.append(Panel("uncertainty, one standard deviation", known.sigma, known.unit, "magma"))
    if shape.reason is not None:
        panels.append(Panel("why pixels are missing; colours as in the table", _painted(shape.reason)))
    if known is not None and np.isfinite(known.sigma).any():
        panels.append(_histogram(known))
    return [Picture(one.title, drawn(one, PICTURE_INCHES, PICTURE_DPI)) for one in panels]


def known_uncertainty(shape: Shape) -> _Uncertainty | None:
    """Give the uncertainty of the depth, or without a calibration of the phase; None by methods without one."""
    if shape.uncertainty_mm is not None:
        return _Uncertainty(shape.uncertainty_mm, "mm")
    return None if shape.uncertainty_rad is None else _Uncertainty(shape.uncertainty_rad, "rad")


def relief(shape: Shape) -> bytes:
    """Draw the surface as the camera sees it, shaded by its slopes: the picture where nothing can be turned."""
    directions = shape.normals().directions
    brightness = np.clip(directions @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    shaded = shape.colour * (0.25 + 0.75 * brightness[:, :, None])
    picture = np.where(np.isfinite(shaded), shaded, 255).astype(np.uint8)
    return drawn(Panel("shaded surface", picture), (9.0, 6.4), PICTURE_DPI)


def _painted(reason: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Paint each pixel in the colour of its reason; numbers without a name, of later versions, are white."""
    palette = np.full((256, 3), 255, np.uint8)
    for one, colour in COLOURS.items():
        palette[int(one)] = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return palette[reason]


def _histogram(known: _Uncertainty) -> Graph:
    values = known.sigma[np.isfinite(known.sigma)].astype(np.float64)
    top = float(np.quantile(values, SHOWN))
    counts, edges = np.histogram(values, BINS, (0.0, top if top > 0 else 1.0))
    middles = (edges[1:] + edges[:-1]) / 2
    quartiles = " / ".join(f"{value:.3g}" for value in np.quantile(values, (0.25, 0.5, 0.75, 0.95)))
    name = f"25 / 50 / 75 / 95 %: {quartiles} {known.unit}"
    lines = {name: (middles, 100 * counts / values.size)}
    return Graph("histogram of the uncertainty", f"standard deviation, {known.unit}", "% of the pixels", lines)
