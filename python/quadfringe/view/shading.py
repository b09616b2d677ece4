"""Shaded pictures of a surface as its camera sees it, by NumPy and OpenCV alone.

>>> import quadfringe as qf
>>> from quadfringe.view.shading import shaded
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> with qf.open(qf.SystemConfig(camera=small)) as scanner:
...     picture = shaded(scanner.measure(), 320)
>>> picture.shape
(240, 320, 3)
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape, xyz_mm_of
from quadfringe.view.colours import Picture, limits_of

__all__ = ["shaded"]

Map = NDArray[np.float32]
GROUND = np.array([22, 26, 36], np.float32)  # pixels without data: bluer than any shade of the surface
NEAR, FAR = np.array([250, 241, 226], np.float32), np.array([126, 146, 178], np.float32)
DEPTH_SHARE = 0.03  # of the distance: a depth range below it is not spread over all tints
KEY = np.array([-0.55, -0.60, -0.58], np.float32)  # from above on the left
FILL = np.array([0.75, 0.15, -0.65], np.float32)  # weaker, from the right, so that no side is black
SHARES = (0.14, 0.84, 0.30)  # light from everywhere, key and fill
BORDER = cv2.BORDER_REPLICATE  # mirrored, the border would have no slope
SMOOTH_PX = 5  # side of the window over which normals are taken: noise would look like sand


def shaded(shape: Shape, width_px: int, colour: Picture | None = None) -> Picture:
    """Light the surface from above left; give a picture `width_px` wide, (h, w, 3) uint8, of a calibrated shape.

    `colour` (H, W, 3) paints the surface; otherwise it is light where it is near and bluish where it is far. Pixels
    without data are dark blue. Raises `InputError` without a calibration.
    """
    xyz_mm = xyz_mm_of(shape)
    step = max(1, xyz_mm.shape[1] // (2 * width_px))  # a picture that is halved afterwards has smooth rims
    xyz_mm = np.ascontiguousarray(xyz_mm[::step, ::step], np.float32)
    known = np.isfinite(xyz_mm[:, :, 2])
    paint = _tinted(xyz_mm[:, :, 2]) if colour is None else colour[::step, ::step].astype(np.float32)
    lit = paint * np.minimum(_light(_normals(xyz_mm)), 1)[:, :, None]
    picture = np.where(known[:, :, None], lit, GROUND).astype(np.uint8)
    height_px = max(1, round(width_px * picture.shape[0] / picture.shape[1]))
    return np.asarray(cv2.resize(picture, (width_px, height_px), interpolation=cv2.INTER_AREA), np.uint8)


def _tinted(depth_mm: Map) -> Map:
    near, far = limits_of(depth_mm)
    far = max(far, near + DEPTH_SHARE * abs(near))
    share = np.clip((depth_mm - near) / (far - near), 0, 1)[:, :, None]
    return np.asarray(NEAR + share * (FAR - NEAR), np.float32)


def _light(normals: Map) -> Map:
    ambient, key, fill = SHARES
    towards = [np.maximum(normals @ (light / np.linalg.norm(light)), 0) for light in (KEY, FILL)]
    return np.asarray(ambient + key * towards[0] + fill * towards[1], np.float32)


def _normals(xyz_mm: Map) -> Map:
    """Find unit normals towards the camera, (H, W, 3), of points averaged over a window."""
    share = cv2.blur(np.isfinite(xyz_mm[:, :, 2]).astype(np.float32), (SMOOTH_PX, SMOOTH_PX))
    sums = cv2.blur(np.nan_to_num(xyz_mm, nan=0.0), (SMOOTH_PX, SMOOTH_PX))
    mean = sums / np.maximum(share, 1e-6)[:, :, None]
    right, down = (cv2.Sobel(mean, cv2.CV_32F, *order, ksize=3, borderType=BORDER) for order in ((1, 0), (0, 1)))
    normals = np.cross(down, right)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-12), np.float32)
