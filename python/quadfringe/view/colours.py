"""Pictures of maps and channels: (H, W) to (H, W, 3) uint8 in R, G, B order, with missing data in grey.

>>> from quadfringe.view.colours import *
>>> import quadfringe as qf
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> with qf.open(qf.SystemConfig(camera=small, scene=qf.SceneConfig(surface="sphere", noise=0.01))) as scanner:
...     shot = scanner.grab()
...     shape = scanner.decode(shot)
>>> channels_picture(shot).shape, phase_picture(shape, 912).shape, texture(shot, shape).shape
((384, 512, 3), (192, 256, 3), (192, 256, 3))
>>> colouring: Colouring = "height"
>>> low, high = limits_of(shape.depth_mm)
>>> limits_for(colouring, shape.depth_mm) == (low, high), colouring in COLOURINGS
(True, True)
>>> picture: Picture = coloured(shape.depth_mm, (low, high))
>>> picture.shape
(192, 256, 3)
"""

from __future__ import annotations

import math
from typing import Any, Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape
from quadfringe.io.export import surface_picture

__all__ = [
    "COLOURINGS",
    "Colouring",
    "Picture",
    "channels_picture",
    "coloured",
    "limits_for",
    "limits_of",
    "phase_picture",
    "texture",
]

Colouring = Literal["texture", "height", "quality", "uncertainty"]
COLOURINGS: tuple[Colouring, ...] = get_args(Colouring)
Picture = NDArray[np.uint8]
Map = NDArray[np.float32]
NO_DATA = 90  # grey level of pixels without data: distinct from black and from every colour of the map
COARSE = 16  # colours are means over 16 x 16 pixels, blurred by five of these: wider than a fringe


def limits_of(values: Map) -> tuple[float, float]:
    """Return the range of the middle 92 % of the values, widened by a tenth at both ends; (0, 1) without values."""
    finite = values[::4, ::4][np.isfinite(values[::4, ::4])]
    if not finite.size:
        return (0.0, 1.0)
    low, high = (float(v) for v in np.quantile(finite, (0.04, 0.96)))
    low, high = low - 0.1 * (high - low), high + 0.1 * (high - low)
    return (low, high if high > low else low + 1.0)


def limits_for(colouring: Colouring, values: Map) -> tuple[float, float]:
    """Return the range of values that the colours span: of quality 0 to 1, and of uncertainty from 0."""
    if colouring == "quality":
        return (0.0, 1.0)
    low, high = limits_of(values)
    return (0.0, max(high, 1e-6)) if colouring == "uncertainty" else (low, high)


def coloured(values: Map, limits: tuple[float, float], colours: int = cv2.COLORMAP_TURBO) -> Picture:
    """Paint a map with an OpenCV colour map between the limits (low, high)."""
    low, high = limits
    known = np.isfinite(values)
    level = np.where(known, (values - low) * np.float32(255 / (high - low)), 0).clip(0, 255).astype(np.uint8)
    picture: Picture = np.ascontiguousarray(cv2.applyColorMap(level, colours)[..., ::-1])
    picture[~known] = NO_DATA
    return picture


def phase_picture(shape: Shape, columns: int, max_px: int = 480) -> Picture:
    """Paint the projector column of each pixel, from 0 to `columns`, from blue to red."""
    step = max(1, math.ceil(max(shape.column_px.shape) / max_px))
    return coloured(shape.column_px[::step, ::step], (0.0, float(columns)))


def channels_picture(shot: AnyShot, max_px: int = 640) -> Picture:
    """Arrange red and green above blue and infrared, each tinted with its colour; black without infrared."""
    tints = {"red": (0,), "green": (1,), "blue": (2,), "ir": (0, 1, 2)}
    height, width = shot.channels["red"].shape
    step = math.ceil(2 * max(height, width) / max_px)
    size = (max(1, width // step), max(1, height // step))
    tiles = [_tile(image, size, shot.full_scale_value, tints[name]) for name, image in shot.channels.items()]
    red, green, blue, ir = (*tiles, np.zeros_like(tiles[0]))[:4]
    return np.vstack([np.hstack([red, green]), np.hstack([blue, ir])])


def _tile(image: NDArray[Any], size: tuple[int, int], full_scale: float, planes: tuple[int, ...]) -> Picture:
    small = cv2.resize(np.ascontiguousarray(image), size, interpolation=cv2.INTER_AREA)
    tile = np.zeros((size[1], size[0], 3), np.uint8)
    tile[:, :, list(planes)] = cv2.convertScaleAbs(small, alpha=255 / full_scale)[:, :, None]
    return tile


def texture(shot: AnyShot, shape: Shape, stride: int = 1) -> Picture:
    """Return the surface as it looks without fringes, every `stride`-th pixel of every `stride`-th row.

    This is the albedo, grey by the modulation where it is not known. Without one, the brightness is the modulation, and
    the colour comes from the mean light in the neighbourhood.
    """
    if shape.albedo is not None:
        return surface_picture(shape.albedo[::stride, ::stride], shape.modulation[::stride, ::stride])
    top = max(limits_of(shape.modulation)[1], 1e-6)
    modulation = np.nan_to_num(shape.modulation[::stride, ::stride])
    brightness = cv2.convertScaleAbs(modulation, alpha=255 / top)
    height, width = shape.modulation.shape
    coarse = (max(1, width // COARSE), max(1, height // COARSE))
    means = [cv2.blur(_coarse(shot.channels[name], coarse), (5, 5)) for name in ("red", "green", "blue")]
    hue = (255 * np.dstack(means) / np.maximum(np.max(means, axis=0), 1e-6)[:, :, None]).astype(np.uint8)
    tint = cv2.resize(hue, brightness.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(cv2.multiply(tint, cv2.merge([brightness] * 3), scale=1 / 255), np.uint8)


def _coarse(image: NDArray[Any], size: tuple[int, int]) -> Map:
    return np.asarray(cv2.resize(np.ascontiguousarray(image), size, interpolation=cv2.INTER_AREA), np.float32)
