"""A surface of triangles, and the exact distance of points from it.

The closest triangle is sought among those whose centres are nearest, separately for triangles of similar size, whose
size bounds how much closer than its centre a triangle can be. The search is repeated with more centres until no
triangle that was left out can be closer. Long edges are divided first. Of points that are far from all triangles the
distance may be too large by a tenth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare import params
from quadfringe.errors import InputError, require
from quadfringe.io.mesh_files import read_mesh

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = ["Closest", "Surface", "surface_from", "surface_of_grid"]

Points = NDArray[np.float64]
CHUNK = 20_000  # points at a time: bounds the memory
OCTAVES = 6  # groups of triangles by size; the last one holds all smaller ones
FAR_SIZES = 10  # distance in sizes of a triangle from which a point is far
FARTHEST_MM = 1e6  # the largest coordinate of a mesh
CANDIDATES = 6  # triangles of a group at first


@dataclass(frozen=True)
class Closest:
    """The closest point of a surface for each of N points: points (N, 3), distances (N,), mm, unit normals (N, 3)."""

    points_mm: Points
    distances_mm: NDArray[np.float64]
    normals: Points


class _Group:
    """Triangles of similar size, by their numbers, with a search tree over their centres."""

    def __init__(self, faces: NDArray[np.int64], centres: Points, radius_mm: float) -> None:
        from scipy.spatial import cKDTree

        self.faces, self.radius_mm = faces, radius_mm
        self._tree = cKDTree(centres)

    def nearest(self, points: Points, count: int, most_mm: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Give how far the nearest centres are, and their triangles, both (N, count); beyond `most_mm` infinity."""
        ranks = list(range(1, count + 1))
        away, found = self._tree.query(points, k=ranks, distance_upper_bound=most_mm, workers=-1)
        return away, self.faces[np.minimum(found, len(self.faces) - 1)]


class Surface:
    """Triangles (N, 3, 3), mm, with search trees over their centres."""

    def __init__(self, triangles_mm: Points) -> None:
        self.triangles_mm = _divided(triangles_mm)
        centres = self.triangles_mm.mean(axis=1)
        edges = self.triangles_mm[:, 1:] - self.triangles_mm[:, :1]
        normals = np.cross(edges[:, 0], edges[:, 1])
        self.areas_mm2 = np.linalg.norm(normals, axis=1) / 2
        self.normals = normals / np.maximum(2 * self.areas_mm2, 1e-30)[:, None]
        radius = np.linalg.norm(self.triangles_mm - centres[:, None], axis=-1).max(axis=1)
        octave = np.clip(np.floor(np.log2(radius.max() / np.maximum(radius, 1e-12))), 0, OCTAVES - 1)
        self._groups = [
            _Group(faces, centres[faces], float(radius[faces].max()))
            for faces in (np.flatnonzero(octave == o) for o in reversed(range(OCTAVES)))
            if faces.size
        ]

    def closest(self, points_mm: Points, reach_mm: float = np.inf) -> Closest:
        """Find the closest points; beyond `reach_mm` the distance is infinite."""
        found = [self._closest(points_mm[part], reach_mm) for part in _chunks(len(points_mm))]
        return Closest(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

    def _closest(self, points: Points, reach_mm: float) -> tuple[Points, NDArray[np.float64], Points]:
        best, normal = np.full((len(points), 3), np.nan), np.full((len(points), 3), np.nan)
        distance = np.full(len(points), np.inf)
        for group in self._groups:
            count, near = min(CANDIDATES, len(group.faces)), np.arange(len(points))
            while near.size:
                away, faces = group.nearest(points[near], count, reach_mm + group.radius_mm)
                bound = np.minimum(distance[near], reach_mm) + group.radius_mm
                on, d, face = _nearest(points[near], self.triangles_mm, faces, away < bound[:, None])
                closer = d < distance[near]
                which = near[closer]
                best[which], distance[which], normal[which] = on[closer], d[closer], self.normals[face[closer]]
                beyond = away[:, -1] - group.radius_mm  # no triangle of the group that was left out is closer than this
                least = np.minimum(distance[near], reach_mm)
                least = np.where(least > FAR_SIZES * group.radius_mm, 0.9 * least, least)
                unsure = (beyond < least) & (count < len(group.faces))
                near, count = near[unsure], min(4 * count, len(group.faces))
        distance[distance > reach_mm] = np.inf
        return best, distance, normal


def _chunks(count: int) -> Iterator[slice]:
    return (slice(first, first + CHUNK) for first in range(0, max(count, 1), CHUNK))


def _nearest(
    points: Points, triangles: Points, faces: NDArray[Any], worth: NDArray[np.bool_]
) -> tuple[Points, NDArray[np.float64], NDArray[Any]]:
    """Give the closest point on any of the triangles (N, k) of each point that are worth a look, distance, triangle."""
    from trimesh.triangles import closest_point

    row, column = np.nonzero(worth)
    on = np.asarray(closest_point(triangles[faces[row, column]], points[row])) if row.size else np.empty((0, 3))
    squares = np.full(faces.shape, np.inf)
    squares[row, column] = ((on - points[row]) ** 2).sum(axis=1)
    chosen = squares.argmin(axis=1)
    place = np.arange(len(points)), chosen
    found = np.full((*faces.shape, 3), np.nan)
    found[row, column] = on
    return found[place], np.sqrt(squares[place]), faces[place]


def _divided(triangles: Points) -> Points:
    """Divide triangles with long edges in four, until none is longer than `EDGE_MM` or there are too many."""
    while True:
        edges = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=-1).max(axis=1)
        long = edges > params.EDGE_MM
        if not long.any() or len(triangles) + 3 * int(long.sum()) > params.FACES_MAX:
            return triangles
        a, b, c = (triangles[long][:, i] for i in range(3))
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        triangles = np.concatenate([triangles[~long], *parts])


def surface_from(mesh: Trimesh | Path | str) -> Surface:
    """Read a mesh, in mm, from a file or take one of trimesh; raises `InputError` unless it has triangles."""
    require("trimesh", "export")
    name = str(mesh) if isinstance(mesh, (str, Path)) else "mesh"
    if isinstance(mesh, (str, Path)):
        triangles = read_mesh(Path(mesh)).triangles_mm
    else:
        triangles = np.asarray(getattr(mesh, "triangles", np.empty((0, 3, 3))), np.float64)
    if triangles.ndim != 3 or not len(triangles) or not np.isfinite(triangles).all():
        raise InputError(f"{name}: expected a mesh with triangles, in mm; a cloud of points has none")
    if (farthest := np.abs(triangles).max()) > FARTHEST_MM:
        raise InputError(f"{name}: expected a mesh in mm within a kilometre, got a coordinate of {farthest:.3g} mm")
    return Surface(triangles)


def surface_of_grid(xyz_mm: NDArray[np.floating]) -> Surface:
    """Give the surface of a shape, (H, W, 3) mm, with the triangles of `Shape.mesh`; raises `InputError` for none."""
    from quadfringe import _core

    found = _core.mesh_from_points(np.ascontiguousarray(xyz_mm, np.float32))
    if not len(found["faces"]):
        raise InputError("compare: the second shape has no surface: no neighbouring pixels are returned")
    return Surface(found["points_mm"][found["faces"]].astype(np.float64))
