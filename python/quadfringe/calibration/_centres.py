"""Sub-pixel centres of rings and discs.

A centre is the centroid of the darkness 1 - I / W around it, where the white level W is a plane fitted to the paper
beside it. Every edge pixel counts with the share that is inked, blur leaves a centroid alone, and W takes out shading.
The centroid of the image of a circle is not the image of its centre: what perspective moves it by is known from the
homography of the board and taken off. `tests/test_targets.py` holds that this beats OpenCV's blob centres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._grid import homography, jacobians, through
from quadfringe.calibration.targets import Target

__all__ = ["darkness_centroids", "perspective_shift", "refined_centres"]

Points = NDArray[np.float64]
REACH = 1.65  # of the radius: how far the window around a ring goes, unless a neighbour is nearer
PAPER_FROM = 1.25  # of the radius: paper begins here, out of the reach of blur
ROUNDS = 3
CIRCLE = np.stack([f(np.linspace(0, 2 * np.pi, 72, endpoint=False)) for f in (np.cos, np.sin)], axis=1)


def refined_centres(image: NDArray[np.float32], target: Target, places: Points) -> Points:
    """Give the images (N, 2) of the points of a ring or disc target, from places (N, 2) good to a few pixels.

    `image` is (H, W), any unit, linear or nearly so. NaN where the window of a point leaves the image or shows no ink.
    """
    points = target.points_mm[:, :2]
    centres = places
    for _ in range(ROUNDS):
        known = np.isfinite(centres).all(axis=1)
        matrix = homography(points[known], centres[known])
        shift = perspective_shift(matrix, target)
        centroids = darkness_centroids(image, target, centres + shift, jacobians(matrix, points))
        centres = centroids - shift
    return centres


def darkness_centroids(image: NDArray[np.float32], target: Target, places: Points, slopes: Points) -> Points:
    """Give the centroid (N, 2) of the darkness around each place; `slopes` (N, 2, 2) are pixels per mm of the board."""
    radius_mm = 0.5 * (target.diameter_mm or 0.0)
    reach_mm = min(REACH * radius_mm, 0.49 * _nearest_mm(target))
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
        paper = inside & (distance_mm > PAPER_FROM * radius_mm)
        found[i] = place + _centroid(window, x, y, inside, paper)
    return found


def _centroid(
    window: Points, x: Points, y: Points, inside: NDArray[np.bool_], paper: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Give the centroid of the darkness of a window, from its middle; NaN without ink."""
    x, y = np.broadcast_arrays(x, y)
    plane = np.stack([np.ones(int(paper.sum())), x[paper], y[paper]], axis=1)
    if len(plane) < 6:
        return np.full(2, np.nan)
    level, *_ = np.linalg.lstsq(plane, window[paper], rcond=None)
    white = level[0] + level[1] * x + level[2] * y
    dark = np.where(inside & (white > 0), 1 - window / np.where(white > 0, white, 1), 0.0)
    total = dark.sum()
    if total < 0.05 * inside.sum():
        return np.full(2, np.nan)
    return np.array([(dark * x).sum() / total, (dark * y).sum() / total])


def perspective_shift(matrix: Points, target: Target) -> Points:
    """Give how far (N, 2) the centroid of each ring's image lies from the image of its centre, px."""
    points = target.points_mm[:, :2]
    outer = _area_and_moment(matrix, points, 0.5 * (target.diameter_mm or 0.0))
    area, moment = outer
    if target.hole_mm is not None:
        hole = _area_and_moment(matrix, points, 0.5 * target.hole_mm)
        area, moment = area - hole[0], moment - hole[1]
    return np.asarray(moment / area[:, None], np.float64)


def _area_and_moment(matrix: Points, points: Points, radius_mm: float) -> tuple[Points, Points]:
    """Area (N,) and first moment (N, 2) of the images of circles, relative to the images of their centres (Green)."""
    edge = through(matrix, points[:, None] + radius_mm * CIRCLE) - through(matrix, points)[:, None]
    following = np.roll(edge, -1, axis=1)
    cross = edge[..., 0] * following[..., 1] - following[..., 0] * edge[..., 1]
    moment = ((edge + following) * cross[..., None]).sum(axis=1) / 6
    return 0.5 * cross.sum(axis=1), moment


def _nearest_mm(target: Target) -> float:
    points = target.points_mm
    return float(np.sort(np.linalg.norm(points - points[0], axis=1))[1])
