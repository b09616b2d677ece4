"""A shot and its shape on one page: fringes next to the shaded surface, depth, error, and how the errors are spread."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape, xyz_mm_of
from quadfringe.decoding.compare import ShapeComparison
from quadfringe.files import atomic
from quadfringe.view.colours import Picture
from quadfringe.view.report import Panel
from quadfringe.view.shading import shaded
from quadfringe.view.style import CYCLE, DIVERGING, lettered, styled, symmetric

__all__ = ["error_words", "write_overview"]

INCHES = (12.0, 8.4)
DPI = 120
PICTURE_PX = 900  # width of the fringes and of the surface: more than they have on the page
ERROR_SHARE = 0.99  # of the pixels whose errors lie within the colours
BINS = 121
SEAM_PX = 4  # between the colour image and the infrared one


def write_overview(path: Path, title: str, shot: AnyShot, shape: Shape, found: ShapeComparison) -> None:
    """Write fringes, surface, depth, and the error against the truth, as map, as histogram and in words, to a PNG.

    Needs matplotlib (extra `plot`), and raises `InputError` for a shape without a calibration.
    """
    error = found.difference
    limits = symmetric(error, share=ERROR_SHARE)
    depth_mm = xyz_mm_of(shape)[:, :, 2]
    maps = [
        Panel("depth", depth_mm, "mm", "viridis_r"),
        Panel("error: depth measured less true", error, "mm", DIVERGING, limits),
    ]
    with styled():
        from matplotlib.figure import Figure

        figure = Figure(figsize=INCHES, layout="constrained")
        figure.suptitle(title, x=0.012, ha="left", weight="bold", parse_math=False)
        rows = figure.add_gridspec(3, 1, height_ratios=(1.62, 1.0, 0.12))
        above, below = rows[0].subgridspec(1, 2), rows[1].subgridspec(1, 3)
        names = "colour | infrared" if "ir" in shot.channels else "colour"
        _picture(figure.add_subplot(above[0]), lettered(0, f"one exposure: {names}"), fringes_picture(shot, PICTURE_PX))
        _picture(figure.add_subplot(above[1]), lettered(1, "the surface from it, shaded"), shaded(shape, PICTURE_PX))
        for number, panel in enumerate(maps):
            panel.draw(figure, figure.add_subplot(below[number]), lettered(2 + number, panel.title))
        _histogram(figure.add_subplot(below[2]), lettered(4, "histogram of the error"), error, limits)
        words = figure.add_subplot(rows[2])
        words.set_axis_off()
        words.text(0, 0.5, error_words(found), va="center", linespacing=1.5, parse_math=False)
        with atomic(path) as temporary:
            figure.savefig(temporary, format="png", dpi=DPI)


def fringes_picture(shot: AnyShot, width_px: int) -> Picture:
    """Give the left half of the colour image next to the right half of the infrared one, `width_px` wide."""
    planes = [_level(image, shot.full_scale_value, width_px) for image in shot.channels.values()]
    height = min(plane.shape[0] for plane in planes)
    red, green, blue, *infrared = (plane[:height, :width_px] for plane in planes)
    picture = np.dstack([red, green, blue])
    if infrared:
        middle = width_px // 2
        picture[:, middle:] = infrared[0][:, middle:, None]
        picture[:, middle - SEAM_PX // 2 : middle + SEAM_PX // 2] = 255
    return picture


def error_words(found: ShapeComparison) -> str:
    """Say the figures of a comparison with the truth in words."""
    size = np.abs(found.difference[np.isfinite(found.difference)])
    wrong = int(found.wrong_order.sum())
    returned = f"{found.returned_percent:.1f} % of the lit pixels have a depth, {wrong} of them on a wrong fringe."
    if not size.size:
        return returned
    half, most = (float(value) for value in np.quantile(size, (0.5, 0.95)))
    return (
        f"{returned}\nHalf of the depths are within {half:.3f} mm of the truth, 95 % within {most:.3f} mm; "
        f"the RMS error away from edges is {found.overall.rms:.3f} mm."
    )


def _level(image: NDArray[Any], full_scale: float, width_px: int) -> Picture:
    height_px = max(1, round(width_px * image.shape[0] / image.shape[1]))
    small = cv2.resize(np.ascontiguousarray(image), (width_px, height_px), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.convertScaleAbs(small, alpha=255 / full_scale), np.uint8)


def _picture(axes: Any, title: str, picture: Picture) -> None:
    axes.imshow(picture, interpolation="antialiased")
    axes.set_title(title, parse_math=False)
    axes.set_axis_off()


def _histogram(axes: Any, title: str, error: NDArray[Any], limits: tuple[float, float]) -> None:
    finite = error[np.isfinite(error)]
    beyond = 100 * float((np.abs(finite) > limits[1]).mean()) if finite.size else 0.0
    counts, edges = np.histogram(finite, BINS, limits)
    axes.stairs(100 * counts / max(finite.size, 1), edges, fill=True, color=CYCLE[0], alpha=0.85)
    axes.axvline(0, color="black", linewidth=0.7)
    axes.set_title(title, parse_math=False)
    axes.set(xlabel=f"error, mm ({beyond:.1f} % lie beyond)", ylabel="pixels, %", xlim=limits)
