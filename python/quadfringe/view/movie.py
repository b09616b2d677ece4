"""Rendered pictures of shapes from any viewpoint, and MP4 movies of pictures.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import quadfringe as qf
>>> from quadfringe.view.movie import *
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> with qf.open(qf.SystemConfig(camera=small, scene=qf.SceneConfig(surface="sphere", noise=0.01))) as scanner:
...     shape = scanner.measure()
>>> with TemporaryDirectory() as folder:
...     path = Path(folder) / "turn.mp4"
...     with movie(path, rate_hz=10.0) as pictures:
...         taken: Movie = pictures
...         for angle_deg in (0.0, 10.0):
...             taken.add(solid_picture(shape, shape.colour, turn_deg=(angle_deg, 0.0), size_px=(320, 240)))
...     path.stat().st_size > 1000
True
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.errors import InputError
from quadfringe.files import atomic, require_suffix
from quadfringe.view.colours import Picture

__all__ = ["Movie", "movie", "solid_picture"]

BACKGROUND = 24  # grey level
LIGHT = np.array([-0.45, -0.55, -0.70], np.float32)  # direction to the light, in the frame of the picture


class Movie(Protocol):
    """Takes the pictures of a movie in order; all have one size."""

    def add(self, picture: Picture) -> None:
        """Add a picture, (H, W, 3) uint8 in R, G, B order."""


class _Mp4:
    def __init__(self, path: Path, rate_hz: float) -> None:
        self._path, self._rate_hz = path, rate_hz
        self._writer: cv2.VideoWriter | None = None
        self._size: tuple[int, ...] = ()

    def add(self, picture: Picture) -> None:
        if self._writer is None:
            self._size = picture.shape
            code = cv2.VideoWriter.fourcc(*"mp4v")
            self._writer = cv2.VideoWriter(str(self._path), code, self._rate_hz, picture.shape[1::-1])
            if not self._writer.isOpened():
                raise InputError(
                    "this build of OpenCV cannot write MP4; install the wheel opencv-contrib-python-headless"
                )
        if picture.shape != self._size:
            raise InputError(f"movie: expected pictures of one size, {self._size}, got {picture.shape}")
        self._writer.write(np.ascontiguousarray(picture[:, :, ::-1]))

    def close(self) -> None:
        if self._writer is not None:
            self._writer.release()


@contextmanager
def movie(path: Path, rate_hz: float) -> Iterator[Movie]:
    """Write an MP4 of the pictures that are added; the file is complete or does not exist."""
    require_suffix(path, (".mp4",))
    with atomic(path) as temporary:
        if not _is_text(temporary):  # OpenCV would crash
            raise InputError(f"{path}: a movie needs a path that is valid UTF-8; choose another one")
        writer = _Mp4(temporary, rate_hz)
        try:
            yield writer
        finally:
            writer.close()


def _is_text(path: Path) -> bool:
    """Say whether a path is text; Linux allows any bytes in it."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return False
    return True


def solid_picture(
    shape: Shape,
    colours: Picture,
    *,
    turn_deg: tuple[float, float] = (25.0, -15.0),
    middle_mm: tuple[float, float, float] | None = None,
    size_px: tuple[int, int] = (640, 480),
    field_mm: float = 320.0,
) -> Picture:
    """Render a calibrated shape with the colours (H, W, 3), lit from above left; returns (height, width, 3) uint8.

    The viewpoint is rotated about `middle_mm`, by default the median point, by yaw and pitch `turn_deg`; `field_mm` is
    the width of the view at that point.
    """
    if shape.xyz_mm is None:
        raise InputError("shape: expected points, got phase only; decode with a calibration")
    known = np.isfinite(shape.xyz_mm).all(axis=2)
    points = shape.xyz_mm[known]
    if middle_mm is None:
        middle_mm = tuple(np.median(points, axis=0)) if len(points) else (0.0, 0.0, 0.0)
    rotation = _rotation(*np.radians(turn_deg))
    seen = (points - np.asarray(middle_mm, np.float32)) @ rotation.T
    shade = _shade(_normals(shape.xyz_mm)[known] @ rotation.T)
    painted = (colours[known] * shade[:, None]).clip(0, 255).astype(np.uint8)
    spacing_mm = float(np.nanmedian(np.abs(np.diff(shape.xyz_mm[:, :, 0], axis=1)))) if len(points) else 0.0
    dot_px = int(np.clip(np.ceil(1.5 * spacing_mm * size_px[0] / field_mm), 2, 8))
    return _splat(seen, painted, size_px, field_mm, dot_px)


def _rotation(yaw: float, pitch: float) -> NDArray[np.float32]:
    sine, cosine = np.sin(yaw), np.cos(yaw)
    about_y = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    sine, cosine = np.sin(pitch), np.cos(pitch)
    about_x = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    rotation: NDArray[np.float32] = (about_x @ about_y).astype(np.float32)
    return rotation


def _normals(xyz_mm: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return unit normals towards the camera, (H, W, 3); along the optical axis where neighbours have no data."""
    smooth = cv2.blur(np.nan_to_num(xyz_mm, nan=0.0), (5, 5))
    share = cv2.blur(np.isfinite(xyz_mm).astype(np.float32), (5, 5))
    smooth = np.where(share > 0, smooth / np.maximum(share, 1e-6), np.nan)
    down, right = np.gradient(smooth, axis=(0, 1))
    normals = np.cross(down, right)
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    unit = np.full(xyz_mm.shape, (0, 0, -1), np.float32)
    np.divide(normals, length, out=unit, where=np.isfinite(length) & (length > 0))
    return unit


def _shade(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    light = LIGHT / np.float32(np.linalg.norm(LIGHT))
    return np.asarray(0.25 + 0.9 * np.maximum(normals @ light, 0), np.float32)


def _splat(
    seen: NDArray[np.float32], painted: Picture, size_px: tuple[int, int], field_mm: float, dot_px: int
) -> Picture:
    """Draw points from far to near, each as a square of `dot_px`, so that near points hide far ones."""
    width, height = size_px
    distance_mm = 3 * field_mm
    scale = width / field_mm * distance_mm / (distance_mm + seen[:, 2])
    column = (width / 2 + scale * seen[:, 0]).astype(np.int32)
    row = (height / 2 + scale * seen[:, 1]).astype(np.int32)
    inside = (column >= 0) & (column <= width - dot_px) & (row >= 0) & (row <= height - dot_px)
    order = np.argsort(-seen[inside, 2])
    column, row, colours = column[inside][order], row[inside][order], painted[inside][order]
    picture = np.full((height, width, 3), BACKGROUND, np.uint8)
    for down in range(dot_px):
        for right in range(dot_px):
            picture[row + down, column + right] = colours
    return picture
