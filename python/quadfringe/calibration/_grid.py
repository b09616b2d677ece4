"""Detection of the blobs of a circle or ring board and their assignment to its grid; homographies."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import BLOB_AREA_MIN_PX, BLOB_SIZE_RATIO_MAX, NEIGHBOUR_OFF_MAX, SEEDS
from quadfringe.calibration.targets import Target

__all__ = ["GridOrder", "blobs", "homography", "in_grid_order", "jacobians", "symmetries", "through"]

Points = NDArray[np.float64]
LATTICE_OFF_MAX = 1 / 6  # share of the spacing by which lens distortion may displace a point from a homography


def blobs(image: NDArray[np.uint8], target: Target) -> Points:
    """Return the centres (n, 2), px, of similar blobs that may be the rings or discs of the target.

    OpenCV filters by the colour at the centre of a blob, which is white in a ring.
    """
    import cv2

    most = image.size / (target.rows * target.columns)
    settings = cv2.SimpleBlobDetector.Params()
    settings.filterByColor, settings.blobColor = True, 255 if target.kind == "rings" else 0
    settings.filterByArea, settings.minArea, settings.maxArea = True, BLOB_AREA_MIN_PX, float(most)
    settings.filterByCircularity, settings.minCircularity = True, 0.55
    settings.filterByInertia, settings.minInertiaRatio = True, 0.15
    settings.filterByConvexity, settings.minConvexity = True, 0.8
    settings.minThreshold, settings.maxThreshold, settings.thresholdStep = 8, 250, 8
    settings.minDistBetweenBlobs, settings.minRepeatability = 5, 2
    found = cv2.SimpleBlobDetector.create(settings).detect(image)
    places = np.array([blob.pt for blob in found], np.float64).reshape(-1, 2)
    return places[_similar(np.array([blob.size for blob in found]))]


def _similar(sizes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mark the largest group of sizes (n,) whose ratio is possible on one board."""
    if not sizes.size:
        return np.zeros(0, np.bool_)
    inside = [(sizes >= low) & (sizes <= BLOB_SIZE_RATIO_MAX * low) for low in sizes]
    return max(inside, key=lambda group: (int(group.sum()), float(np.median(sizes[group]))))


class GridOrder(NamedTuple):
    """Places (N, 2) in the order of a grid, or None; and the number of points of the grid that were found."""

    places: Points | None
    found: int


def in_grid_order(places: Points, target: Target) -> GridOrder:
    """Order the places like the target's points, up to its symmetries.

    The result has no places when points are missing or do not form this grid. The grid is followed from neighbour to
    neighbour from the middle, which tolerates perspective and lens distortion. OpenCV's `findCirclesGrid` would return
    the same order, but occasionally takes minutes and does not report how many points it found.
    """
    most = 0
    middle = np.linalg.norm(places - np.median(places, axis=0), axis=1) if len(places) else np.zeros(0)
    wanted = _cells(target)
    for seed in np.argsort(middle)[:SEEDS]:
        cells = _followed(places, int(seed))
        order = _matched(cells, wanted)
        most = max(most, int((order >= 0).sum()))
        if (order >= 0).all() and _is_lattice(places[order], target):
            return GridOrder(places[order], most)
    return GridOrder(None, most)


def _cells(target: Target) -> NDArray[np.intp]:
    """Return the integer lattice coordinates (N, 2) of the points along its two shortest directions."""
    half = 0.5 * target.pitch_mm
    basis = [[half, half], [half, -half]] if target.kind == "asymmetric" else [[2 * half, 0], [0, 2 * half]]
    return np.rint(target.points_mm[:, :2] @ np.linalg.inv(basis)).astype(np.intp)


