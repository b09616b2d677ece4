"""`Mesh`: the surface of a shape as triangles, and `Normals`: its normals as maps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import SIZE_MAX
from quadfringe.data.points import xyz_mm_of
from quadfringe.errors import InputError, require
from quadfringe.files import require_suffix
from quadfringe.io import export

if TYPE_CHECKING:
    from quadfringe.data.shape import Shape

__all__ = ["SUFFIXES", "Mesh", "Normals", "mesh_of", "normals_of"]

SUFFIXES = (".stl", ".obj", ".glb", ".ply")
HOLES_MAX_PX = 1000  # that the kernel takes, too; larger numbers need not fit into its integers
SCALARS = ("quality", "uncertainty_mm", "wrong_order_probability")

Floats = NDArray[np.float32]


@dataclass(frozen=True, repr=False)
class Mesh:
    """Triangles on the grid of pixels, in the camera frame; `Shape.mesh` makes one.

    vertices_mm: points (M, 3) float32, in the order of the image.
    faces: vertices of each triangle (F, 3) uint32, counter-clockwise as the camera sees them.
    normals: unit normals (M, 3) float32 towards the camera; NaN where the triangles have no area.
    normal_uncertainty_rad: root mean square angle (M,) between a normal and the true one, from the noise of the depth.
    pixel: row and column (M, 2) uint32 of each vertex.
    colour: (M, 3) uint8.
    filled: True (M,) in holes that were filled, where nothing was measured and the values below are NaN.
    step: every n-th pixel of every n-th row was taken.
    quality, uncertainty_mm, wrong_order_probability: those of the shape, (M,) float32; None when the shape has none.
    """

    vertices_mm: Floats
    faces: NDArray[np.uint32]
    normals: Floats
    normal_uncertainty_rad: Floats
    pixel: NDArray[np.uint32]
    colour: NDArray[np.uint8]
    filled: NDArray[np.bool_]
    step: int = 1
    quality: Floats | None = None
    uncertainty_mm: Floats | None = None
    wrong_order_probability: Floats | None = None

    def __repr__(self) -> str:
        marks = [f"{int(self.filled.sum())} filled"] if self.filled.any() else []
        marks += [f"step {self.step}"] if self.step > 1 else []
        return f"Mesh({', '.join([f'{len(self.vertices_mm)} vertices', f'{len(self.faces)} triangles', *marks])})"

    @property
    def scalars(self) -> dict[str, NDArray[Any]]:
        """What is known of each vertex by name: row, column, filled, and those values of the shape that it has."""
        row, column = self.pixel.astype(np.int32).T
        known = {name: getattr(self, name) for name in SCALARS}
        found = {"row": row, "column": column, "filled": self.filled.astype(np.uint8)}
        return found | {name: values for name, values in known.items() if values is not None}

    def to_trimesh(self) -> Any:
        """Give a `trimesh.Trimesh` in mm with normals, colours, and `scalars` as vertex attributes.

        Raises `MissingExtraError` without trimesh.
        """
        return self._triangles().to_trimesh()

    def to_open3d(self) -> Any:
        """Give an `open3d.geometry.TriangleMesh` in mm with normals and colours.

        Raises `MissingExtraError` without Open3D.
        """
        open3d = require("open3d", "open3d")
        vectors = open3d.utility.Vector3dVector
        found = open3d.geometry.TriangleMesh()
        found.vertices = vectors(self.vertices_mm.astype(np.float64))
        found.triangles = open3d.utility.Vector3iVector(self.faces.astype(np.int32))
        found.vertex_normals = vectors(np.nan_to_num(self.normals).astype(np.float64))
        found.vertex_colors = vectors(self.colour / 255.0)
        return found

    def save(self, path: Path | str) -> None:
        """Write by suffix: .stl, .obj, .glb or .ply. Whole or not at all.

        Coordinates are mm in the camera frame; in GLB they are metres with y up, as the format wants it. STL holds no
        colours and no normals of vertices, PLY alone holds `scalars`. Raises `InputError` for another suffix, a mesh
        without triangles, and a folder that does not exist; `MissingExtraError` without trimesh, except for GLB.
        """
        path = Path(path)
        require_suffix(path, SUFFIXES)
        if not len(self.faces):
            raise InputError(f"{path}: the mesh has no triangles: no three neighbouring pixels lie on one surface")
        export.write_mesh(path, self._triangles())

    def _triangles(self) -> export.Triangles:
        return export.Triangles(self.vertices_mm, self.faces, self.normals, self.colour, self.scalars)


@dataclass(frozen=True, repr=False)
class Normals:
    """Normals of a shape; `Shape.normals` makes them.

    directions: unit normals (H, W, 3) float32 towards the camera; NaN where a point has no neighbours on its surface.
    uncertainty_rad: root mean square angle (H, W) between a normal and the true one, from the noise of the depth.
    """

    directions: Floats
    uncertainty_rad: Floats

    def __repr__(self) -> str:
        rows, columns = self.uncertainty_rad.shape
        return f"Normals({columns} x {rows}, {np.isfinite(self.uncertainty_rad).mean():.1%} known)"


def mesh_of(shape: Shape, step: int, fill_holes_px: int, colour: NDArray[np.uint8] | None) -> Mesh:
    """Triangulate a shape; see `Shape.mesh`."""
    from quadfringe import _core

    xyz_mm = _points(shape)
    for name, value, least, most in (("step", step, 1, SIZE_MAX), ("fill_holes_px", fill_holes_px, 0, HOLES_MAX_PX)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
            raise InputError(f"{name}: expected a whole number of at least {least}, got {value!r}")
        if value > most:
            raise InputError(f"{name}: expected at most {most}, got {value!r}")
    colour = shape.colour if colour is None else _colour(colour, xyz_mm.shape)
    try:
        found = _core.mesh_from_points(xyz_mm, _deviations(shape), step=int(step), holes_px=int(fill_holes_px))
    except ValueError as error:
        raise InputError(str(error).replace("holes_px", "fill_holes_px")) from error
    row, column = found["pixels"].T
    place = row.astype(np.intp) * xyz_mm.shape[1] + column
    scalars = {name: getattr(shape, name) for name in SCALARS}
    taken = {name: None if values is None else values.ravel().take(place) for name, values in scalars.items()}
    for values in taken.values():
        if values is not None and fill_holes_px:
            values[found["filled"]] = np.nan
    return Mesh(
        vertices_mm=found["points_mm"],
        faces=found["faces"],
        normals=found["normals"],
        normal_uncertainty_rad=found["normal_uncertainty_rad"],
        pixel=found["pixels"],
        colour=colour.reshape(-1, 3).take(place, axis=0),
        filled=found["filled"],
        step=int(step),
        **taken,
    )


def normals_of(shape: Shape) -> Normals:
    """Find the normals of a shape; see `Shape.normals`."""
    from quadfringe import _core

    found = _core.normals_from_points(_points(shape), _deviations(shape))
    return Normals(found["normals"], found["uncertainty_rad"])


def _points(shape: Shape) -> Floats:
    return np.asarray(xyz_mm_of(shape), np.float32)


def _deviations(shape: Shape) -> Floats | None:
    return None if shape.uncertainty_mm is None else np.asarray(shape.uncertainty_mm, np.float32)


def _colour(colour: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Give the colours of the pixels; raise `InputError` unless they are a picture of the size of the shape."""
    if not isinstance(colour, np.ndarray) or colour.shape != shape or colour.dtype != np.uint8:
        got = f"{colour.dtype} {colour.shape}" if isinstance(colour, np.ndarray) else type(colour).__name__
        raise InputError(f"colour: expected a picture of uint8 {shape}, red, green and blue, got {got}")
    return colour
