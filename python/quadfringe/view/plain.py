"""A small report of one shot as a PNG, drawn with OpenCV alone, for installations without matplotlib."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from quadfringe.data import AnyShot, Shape, xyz_mm_of
from quadfringe.decoding.compare import ShapeComparison
from quadfringe.io.images import write_image
from quadfringe.view.colours import NO_DATA, Map, Picture, channels_picture, coloured, limits_of

__all__ = ["write_plain_report"]

WIDTH_PX = 640  # of a panel
TITLE_PX = 32
PAPER, INK = 255, (20, 20, 20)
LIGHT = np.array([-0.4, -0.5, -0.77], np.float32)  # from above on the left, towards the camera
AMBIENT = 0.25  # share of the light that reaches a surface turned away


def write_plain_report(path: Path, title: str, shot: AnyShot, shape: Shape, found: ShapeComparison) -> None:
    """Write fringes, shaded surface, depth and depth error of a calibrated shape; pixels without data are grey."""
    depth_mm, rms_mm = xyz_mm_of(shape)[:, :, 2], found.overall.rms
    low_mm, high_mm = limits_of(depth_mm)
    below = " and infrared" if "ir" in shot.channels else ""
    error_mm = 4 * rms_mm if np.isfinite(rms_mm) else 1.0
    panels = [
        _panel(f"captured: red and green above blue{below}", channels_picture(shot, 2 * WIDTH_PX)),
        _panel(f"{title}: surface", _shaded(shape)),
        _panel(f"depth, blue {low_mm:.0f} mm to red {high_mm:.0f} mm", coloured(depth_mm, (low_mm, high_mm))),
        _panel(
            f"depth error, blue {-error_mm:.2f} mm to red {error_mm:.2f} mm; RMS {rms_mm:.3f} mm",
            _diverging(found.difference, error_mm),
        ),
    ]
    write_image(path, np.vstack([np.hstack(panels[:2]), np.hstack(panels[2:])]))


def _panel(title: str, picture: Picture) -> Picture:
    """Scale a picture to the width of a panel and write the title above it."""
    height = round(WIDTH_PX * picture.shape[0] / picture.shape[1])
    scaled = cv2.resize(picture, (WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    panel = np.full((TITLE_PX + height, WIDTH_PX, 3), PAPER, np.uint8)
    panel[TITLE_PX:] = scaled
    cv2.putText(panel, title, (8, 22), cv2.FONT_HERSHEY_SIMPLEX, 0.5, INK, 1, cv2.LINE_AA)
    return panel


def _shaded(shape: Shape) -> Picture:
    """Light the surface from one side, by its normals; its colour does not matter."""
    cosine = shape.normals().directions @ (LIGHT / np.linalg.norm(LIGHT))
    shade = 255 * (AMBIENT + (1 - AMBIENT) * np.fmax(cosine, 0))
    return _painted(np.repeat(shade[:, :, None], 3, axis=2), np.isfinite(cosine))


def _diverging(values: Map, limit: float) -> Picture:
    """Paint values from blue over white to red, -limit to limit."""
    level = np.clip(values / np.float32(limit), -1, 1)
    faded = 255 * (1 - np.abs(level))
    red, blue = np.where(level > 0, 255, faded), np.where(level < 0, 255, faded)
    return _painted(np.dstack([red, faded, blue]), np.isfinite(values))


def _painted(picture: Map, known: np.typing.NDArray[np.bool_]) -> Picture:
    painted = np.where(known[:, :, None], picture, NO_DATA)
    return np.asarray(painted, np.uint8)
