"""Measuring on a shape: the point under a pointer, the distance of two points, and the section between them.

Lengths are mm, and rays start anywhere. The uncertainty is that of the noise, which each pixel has; errors
of the calibration move neighbours alike and are not part of it.

>>> a = Spot((0.0, 0.0, 800.0), (10, 20), 0.1)
>>> b = Spot((3.0, 4.0, 800.0), (10, 30), 0.1)
>>> distance(a, b).length_mm
5.0

>>> points_mm = np.array([[0.0, 0.0, 800.0], [10.0, 0.0, 800.0], [0.0, 10.0, 800.0]], np.float32)
>>> faces = np.array([[0, 1, 2]])
>>> ray = Ray(np.zeros(3), np.array([2.0, 1.0, 800.0]) / np.linalg.norm([2.0, 1.0, 800.0]))
>>> isinstance(ray, Ray), hit(points_mm, faces, ray).corner
(True, 0)
>>> length = distance(Spot((0.0, 0.0, 800.0)), Spot((10.0, 0.0, 800.0)))
>>> isinstance(length, Distance), length.length_mm
(True, 10.0)
>>> section = plane_section(points_mm, faces, (0.0, 1.0, 800.0), (9.0, 1.0, 800.0), np.array([0.0, 0.0, 1.0]))
>>> isinstance(section, Section), section.unit
(True, 'mm')
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Distance", "Ray", "Section", "Spot", "distance", "grid_section", "hit", "nearest", "plane_section"]

Floats = NDArray[np.floating[Any]]
Place = tuple[float, float, float]
NEAR_RAD = 5e-3  # three pixels of a page: a click so far from a thin part still means it
LAYER = 6.0  # in spacings: how far behind the foremost point near the ray the surface that it meets may lie
SAMPLES = 400  # of a section through triangles: as many as a plot has pixels


@dataclass(frozen=True)
class Ray:
    """A half-line from `origin` along `direction`, (3,) mm; the direction has length 1."""

    origin: NDArray[np.float64]
    direction: NDArray[np.float64]


@dataclass(frozen=True)
class Spot:
    """A point on a shape: X, Y, Z in mm, row and column of its pixel, and standard deviation of Z; None if unknown."""

    place_mm: Place
    pixel: tuple[int, int] | None = None
    uncertainty_mm: float | None = None


@dataclass(frozen=True)
class Distance:
    """The length from one spot to another, its parts along x, y and z, and its standard deviation; None if unknown."""

    length_mm: float
    parts_mm: Place
    uncertainty_mm: float | None


@dataclass(frozen=True)
class Section:
    """A profile (N,): `height_mm` over `along`, which is counted in `unit`; NaN where there is no surface.

    `height` says what the profile shows. uncertainty_mm (N,): its standard deviation; None if unknown.
    """

    along: Floats
    unit: str
    height_mm: Floats
    height: str
    uncertainty_mm: Floats | None = None


def nearest(points_mm: Floats, ray: Ray, spacing_mm: float) -> int | None:
    """Return the index of the point (N, 3) that a ray meets first; None when it passes all by.

    `spacing_mm` is the distance of neighbours. A surface has points within it of every ray through it; of those in the
    foremost layer, the nearest to the ray is taken. Points that are farther from the ray count only when none is near.

    >>> points = np.array([[0.0, 0.0, 5.0], [0.1, 0.0, 5.0], [0.1, 0.0, 9.0]])
    >>> nearest(points, Ray(np.zeros(3), np.array([0.0, 0.0, 1.0])), 0.2)
    0
    """
    away = np.asarray(points_mm, np.float32) - ray.origin.astype(np.float32)
    depth = away @ ray.direction.astype(np.float32)
    off = np.sqrt(np.maximum(np.einsum("ij,ij->i", away, away) - depth**2, 0))
    for reach in (np.float32(spacing_mm), np.maximum(np.float32(spacing_mm), NEAR_RAD * depth)):
        near = np.flatnonzero((depth > 0) & (off <= reach))
        if near.size:
            layer = near[depth[near] <= depth[near].min() + LAYER * spacing_mm]
            return int(layer[np.argmin(off[layer])])
    return None


@dataclass(frozen=True)
class Hit:
    """Where a ray meets a triangle: the place (3,) mm, and the nearest corner of that triangle."""

    place_mm: Place
    corner: int


def hit(points_mm: Floats, faces: NDArray[np.integer[Any]], ray: Ray) -> Hit | None:
    """Return where a ray first meets triangles (F, 3) of points (M, 3); None when it meets none."""
    away = np.asarray(points_mm, np.float64) - ray.origin
    flat = away @ _across(ray.direction).T
    # The ray is the origin of the plane across it. A triangle around it has corners on both sides along both axes,
    # which one byte for each corner tells fast; inside, the origin lies on one side of all three edges.
    sides = ((flat[:, 0] > 0) + 2 * (flat[:, 1] > 0)).astype(np.uint8)
    a, b, c = (sides[faces[:, k]] for k in range(3))
    faces = faces[((a | b | c) == 3) & ((a & b & c) == 0)]
    u, v = flat[faces, 0], flat[faces, 1]
    following, last = np.roll(np.arange(3), -1), np.roll(np.arange(3), 1)
    areas = u[:, following] * v[:, last] - u[:, last] * v[:, following]  # column k: of the edge that faces corner k
    whole = areas.sum(axis=1)
    inside = np.flatnonzero(((areas >= 0).all(axis=1) | (areas <= 0).all(axis=1)) & (whole != 0))
    weights = areas[inside] / whole[inside, None]
    depth = (weights * (away[faces[inside]] @ ray.direction)).sum(axis=1)
    ahead = np.flatnonzero(depth > 0)
    if not ahead.size:
        return None
    first = ahead[np.argmin(depth[ahead])]
    corners = faces[inside[first]]
    place = ray.origin + depth[first] * ray.direction
    return Hit(_place(place), int(corners[np.argmax(weights[first])]))


def distance(a: Spot, b: Spot) -> Distance:
    """Give the distance from one spot to another.

    The noise of the depth moves a point along its ray from the camera, which is the origin. What counts is the share of
    that ray in the direction of the line.
    """
    first, second = np.asarray(a.place_mm, np.float64), np.asarray(b.place_mm, np.float64)
    parts = second - first
    length = float(np.linalg.norm(parts))
    known = a.uncertainty_mm is not None and b.uncertainty_mm is not None and first[2] > 0 and second[2] > 0
    sigma = None
    if known and length > 0:
        shares = [float(parts @ spot) / (length * float(spot[2])) for spot in (first, second)]
        sigma = math.hypot(shares[0] * (a.uncertainty_mm or 0.0), shares[1] * (b.uncertainty_mm or 0.0))
    return Distance(length, _place(parts), sigma)


def grid_section(
    depth_mm: Floats, uncertainty_mm: Floats | None, first: tuple[int, int], last: tuple[int, int]
) -> Section:
    """Give the depth (H, W) along the line of pixels from `first` to `last`, row and column each.

    >>> grid_section(np.arange(12.0).reshape(3, 4), None, (0, 0), (0, 3)).height_mm
    array([0., 1., 2., 3.])
    """
    steps = max(abs(last[0] - first[0]), abs(last[1] - first[1]), 1)
    rows, columns = (np.rint(np.linspace(first[k], last[k], steps + 1)).astype(np.intp) for k in (0, 1))
    along = np.linspace(0.0, math.hypot(last[0] - first[0], last[1] - first[1]), steps + 1)
    sigma = None if uncertainty_mm is None else uncertainty_mm[rows, columns]
    return Section(along, "px", depth_mm[rows, columns], "depth", sigma)


def plane_section(
    points_mm: Floats, faces: NDArray[np.integer[Any]], first: Place, last: Place, view: NDArray[np.float64]
) -> Section:
    """Cut triangles (F, 3) of points (M, 3) by the plane through the line from `first` to `last` and `view`, (3,).

    `view` is the direction of sight. The section is the foremost cut at each of 401 places along the line, as height
    over the line towards the viewer.
    """
    start, line = np.asarray(first, np.float64), np.subtract(last, first).astype(np.float64)
    length = float(np.linalg.norm(line))
    along = np.linspace(0.0, length, SAMPLES + 1)
    height = np.full(along.shape, -np.inf)
    if length > 0:
        axis = line / length
        up = -(view - (view @ axis) * axis)
        up = up / np.linalg.norm(up) if np.linalg.norm(up) > 1e-6 else _across(axis)[0]
        for cut in _cuts(np.asarray(points_mm, np.float64) - start, faces, np.stack([axis, up])):
            _raise_to(height, along, cut)
    height[np.isneginf(height)] = np.nan
    return Section(along, "mm", height, "height over the line")


def _cuts(away: Floats, faces: NDArray[np.integer[Any]], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give the segments (N, 2, 2) in which a plane through the origin, spanned by `axes` (2, 3), cuts triangles."""
    side = away @ np.cross(axes[0], axes[1])
    above = side[faces] >= 0
    crossed = faces[(above.any(axis=1)) & (~above.all(axis=1))]
    flat = away @ axes.T
    ends = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = crossed[:, i], crossed[:, j]
        cut = (side[a] >= 0) != (side[b] >= 0)
        share = np.where(cut, side[a] / np.where(cut, side[a] - side[b], 1.0), np.nan)[:, None]
        ends.append(flat[a] + share * (flat[b] - flat[a]))
    found = np.stack(ends, axis=1)  # each triangle has two edges that are cut and one that is not
    segments: NDArray[np.float64] = found[np.isfinite(found[:, :, 0])].reshape(-1, 2, 2)
    return segments


def _raise_to(height: NDArray[np.float64], along: NDArray[np.float64], cut: NDArray[np.float64]) -> None:
    """Raise a profile to a segment, two ends of place and height."""
    (left, low), (right, high) = cut[np.argsort(cut[:, 0])]
    first, last = np.searchsorted(along, left, "left"), np.searchsorted(along, right, "right")
    if last > first:
        share = (along[first:last] - left) / max(right - left, 1e-12)
        np.maximum(height[first:last], low + share * (high - low), out=height[first:last])


def _across(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give two directions (2, 3) across a direction and each other, so that all three turn right."""
    other = np.eye(3)[np.argmin(np.abs(direction))]
    first = np.cross(other, direction)
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])


def _place(place: NDArray[np.float64]) -> Place:
    return (float(place[0]), float(place[1]), float(place[2]))