def _followed(places: Points, seed: int) -> dict[tuple[int, int], int]:
    """Return the indices of the places by lattice coordinates, following neighbours from `seed`."""
    away = places - places[seed]
    distance = np.linalg.norm(away, axis=1)
    nearest = [i for i in np.argsort(distance)[1:9] if distance[i] > 0]
    if len(nearest) < 2:
        return {(0, 0): seed}
    first = away[nearest[0]]
    across = [
        v for v in away[nearest] if abs(first[0] * v[1] - first[1] * v[0]) > 0.5 * np.hypot(*first) * np.hypot(*v)
    ]
    if not across:
        return {(0, 0): seed}
    cells, steps, queue = {(0, 0): seed}, {(0, 0): (first, across[0])}, [(0, 0)]
    taken = {seed}
    while queue:
        cell = queue.pop(0)
        for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
            neighbour = (cell[0] + sign * (axis == 0), cell[1] + sign * (axis == 1))
            if neighbour in cells:
                continue
            step = steps[cell][axis]
            missed = np.linalg.norm(places - (places[cells[cell]] + sign * step), axis=1)
            found = int(missed.argmin())
            if missed[found] > NEIGHBOUR_OFF_MAX * np.hypot(*step) or found in taken:
                continue
            taken.add(found)
            cells[neighbour] = found
            moved = sign * (places[found] - places[cells[cell]])
            steps[neighbour] = (moved, steps[cell][1]) if axis == 0 else (steps[cell][0], moved)
            queue.append(neighbour)
    return cells


def _matched(cells: dict[tuple[int, int], int], wanted: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the place index of each wanted cell, -1 where there is none, for the best rotation and translation."""
    numbered = np.array(list(cells))
    low = numbered.min(axis=0)
    size = numbered.max(axis=0) - low + 1
    table = np.full(size, -1, np.intp)
    table[tuple((numbered - low).T)] = list(cells.values())
    best = np.full(len(wanted), -1, np.intp)
    for swap, sx, sy in itertools.product((False, True), (1, -1), (1, -1)):
        turned = wanted[:, :: -1 if swap else 1] * (sx, sy)
        turned = turned - turned.min(axis=0)
        reach = turned.max(axis=0)
        padded = np.pad(table, [(r, r) for r in reach], constant_values=-1)
        for shift in itertools.product(*(range(n + r) for n, r in zip(size, reach, strict=True))):
            found = padded[tuple((turned + shift).T)]
            if (found >= 0).sum() > (best >= 0).sum():
                best = found
    return best


def _is_lattice(places: Points, target: Target) -> bool:
    """Return whether a homography explains the places within `LATTICE_OFF_MAX` of their spacing."""
    matrix = homography(target.points_mm[:, :2], places)
    missed = np.linalg.norm(through(matrix, target.points_mm[:, :2]) - places, axis=1)
    step = np.linalg.norm(places[1] - places[0])
    return bool(missed.max() < LATTICE_OFF_MAX * step)


def symmetries(target: Target) -> list[NDArray[np.intp]]:
    """Return the permutations of the points, (N,) indices each, that rotate or mirror the grid onto itself."""
    points = target.points_mm[:, :2]
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    orders = []
    for swap, sx, sy in itertools.product((False, True), (1, -1), (1, -1)):
        turned = (points - centre)[:, :: -1 if swap else 1] * (sx, sy) + centre
        apart = np.linalg.norm(turned[:, None] - points, axis=2)
        if apart.min(axis=1).max() < 1e-6 * target.pitch_mm:
            orders.append(apart.argmin(axis=1))
    return orders


def homography(points: Points, places: Points) -> Points:
    """Return the least-squares homography (3, 3) from points (n, 2) to places (n, 2); NaN when there is none."""
    import cv2

    matrix, _ = cv2.findHomography(points, places, 0)
    return np.full((3, 3), np.nan) if matrix is None else np.asarray(matrix, np.float64)


def through(matrix: Points, points: Points) -> Points:
    """Map points (..., 2) by a homography."""
    image = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(image[..., :2] / image[..., 2:], np.float64)


def jacobians(matrix: Points, points: Points) -> Points:
    """Return the Jacobians (..., 2, 2) of a homography at points (..., 2)."""
    image = points @ matrix[:, :2].T + matrix[:, 2]
    place, depth = image[..., :2] / image[..., 2:], image[..., 2]
    change = matrix[:2, :2] - place[..., :, None] * matrix[2, :2]
    return np.asarray(change / depth[..., None, None], np.float64)
