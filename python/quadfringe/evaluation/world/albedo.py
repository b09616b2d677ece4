"""Albedos of scenes: maps (H, W, 4) float32 for red, green, blue and infrared, from the points that the camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float32]
Points = NDArray[np.float32]  # (H, W, 3), mm, NaN where nothing is seen

SKIN = (0.75, 0.55, 0.45, 0.8)
INK = (0.12, 0.1, 0.1, 0.5)  # most inks are brighter in the infrared
PIXELS_PER_MM = 6
# Sample images of scikit-image that need no download.
PHOTOGRAPHS = ("astronaut", "coffee", "chelsea", "rocket", "retina", "camera", "brick", "gravel", "coins")


def painted_face(points_mm: Points, random: np.random.Generator) -> Map:
    """Paint the face of the bench: skin, brows, lips, irises, freckles; behind it a bar code and a word."""
    canvas = Canvas((-165.0, -125.0), (165.0, 125.0), random.uniform(0.7, 1.0, 4))
    tone = random.uniform(0.8, 1.1)
    canvas.ellipse((6.0, 2.0), (73.0, 99.0), [tone * value for value in SKIN])
    brow, iris = random.uniform(0.06, 0.3, 4), random.uniform(0.08, 0.5, 4)
    for side in (-1, 1):
        canvas.line((6 + side * 12.0, -26.0), (6 + side * 42.0, -31.0), 5.0, brow)
        eye = (6 + side * 27.0, -16.0)
        canvas.ellipse(eye, (11.0, 6.0), (0.9, 0.88, 0.85, 0.9))
        canvas.ellipse(eye, (5.0, 5.0), iris)
        canvas.ellipse(eye, (2.2, 2.2), (0.05, 0.05, 0.05, 0.1))
    canvas.ellipse((6.0, 50.0), (22.0, 6.0), (random.uniform(0.5, 0.8), 0.2, random.uniform(0.2, 0.4), 0.75))
    for x, y in random.uniform((-50, -10), (60, 40), (60, 2)):
        canvas.ellipse((x, y), (random.uniform(0.6, 1.6),) * 2, (0.5, 0.32, 0.25, 0.75))
    x = -150.0
    while x < -90:
        width = random.uniform(0.6, 3.0)
        canvas.box((x, -60.0), (x + width, 60.0), INK)
        x += width + random.uniform(0.8, 3.0)
    canvas.word("FRINGE", (85.0, -60.0 + random.uniform(0, 60)), INK)
    return canvas.seen(points_mm)


class Canvas:
    """An image in the plane of x and y. Later drawings cover earlier ones."""

    def __init__(self, low_mm: Sequence[float], high_mm: Sequence[float], albedo: Any) -> None:
        self._low = np.array(low_mm)
        width, height = np.ceil((np.array(high_mm) - low_mm) * PIXELS_PER_MM).astype(int)
        self._image = np.empty((height, width, 4), np.float32)
        self._image[:] = albedo

    def ellipse(self, centre_mm: Sequence[float], radii_mm: Sequence[float], albedo: Any) -> None:
        """Fill an ellipse; `albedo` has four channels, here and below."""
        size = tuple(round(PIXELS_PER_MM * radius) for radius in radii_mm)
        cv2.ellipse(self._image, self._at(centre_mm), size, 0, 0, 360, tuple(map(float, albedo)), -1)

    def line(self, start_mm: Sequence[float], end_mm: Sequence[float], width_mm: float, albedo: Any) -> None:
        """Draw a line."""
        width = round(PIXELS_PER_MM * width_mm)
        cv2.line(self._image, self._at(start_mm), self._at(end_mm), tuple(map(float, albedo)), width)

    def box(self, low_mm: Sequence[float], high_mm: Sequence[float], albedo: Any) -> None:
        """Fill a rectangle along the axes."""
        cv2.rectangle(self._image, self._at(low_mm), self._at(high_mm), tuple(map(float, albedo)), -1)

    def word(self, text: str, start_mm: Sequence[float], albedo: Any) -> None:
        """Write letters 11 mm high, from their lower left corner."""
        ink = np.zeros(self._image.shape[:2], np.uint8)
        cv2.putText(ink, text, self._at(start_mm), cv2.FONT_HERSHEY_SIMPLEX, 3.0, 255, 8)
        self._image[ink > 0] = albedo

    def _at(self, place_mm: Sequence[float]) -> tuple[int, int]:
        x, y = np.round((np.array(place_mm) - self._low) * PIXELS_PER_MM).astype(int)
        return int(x), int(y)

    def seen(self, points_mm: Points) -> Map:
        """Give the albedo at points, averaged over the area of a camera pixel, 0.3 mm."""
        image = cv2.GaussianBlur(self._image, (0, 0), 0.1 * PIXELS_PER_MM)
        place = np.nan_to_num(((points_mm[..., :2] - self._low) * PIXELS_PER_MM).astype(np.float32))
        x, y = place[..., 0], place[..., 1]
        return np.asarray(cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)


def photographs(shape: tuple[int, int], random: np.random.Generator) -> Map:
    """Give a different photograph as the albedo of each channel, 0.08 to 0.95."""
    from skimage import data

    rows, columns = shape
    channels = []
    for name in random.choice(PHOTOGRAPHS, 4, replace=False):
        image = np.asarray(getattr(data, str(name))(), np.float32)
        gray = image.mean(axis=-1) if image.ndim == 3 else image
        gray = cv2.resize(gray, (columns, rows), interpolation=cv2.INTER_AREA)
        low, high = np.percentile(gray, (1, 99))
        channels.append(0.08 + 0.87 * np.clip((gray - low) / (high - low), 0, 1))
    return np.stack(channels, axis=-1).astype(np.float32)


def glossy(points_mm: Points, random: np.random.Generator) -> Map:
    """Give a coloured surface with a highlight, a narrow lobe around the mirror direction that saturates the camera."""
    along_x, along_y = np.gradient(points_mm, axis=1), np.gradient(points_mm, axis=0)
    normal = np.cross(along_y, along_x)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    view = -points_mm / np.linalg.norm(points_mm, axis=-1, keepdims=True)
    light = np.array([140.0, 0.0, 0.0]) - points_mm
    half = view + light / np.linalg.norm(light, axis=-1, keepdims=True)
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    cosine = np.nan_to_num(np.abs((normal * half).sum(axis=-1)))
    lobe = random.uniform(1.0, 2.0) * cosine ** random.uniform(600, 2000)
    return np.asarray(random.uniform(0.25, 0.8, 4) + lobe[..., None], np.float32)


def random_shades(points_mm: Points, parts: NDArray[np.int64], random: np.random.Generator) -> Map:
    """Give every part of a scene, numbered (H, W), a colour with an albedo from 0.08 to 0.9."""
    brightness = np.exp(random.uniform(np.log(0.08), np.log(0.9), (int(parts.max()) + 1, 1)))
    colours = brightness * random.uniform(0.7, 1.0, (len(brightness), 4))
    return np.where(np.isfinite(points_mm[..., :1]), colours[parts], 0.5).astype(np.float32)
