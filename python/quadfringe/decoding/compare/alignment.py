"""A rigid motion that brings points onto a surface: point to plane, robust against clutter and partial overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare import params
from quadfringe.decoding.compare.surface import Surface
from quadfringe.errors import InputError

__all__ = ["Alignment", "align"]

Points = NDArray[np.float64]
FEWEST = 50  # points, below which no motion is estimated


@dataclass(frozen=True)
class Alignment:
    """The motion (4, 4), T_surface_camera in mm, its residual RMS, mm, and the share of points that it rests on."""

    transform: NDArray[np.float64]
    rms_mm: float
    used: float


def align(points_mm: Points, surface: Surface) -> Alignment:
    """Move points (N, 3) onto a surface; raises `InputError` when fewer than 50 points can be matched.

    It starts from where the points are, and from 24 rotations about the middle of the points and of the side of the
    surface that would then be seen. The one with the smallest median distance is refined. More than half of the points
    must belong to the surface.
    """
    if len(points_mm) < FEWEST:
        raise InputError(f"align: expected at least {FEWEST} points, got {len(points_mm)}")
    random = np.random.default_rng(0)
    some = points_mm[random.choice(len(points_mm), min(len(points_mm), params.ALIGN_POINTS), replace=False)]
    few = some[: params.TRIAL_POINTS]
    trials = [_refined(few, surface, start, params.TRIAL_ITERATIONS) for start in _starts(few, surface, random)]
    best = min(trials, key=lambda trial: _score(few, surface, trial))
    transform = _refined(some, surface, best, params.ITERATIONS)
    distances = surface.closest(moved(some, transform)).distances_mm
    kept = distances <= _limit(distances)
    return Alignment(transform, float(np.sqrt(np.mean(distances[kept] ** 2))), float(kept.mean()))


def moved(points_mm: Points, transform: NDArray[np.float64]) -> Points:
    """Apply a motion (4, 4) to points (..., 3)."""
    return np.asarray(points_mm @ transform[:3, :3].T + transform[:3, 3])


def _starts(points: Points, surface: Surface, random: np.random.Generator) -> list[NDArray[np.float64]]:
    from scipy.spatial.transform import Rotation

    starts = [np.eye(4)]
    middle = np.median(points, axis=0)
    weights = surface.areas_mm2 / surface.areas_mm2.sum()
    faces = random.choice(len(weights), min(4000, len(weights)), p=weights)
    centres, normals = surface.triangles_mm[faces].mean(axis=1), surface.normals[faces]
    for rotation in Rotation.create_group("O").as_matrix():
        seen = normals @ (rotation @ (0.0, 0.0, 1.0)) < 0  # these face the camera, whose axis is turned too
        start = np.eye(4)
        start[:3, :3] = rotation
        start[:3, 3] = np.median(centres[seen] if seen.any() else centres, axis=0) - rotation @ middle
        starts.append(start)
    return starts


def _score(points: Points, surface: Surface, transform: NDArray[np.float64]) -> float:
    return float(np.median(surface.closest(moved(points, transform)).distances_mm))


def _limit(distances: NDArray[np.float64]) -> float:
    """Give the distance beyond which a point does not count: it lies on what the surface does not show."""
    return max(params.TRIM_SIGMAS * params.NORMAL * float(np.median(distances)), 1e-6)


def _refined(points: Points, surface: Surface, transform: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """Repeat: closest points, then the small motion that lowers the distances along the normals (D6)."""
    from scipy.spatial.transform import Rotation

    for _ in range(most):
        at = moved(points, transform)
        found = surface.closest(at)
        kept = found.distances_mm <= _limit(found.distances_mm)
        middle = at[kept].mean(axis=0)
        p, q, n = at[kept] - middle, found.points_mm[kept] - middle, found.normals[kept]
        terms = np.hstack([np.cross(p, n), n])
        turn_shift = np.linalg.lstsq(terms, np.sum((q - p) * n, axis=1), rcond=None)[0]
        step = np.eye(4)
        step[:3, :3] = Rotation.from_rotvec(turn_shift[:3]).as_matrix()
        step[:3, 3] = turn_shift[3:] + middle - step[:3, :3] @ middle
        transform = step @ transform
        if float(np.abs(moved(at, step) - at).max()) < params.STILL_MM:
            break
    return transform
