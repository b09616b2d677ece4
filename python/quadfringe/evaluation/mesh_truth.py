"""Compare meshes with the truth of the virtual bench: steps in depth that they cross, normals, holes.

A true step lies between two pixels whose depths differ by more than `STEP_FOOTPRINTS` footprints, and where at
least half of the difference lies between two of the rays that divide a pixel into `RAYS`. A steep but smooth
surface has no step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from quadfringe import _core
from quadfringe.data import Mesh

__all__ = ["STEP_FOOTPRINTS", "Steps", "Topology", "crossing_triangles", "normal_errors_rad", "topology_of"]

STEP_FOOTPRINTS = 4.0  # as the bench has it for its edges
RAYS = 4  # per pixel and axis
TILE_PX = 32

Map = NDArray[np.float64]
Caster = Callable[[_core.Bench], _core.Cast]


@dataclass(frozen=True)
class Steps:
    """True steps in depth, mm, 0 where there is none, (H, W): between a pixel and the next to the right or below."""

    right: Map
    down: Map

    @classmethod
    def of(cls, cast: Caster) -> Steps:
        """Find the steps of a scene on the bench of the published geometry."""
        camera = _core.Bench().camera
        depth_mm = cast(_core.Bench()).xyz_mm()[:, :, 2].astype(np.float64)
        return cls(_steps(cast, camera, depth_mm, 1), _steps(cast, camera, depth_mm, 0))

    def nearby(self) -> Map:
        """Give the largest step within one pixel of each pixel, (H, W)."""
        right, down = (np.maximum(steps, np.roll(steps, 1, axis)) for axis, steps in ((1, self.right), (0, self.down)))
        near: Map = maximum_filter(np.maximum(right, down), 3, mode="constant")
        return near


def _steps(cast: Caster, camera: _core.Device, depth_mm: Map, axis: int) -> Map:
    """Find the steps along an axis: 1 between columns, 0 between rows."""
    difference = np.zeros_like(depth_mm)
    inner = (slice(None), slice(-1)) if axis else (slice(-1), slice(None))
    difference[inner] = np.abs(np.diff(depth_mm, axis=axis))
    found = np.zeros_like(depth_mm)
    focal_px = min(camera.focal_px)
    candidates = difference > STEP_FOOTPRINTS * depth_mm / focal_px
    for y in range(0, depth_mm.shape[0], TILE_PX):
        for x in range(0, depth_mm.shape[1], TILE_PX):
            tile = (slice(y, y + TILE_PX), slice(x, x + TILE_PX))
            if candidates[tile].any():
                largest = _largest(cast, camera, (y, x), axis)[: candidates[tile].shape[0], : candidates[tile].shape[1]]
                is_step = candidates[tile] & (largest > 0.5 * difference[tile])
                found[tile] = np.where(is_step, difference[tile], 0.0)
    return found


def _largest(cast: Caster, camera: _core.Device, corner: tuple[int, int], axis: int) -> Map:
    """Give the largest difference between neighbouring rays between each pixel of a tile and the next one."""
    more = np.array([RAYS, 1] if axis else [1, RAYS])
    size = TILE_PX * more + (1 if axis else 0, 0 if axis else 1)
    centre = (np.array(camera.centre_px) - corner[::-1]) * more
    fx, fy = np.array(camera.focal_px) * more
    tile = _core.Device(int(size[0]), int(size[1]), (float(fx), float(fy)), (float(centre[0]), float(centre[1])))
    depth_mm = cast(_core.Bench(camera=tile)).xyz_mm()[:, :, 2].astype(np.float64)
    across = np.abs(np.diff(depth_mm, axis=axis))
    rays = across.reshape(TILE_PX, TILE_PX, RAYS) if axis else across.reshape(TILE_PX, RAYS, TILE_PX).swapaxes(1, 2)
    largest: Map = rays.max(axis=2)
    return largest


def crossing_triangles(mesh: Mesh, steps: Steps) -> int:
    """Count triangles that span more than half of a true step within one pixel of one of their corners."""
    row, column = mesh.pixel.T
    near = steps.nearby()[row, column][mesh.faces].max(axis=1)
    span = np.ptp(mesh.vertices_mm[:, 2][mesh.faces].astype(np.float64), axis=1)
    return int(np.sum((near > 0) & (span > near / 2)))


def normal_errors_rad(directions: NDArray[np.float32], truth: NDArray[np.float32]) -> Map:
    """Give the angles between normals and true ones, (...) rad; NaN where one is missing."""
    chord = np.linalg.norm(directions.astype(np.float64) - truth, axis=-1)
    return np.asarray(2 * np.arcsin(np.clip(chord / 2, 0, 1)))


@dataclass(frozen=True)
class Topology:
    """Euler number (vertices - edges + triangles) and number of border lines; a disc without holes has 1 and 1."""

    euler: int
    borders: int


def topology_of(faces: NDArray[np.integer]) -> Topology:
    """Count the holes of triangles (F, 3)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), axis=1)
    edges, counts = np.unique(sides, axis=0, return_counts=True)
    border = edges[counts == 1]
    ends, places = np.unique(border, return_inverse=True)
    a, b = places.reshape(-1, 2).T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(ends), len(ends)))
    vertices = len(np.unique(faces))
    return Topology(vertices - len(edges) + len(faces), int(connected_components(graph, directed=False)[0]))
