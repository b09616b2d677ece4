"""Planes, spheres and steps fitted to measured points, for the acceptance test of an instrument.

Terms follow VDI/VDE 2634 part 2: the form error is the range of the distances of the measured points from the fitted
surface without the worst three of a thousand; the size error is the measured minus the calibrated diameter.

>>> import numpy as np
>>> from quadfringe.calibration.surfaces import *
>>> x, y = np.meshgrid(np.linspace(-60, 60, 121), np.linspace(-60, 60, 121))
>>> flat = np.dstack([x, y, 800 + 0.01 * x])
>>> plane = fit_plane(flat)
>>> isinstance(plane, Plane), form_of(plane.distances_mm(flat)).form_mm < 1e-6
(True, True)
>>> isinstance(form_of(dominant_plane(flat).distances_mm(flat)), Form)
True
>>> radius = 34.0
>>> ball = np.dstack([x, y, 800 - np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0))])
>>> ball[x**2 + y**2 > (0.8 * radius) ** 2] = np.nan
>>> sphere = fit_sphere(ball, guess=dominant_sphere(ball, 2 * radius))
>>> isinstance(sphere, Sphere), round(sphere.radius_mm, 6)
(True, 34.0)
>>> bool(cap_towards_camera(ball, sphere, 30.0).any())
True
>>> stairs = flat.copy()
>>> stairs[40:80, 20:50, 2] -= 10.0
>>> stairs[40:80, 70:100, 2] -= 20.0
>>> steps = measure_steps(stairs, (10.0, 20.0))
>>> isinstance(steps, StepsResult), [round(height, 1) for height in steps.measured_mm]
(True, [10.0, 20.0])
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import FIT_POINTS_MIN, SPHERE_SIZE_REACH
from quadfringe.errors import InputError

__all__ = [
    "Form",
    "Plane",
    "Sphere",
    "StepsResult",
    "cap_towards_camera",
    "dominant_plane",
    "dominant_sphere",
    "fit_plane",
    "fit_sphere",
    "form_of",
    "measure_steps",
]

Array = NDArray[np.float64]
Points = NDArray[np.floating]
LEFT_OUT = 0.003  # share of points that VDI/VDE 2634 allows to leave out
CUT_SIGMA = 3.0  # half the 6 sigma band


@dataclass(frozen=True)
class Plane:
    """The plane normal . P = offset_mm; the unit normal (3,) points to the camera."""

    normal: Array
    offset_mm: float

    def distances_mm(self, xyz_mm: Points) -> Array:
        """Return the signed distances (...), mm, of points (..., 3), positive on the side of the camera."""
        return np.asarray(xyz_mm, float) @ self.normal - self.offset_mm


@dataclass(frozen=True)
class Sphere:
    """Centre (3,) and radius, mm."""

    centre_mm: Array
    radius_mm: float

    def distances_mm(self, xyz_mm: Points) -> Array:
        """Return the distances (...), mm, of points (..., 3) from the surface, positive outside."""
        return np.asarray(np.linalg.norm(np.asarray(xyz_mm, float) - self.centre_mm, axis=-1) - self.radius_mm)


@dataclass(frozen=True)
class Form:
    """Statistics of the distances of points from a fitted surface.

    `sigma_mm` is their standard deviation, `form_mm` their range without the worst 3 of 1000 points (VDI/VDE 2634),
    `form_6sigma_mm` the range of the points within +-3 sigma, `range_mm` the range of all points, and `cut_percent` the
    share of points outside +-3 sigma.
    """

    points: int
    sigma_mm: float
    form_mm: float
    form_6sigma_mm: float
    range_mm: float
    cut_percent: float


def form_of(distances_mm: Points) -> Form:
    """Return the form of distances from a fitted surface; NaN is ignored. Raises `InputError` below 100 points."""
    found = np.sort(_finite(distances_mm))
    if found.size < FIT_POINTS_MIN:
        raise InputError(f"form: {found.size} points; at least {FIT_POINTS_MIN} are needed for a form error")
    sigma = float(found.std())
    inside = found[np.abs(found - found.mean()) <= CUT_SIGMA * sigma]
    by_size = np.sort(np.abs(found - np.median(found)))
    kept = found[np.abs(found - np.median(found)) <= by_size[int(np.ceil((1 - LEFT_OUT) * found.size)) - 1]]
    return Form(
        points=found.size,
        sigma_mm=sigma,
        form_mm=float(np.ptp(kept)),
        form_6sigma_mm=float(np.ptp(inside)),
        range_mm=float(np.ptp(found)),
        cut_percent=100 * (1 - inside.size / found.size),
    )


def fit_plane(xyz_mm: Points) -> Plane:
    """Fit a plane by total least squares to points (..., 3); NaN is ignored. Raises `InputError` below 100 points."""
    points = _points(xyz_mm, "plane")
    centre = points.mean(axis=0)
    normal = np.linalg.eigh(np.cov((points - centre).T))[1][:, 0]
    normal = -normal if normal @ centre > 0 else normal
    return Plane(normal, float(normal @ centre))


def fit_sphere(xyz_mm: Points, guess: Sphere | None = None) -> Sphere:
    """Fit a sphere by least squares of the distances (Gauss-Newton); NaN is ignored.

    Without a guess, the iteration starts from the linear least-squares sphere. Raises `InputError` below 100 points.
    """
    points = _points(xyz_mm, "sphere")
    shift = points.mean(axis=0)
    local = points - shift
    if guess is None:
        design = np.column_stack([2 * local, np.ones(len(local))])
        solved = np.linalg.lstsq(design, np.sum(local**2, axis=1), rcond=None)[0]
        centre, radius = solved[:3], float(np.sqrt(max(solved[3] + solved[:3] @ solved[:3], 1e-12)))
    else:
        centre, radius = guess.centre_mm - shift, guess.radius_mm
    for _ in range(20):
        away = local - centre
        length = np.linalg.norm(away, axis=1)
        slopes = np.column_stack([away / length[:, None], np.ones(len(local))])
        step = np.linalg.lstsq(slopes, length - radius, rcond=None)[0]
        centre, radius = centre + step[:3], radius + float(step[3])
        if np.abs(step).max() < 1e-9:
            break
    return Sphere(centre + shift, radius)


def dominant_plane(xyz_mm: Points, band_mm: float = 0.5, trials: int = 2000, seed: int = 0) -> Plane:
    """Find the plane with most points (..., 3) within `band_mm`, and fit it to these points (RANSAC).

    With 2000 trials, a plane that holds a fifth of all points is missed with probability (1 - 0.2^3)^2000 = 1e-7.
    """
    points = _points(xyz_mm, "plane")
    random = np.random.default_rng(seed)
    sample = points[random.choice(len(points), min(len(points), 5000), replace=False)]
    best, most = fit_plane(points), -1
    for _ in range(trials):
        a, b, c = sample[random.choice(len(sample), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        length = float(np.linalg.norm(normal))
        if length < 1e-6:
            continue
        trial = Plane(normal / length, float(normal @ a / length))
        count = int(np.count_nonzero(np.abs(trial.distances_mm(sample)) < band_mm))
        if count > most:
            best, most = trial, count
    for _ in range(3):
        best = fit_plane(points[np.abs(best.distances_mm(points)) < band_mm])
    return best


def dominant_sphere(
    xyz_mm: Points, diameter_mm: float, band_mm: float = 0.5, trials: int = 400, seed: int = 0
) -> Sphere:
    """Find the sphere of about this diameter (within 5 %) with most points (..., 3) within `band_mm` (RANSAC).

    Raises `InputError` when fewer than 100 points lie on such a sphere.
    """
    points = _points(xyz_mm, "sphere")
    random = np.random.default_rng(seed)
    sample = points[random.choice(len(points), min(len(points), 5000), replace=False)]
    best: Sphere | None = None
    most = 0
    for start in sample[random.choice(len(sample), trials)]:
        near = sample[np.linalg.norm(sample - start, axis=1) < 0.5 * diameter_mm]
        if len(near) < 4:
            continue
        trial = _sphere_through(near[random.choice(len(near), 4, replace=False)])
        if trial is None or abs(2 * trial.radius_mm / diameter_mm - 1) > SPHERE_SIZE_REACH:
            continue
        count = int(np.count_nonzero(np.abs(trial.distances_mm(sample)) < band_mm))
        if count > most:
            best, most = trial, count
    if best is None or np.count_nonzero(np.abs(best.distances_mm(points)) < band_mm) < FIT_POINTS_MIN:
        raise InputError(
            f"sphere: found no sphere of about {diameter_mm:g} mm diameter in {len(points)} points; check the diameter"
        )
    found = best
    for _ in range(3):
        found = fit_sphere(points[np.abs(found.distances_mm(points)) < band_mm], found)
    return found


def cap_towards_camera(xyz_mm: Points, sphere: Sphere, within_deg: float) -> NDArray[np.bool_]:
    """Return which points (..., 3) the camera, at the origin, sees within this angle of the surface normal."""
    xyz = np.asarray(xyz_mm, float)
    outward = xyz - sphere.centre_mm
    lengths = np.linalg.norm(outward, axis=-1) * np.linalg.norm(xyz, axis=-1)
    return np.asarray(-(outward * xyz).sum(axis=-1) > np.cos(np.radians(within_deg)) * lengths)


@dataclass(frozen=True)
class StepsResult:
    """Heights of flat tops above the base, mm, in the order of the nominal heights, with the points of each.

    `base` is the form of the base plane; `height_mm` (H, W) is the map of heights above it, NaN without data.
    """

    nominal_mm: tuple[float, ...]
    measured_mm: tuple[float, ...]
    points: tuple[int, ...]
    base: Form
    height_mm: Array

    @property
    def errors_mm(self) -> tuple[float, ...]:
        """Measured minus nominal heights, mm."""
        return tuple(m - n for m, n in zip(self.measured_mm, self.nominal_mm, strict=True))


def measure_steps(
    xyz_mm: Points, heights_mm: Sequence[float], reach_mm: float = 1.0, margin_px: int = 4
) -> StepsResult:
    """Measure flat tops parallel to a base plane in a map (H, W, 3), mm, that shows more of the base than of any top.

    A top consists of the pixels within `reach_mm` of a nominal height and at least `margin_px` pixels from all others;
    its height is the mean distance from the base. Raises `InputError` when a top has fewer than 100 points, or when two
    nominal heights, or one and 0, are closer than twice the reach.
    """
    nominal = [float(h) for h in heights_mm]
    apart = np.diff(np.sort(np.unique([0.0, *nominal])))
    if not nominal or apart.min(initial=np.inf) < 2 * reach_mm:
        raise InputError(
            f"steps: expected nominal heights at least {2 * reach_mm:g} mm apart from each other and from 0, got "
            f"{nominal}"
        )
    base = dominant_plane(xyz_mm)
    height = base.distances_mm(xyz_mm)
    base_points = _inner(np.abs(height) < reach_mm, margin_px)
    base = fit_plane(np.asarray(xyz_mm)[base_points])
    height = base.distances_mm(xyz_mm)
    measured, counts = [], []
    for h in nominal:
        top = height[_inner(np.abs(height - h) < reach_mm, margin_px)]
        if top.size < FIT_POINTS_MIN:
            raise InputError(
                f"steps: {top.size} points lie near {h:g} mm, at least {FIT_POINTS_MIN} are needed; check the nominal "
                "heights"
            )
        measured.append(float(top.mean()))
        counts.append(int(top.size))
    return StepsResult(tuple(nominal), tuple(measured), tuple(counts), form_of(height[base_points]), height)


def _inner(region: NDArray[np.bool_], margin_px: int) -> NDArray[np.bool_]:
    import cv2

    square = np.ones((2 * margin_px + 1,) * 2, np.uint8)
    return np.asarray(cv2.erode(region.astype(np.uint8), square, borderValue=0), bool)


def _sphere_through(four: Array) -> Sphere | None:
    """Return the sphere through four points (4, 3); None when they are nearly coplanar."""
    first = four[0]
    away = four[1:] - first
    if abs(np.linalg.det(away)) < 1e-3 * np.prod(np.linalg.norm(away, axis=1)):
        return None
    centre = np.linalg.solve(2 * away, np.sum(away**2, axis=1))
    return Sphere(centre + first, float(np.linalg.norm(centre)))


def _finite(values: Points) -> Array:
    flat = np.asarray(values, float).ravel()
    return np.asarray(flat[np.isfinite(flat)])


def _points(xyz_mm: Points, what: str) -> Array:
    points = np.asarray(xyz_mm, float).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < FIT_POINTS_MIN:
        raise InputError(f"{what}: {len(points)} points; at least {FIT_POINTS_MIN} are needed for a fit")
    return np.asarray(points)
