"""Planes and spheres through measured points, and the steps between planes: what an instrument is judged by.

Terms follow VDI/VDE 2634, part 2: form is the range of the distances of measured points from the fitted surface, after
three points in a thousand, the worst, may be left out; size is the measured diameter minus the calibrated one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
LEFT_OUT = 0.003  # share of points that VDI/VDE 2634 lets be left out
CUT_SIGMA = 3.0  # half the 6 sigma band
POINTS_MIN = 100
SIZE_REACH = 0.05  # share by which a sphere that is looked for may differ from its calibrated diameter


@dataclass(frozen=True)
class Plane:
    """The plane normal . P = offset_mm; the unit normal points to the camera."""

    normal: Array
    offset_mm: float

    def distances_mm(self, xyz_mm: Points) -> Array:
        """Give signed distances (...) of points (..., 3), positive on the side of the camera."""
        return np.asarray(xyz_mm, float) @ self.normal - self.offset_mm


@dataclass(frozen=True)
class Sphere:
    """Centre (3,) and radius, mm."""

    centre_mm: Array
    radius_mm: float

    def distances_mm(self, xyz_mm: Points) -> Array:
        """Give distances (...) of points (..., 3) from the surface, positive outside."""
        return np.asarray(np.linalg.norm(np.asarray(xyz_mm, float) - self.centre_mm, axis=-1) - self.radius_mm)


@dataclass(frozen=True)
class Form:
    """How points lie about a fitted surface.

    `sigma_mm` is their standard deviation. `form_mm` is the range with the worst 3 of 1000 points left out (VDI/VDE
    2634), `form_6sigma_mm` the range of the points inside the band of +-3 sigma, `range_mm` that of all.
    """

    points: int
    sigma_mm: float
    form_mm: float
    form_6sigma_mm: float
    range_mm: float
    cut_percent: float


def form_of(distances_mm: Points) -> Form:
    """Give the form of distances from a fitted surface; NaN is no point. Raises `InputError` below 100 points."""
    found = np.sort(_finite(distances_mm))
    if found.size < POINTS_MIN:
        raise InputError(f"form: {found.size} points; at least {POINTS_MIN} are needed for a form error")
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
    """Fit a plane by total least squares to points (..., 3); NaN is no point. Raises `InputError` below 100 points."""
    points = _points(xyz_mm, "plane")
    centre = points.mean(axis=0)
    normal = np.linalg.eigh(np.cov((points - centre).T))[1][:, 0]
    normal = -normal if normal @ centre > 0 else normal
    return Plane(normal, float(normal @ centre))


def fit_sphere(xyz_mm: Points, guess: Sphere | None = None) -> Sphere:
    """Fit a sphere of free radius by least squares of distances; NaN is no point. Raises `InputError` below 100 points.

    Without a guess it starts from the sphere of least squares in |P|^2.
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
    """Give the plane that most points (..., 3) lie within `band_mm` of, fitted to these points.

    Of so many `trials` one has its three points on a plane that holds a fifth of all (chance of none: 1e-7).
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
    """Give the sphere of about the diameter (within 5 %) that most points (..., 3) lie within `band_mm` of.

    Raises `InputError` when fewer than 100 points lie on one.
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
        if trial is None or abs(2 * trial.radius_mm / diameter_mm - 1) > SIZE_REACH:
            continue
        count = int(np.count_nonzero(np.abs(trial.distances_mm(sample)) < band_mm))
        if count > most:
            best, most = trial, count
    if best is None or np.count_nonzero(np.abs(best.distances_mm(points)) < band_mm) < POINTS_MIN:
        raise InputError(f"sphere: no sphere of about {diameter_mm:g} mm diameter is among {len(points)} points")
    found = best
    for _ in range(3):
        found = fit_sphere(points[np.abs(found.distances_mm(points)) < band_mm], found)
    return found


def cap_towards_camera(xyz_mm: Points, sphere: Sphere, within_deg: float) -> NDArray[np.bool_]:
    """Tell which points (..., 3) see the camera, at the origin, within an angle of the normal of the sphere."""
    xyz = np.asarray(xyz_mm, float)
    outward = xyz - sphere.centre_mm
    lengths = np.linalg.norm(outward, axis=-1) * np.linalg.norm(xyz, axis=-1)
    return np.asarray(-(outward * xyz).sum(axis=-1) > np.cos(np.radians(within_deg)) * lengths)


@dataclass(frozen=True)
class StepsResult:
    """Heights of flat tops over the base, mm, in the order of the nominal ones, and how many points each has.

    `height_mm` is the map (H, W) of heights over the base.
    """

    nominal_mm: tuple[float, ...]
    measured_mm: tuple[float, ...]
    points: tuple[int, ...]
    base: Form
    height_mm: Array

    @property
    def errors_mm(self) -> tuple[float, ...]:
        """Measured minus nominal."""
        return tuple(m - n for m, n in zip(self.measured_mm, self.nominal_mm, strict=True))


def measure_steps(
    xyz_mm: Points, heights_mm: Sequence[float], reach_mm: float = 1.0, margin_px: int = 4
) -> StepsResult:
    """Measure flat tops parallel to a base plane, in a map (H, W, 3) that shows more of the base than of any top.

    A top is what lies within `reach_mm` of a nominal height and at least `margin_px` pixels away from everything else;
    its height is the mean distance from the base. Raises `InputError` when a top has fewer than 100 points, or when two
    nominal heights are nearer to one another than twice the reach.
    """
    nominal = [float(h) for h in heights_mm]
    apart = np.diff(np.sort(np.unique([0.0, *nominal])))
    if not nominal or apart.min(initial=np.inf) < 2 * reach_mm:
        raise InputError(f"steps: nominal heights {nominal} mm must be {2 * reach_mm:g} mm apart from each other and 0")
    base = dominant_plane(xyz_mm)
    height = base.distances_mm(xyz_mm)
    base_points = _inner(np.abs(height) < reach_mm, margin_px)
    base = fit_plane(np.asarray(xyz_mm)[base_points])
    height = base.distances_mm(xyz_mm)
    measured, counts = [], []
    for h in nominal:
        top = height[_inner(np.abs(height - h) < reach_mm, margin_px)]
        if top.size < POINTS_MIN:
            raise InputError(f"steps: {top.size} points lie near {h:g} mm; expected a flat top of that height")
        measured.append(float(top.mean()))
        counts.append(int(top.size))
    return StepsResult(tuple(nominal), tuple(measured), tuple(counts), form_of(height[base_points]), height)


def _inner(region: NDArray[np.bool_], margin_px: int) -> NDArray[np.bool_]:
    import cv2

    square = np.ones((2 * margin_px + 1,) * 2, np.uint8)
    return np.asarray(cv2.erode(region.astype(np.uint8), square, borderValue=0), bool)


def _sphere_through(four: Array) -> Sphere | None:
    """Give the sphere through four points (4, 3); None when they lie nearly in a plane."""
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
    if len(points) < POINTS_MIN:
        raise InputError(f"{what}: {len(points)} points; at least {POINTS_MIN} are needed for a fit")
    return np.asarray(points)
