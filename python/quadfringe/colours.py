"""Maps and channels to pictures for the eye: (H, W) to (H, W, 3) uint8 in R, G, B order; no data is grey."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape

__all__ = ["Picture", "channels_picture", "coloured", "limits_of", "phase_picture", "texture"]

Picture = NDArray[np.uint8]
Map = NDArray[np.float32]
NO_DATA = 90
COARSE = 16  # a colour is the mean over so many pixels, times the blur: more than a fringe


def limits_of(values: Map) -> tuple[float, float]:
    """Give the range of most values, a little widened, whatever a few outliers say; (0, 1) when there are none."""
    finite = values[::4, ::4][np.isfinite(values[::4, ::4])]
    if not finite.size:
        return (0.0, 1.0)
    low, high = (float(v) for v in np.quantile(finite, (0.04, 0.96)))
    low, high = low - 0.1 * (high - low), high + 0.1 * (high - low)
    return (low, high if high > low else low + 1.0)


def coloured(values: Map, limits: tuple[float, float], colours: int = cv2.COLORMAP_TURBO) -> Picture:
    """Paint a map with a colour map of OpenCV."""
    low, high = limits
    known = np.isfinite(values)
    level = np.where(known, (values - low) * np.float32(255 / (high - low)), 0).clip(0, 255).astype(np.uint8)
    picture: Picture = np.ascontiguousarray(cv2.applyColorMap(level, colours)[..., ::-1])
    picture[~known] = NO_DATA
    return picture


def phase_picture(shape: Shape, columns: int, max_px: int = 480) -> Picture:
    """Paint the absolute phase, through the projector's `columns`, from blue to red."""
    step = max(1, math.ceil(max(shape.column_px.shape) / max_px))
    return coloured(shape.column_px[::step, ::step], (0.0, float(columns)))


def channels_picture(shot: AnyShot, max_px: int = 640) -> Picture:
    """Put red and green above blue and infrared, each in its own light."""
    tints = {"red": (0,), "green": (1,), "blue": (2,), "ir": (0, 1, 2)}
    size = shot.channels["red"].shape
    tiles = {name: _tile(image, size, shot.full_scale_value, tints[name]) for name, image in shot.channels.items()}
    picture = np.vstack([np.hstack([tiles["red"], tiles["green"]]), np.hstack([tiles["blue"], tiles["ir"]])])
    scale = min(1.0, max_px / max(picture.shape[:2]))
    small: Picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA).astype(np.uint8)
    return small


def _tile(image: NDArray[Any], size: tuple[int, ...], full_scale: float, planes: tuple[int, ...]) -> Picture:
    grey = cv2.convertScaleAbs(image, alpha=255 / full_scale) if image.dtype != np.uint8 or full_scale != 255 else image
    if grey.shape != size:
        grey = cv2.resize(grey, size[::-1], interpolation=cv2.INTER_AREA)
    tile = np.zeros((*size, 3), np.uint8)
    tile[:, :, list(planes)] = np.asarray(grey)[:, :, None]
    return tile


def texture(shot: AnyShot, shape: Shape) -> Picture:
    """Give the surface as it looks without fringes: brightness of the modulation, colour of the mean light around."""
    modulation = np.nan_to_num(shape.modulation)
    top = limits_of(shape.modulation)[1]
    brightness = (modulation * np.float32(255 / max(top, 1e-6))).clip(0, 255)
    height, width = modulation.shape
    small = (max(1, width // COARSE), max(1, height // COARSE))
    planes = [shot.channels[name] for name in ("red", "green", "blue")]
    means = [cv2.blur(cv2.resize(p.astype(np.float32), small, interpolation=cv2.INTER_AREA), (5, 5)) for p in planes]
    hue = np.dstack(means) / np.maximum(np.max(means, axis=0), 1e-6)[:, :, None]
    full = cv2.resize(hue, (width, height), interpolation=cv2.INTER_LINEAR)
    picture: Picture = (brightness[:, :, None] * full).astype(np.uint8)
    return picture
