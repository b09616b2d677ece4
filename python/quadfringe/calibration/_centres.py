"""Sub-pixel centres of rings and discs.

A centre is the centroid of the darkness 1 - I / W, where the white level W is a plane fitted to the surrounding paper.
Each edge pixel contributes in proportion to its ink, blur does not move a centroid, and W removes shading. Perspective
moves the centroid of the image of a circle away from the image of its centre; the homography of the board gives this
shift, which is subtracted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._grid import homography, jacobians, through
from quadfringe.calibration._params import CENTRE_ROUNDS, INK_MIN, PAPER_FROM_RADII, WINDOW_RADII
from quadfringe.calibration.targets import Target

__all__ = ["darkness_centroids", "perspective_shift", "refined_centres"]

Points = NDArray[np.float64]
PLANE_PIXELS_MIN = 6  # twice the three unknowns of a plane
CIRCLE = np.stack([f(np.linspace(0, 2 * np.pi, 72, endpoint=False)) for f in (np.cos, np.sin)], axis=1)


def refined_centres(image: NDArray[np.float32], target: Target, places: Points) -> Points:
    """Refine the image points (N, 2), px, of a ring or disc board from `places` (N, 2) that err by a few pixels.

    `image` is (H, W) in any unit, approximately linear in light. A point is NaN when its window leaves the image or
    shows no ink.
    """
    points = target.points_mm[:, :2]
    centres = places
    for _ in range(CENTRE_ROUNDS):
        known = np.isfinite(centres).all(axis=1)
        matrix = homography(points[known], centres[known])
        shift = perspective_shift(matrix, target)
        centroids = darkness_centroids(image, target, centres + shift, jacobians(matrix, points))
        centres = centroids - shift
    return centres


def darkness_centroids(image: NDArray[np.float32], target: Target, places: Points, slopes: Points) -> Points:
    """Return the centroid (N, 2), px, of the darkness around each place; `slopes` (N, 2, 2) are px per mm of board."""
    radius_mm = 0.5 * (target.diameter_mm or 0.0)
    reach_mm = min(WINDOW_RADII * radius_mm, 0.49 * _nearest_mm(target))  # just short of half way to a neighbour
    found = np.full_like(places, np.nan)
    for i, (place, slope) in enumerate(zip(places, slopes, strict=True)):
        half = reach_mm * np.linalg.norm(slope, axis=1)
        if not np.isfinite(place).all() or not np.isfinite(half).all():
            continue
        low, high = np.floor(place - half).astype(int), np.ceil(place + half).astype(int) + 1
        if (low < 0).any() or (high > image.shape[::-1]).any():
            continue
        window = image[low[1] : high[1], low[0] : high[0]].astype(np.float64)
        x, y = np.arange(low[0], high[0]) - place[0], (np.arange(low[1], high[1]) - place[1])[:, None]
        back = np.linalg.inv(slope)
        distance_mm = np.hypot(back[0, 0] * x + back[0, 1] * y, back[1, 0] * x + back[1, 1] * y)
        inside = distance_mm < reach_mm
        paper = inside & (distance_mm > PAPER_FROM_RADII * radius_mm)
        found[i] = place + _centroid(window, x, y, inside, paper)
    return found


def _centroid(
    window: Points, x: Points, y: Points, inside: NDArray[np.bool_], paper: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the centroid (2,), px, of the darkness of a window, relative to its place; NaN without ink."""
    x, y = np.broadcast_arrays(x, y)
    plane = np.stack([np.ones(int(paper.sum())), x[paper], y[paper]], axis=1)
    if len(plane) < PLANE_PIXELS_MIN:
        return np.full(2, np.nan)
    level, *_ = np.linalg.lstsq(plane, window[paper], rcond=None)
    white = level[0] + level[1] * x + level[2] * y
    dark = np.where(inside & (white > 0), 1 - window / np.where(white > 0, white, 1), 0.0)
    total = dark.sum()
    if total < INK_MIN * inside.sum():
        return np.full(2, np.nan)
    return np.array([(dark * x).sum() / total, (dark * y).sum() / total])


def perspective_shift(matrix: Points, target: Target) -> Points:
    """Return the shift (N, 2), px, from the image of each ring's centre to the centroid of the ring's image."""
    points = target.points_mm[:, :2]
    disc = _moments(matrix, points, 0.5 * (target.diameter_mm or 0.0))
    if target.hole_mm is not None:
        hole = _moments(matrix, points, 0.5 * target.hole_mm)
        disc = _Moments(disc.area - hole.area, disc.first - hole.first)
    return np.asarray(disc.first / disc.area[:, None], np.float64)


class _Moments(NamedTuple):
    """Area (N,), px^2, and first moment (N, 2), px^3, of image regions."""

    area: Points
    first: Points


def _moments(matrix: Points, points: Points, radius_mm: float) -> _Moments:
    """Integrate over the images of circles, relative to the images of their centres, by Green's theorem."""
    edge = through(matrix, points[:, None] + radius_mm * CIRCLE) - through(matrix, points)[:, None]
    following = np.roll(edge, -1, axis=1)
    cross = edge[..., 0] * following[..., 1] - following[..., 0] * edge[..., 1]
    return _Moments(0.5 * cross.sum(axis=1), ((edge + following) * cross[..., None]).sum(axis=1) / 6)


def _nearest_mm(target: Target) -> float:
    points = target.points_mm
    return float(np.sort(np.linalg.norm(points - points[0], axis=1))[1])
