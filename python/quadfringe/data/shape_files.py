"""Files of a shape for other programs, by suffix."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data.mesh import SCALARS, normals_of
from quadfringe.data.points import xyz_mm_of
from quadfringe.errors import InputError
from quadfringe.io import export
from quadfringe.io.e57 import write_e57
from quadfringe.io.pcd import write_pcd

if TYPE_CHECKING:
    from quadfringe.data.shape import Shape

__all__ = ["MESHES", "check_choices", "write_pixels"]

MESHES = (".stl", ".obj", ".glb")


def check_choices(path: Path, suffix: str, *, faces: bool, step: int, fill_holes_px: int) -> bool:
    """Say whether the file holds a mesh; raise `InputError` for choices that its kind does not have."""
    if faces and suffix not in (*MESHES, ".ply"):
        raise InputError(f"{path}: {suffix} holds no faces; name a file of {', '.join(MESHES)} or .ply")
    is_mesh = faces or suffix in MESHES
    if not is_mesh and (step != 1 or fill_holes_px != 0):
        hint = "; for a .ply with triangles, ask for faces" if suffix == ".ply" else ""
        raise InputError(f"{path}: step and fill_holes_px are choices of a mesh, and {suffix} holds every pixel{hint}")
    return is_mesh


def write_pixels(shape: Shape, path: Path, suffix: str) -> None:
    """Write the points as .ply, .pcd or .e57, or the depth as TIFF."""
    if suffix == ".ply":
        points_mm = xyz_mm_of(shape)
        valid = np.asarray(np.isfinite(points_mm).all(axis=2))
        export.write_ply(path, points_mm[valid], shape.colour[valid], _of_points(shape, valid))
    elif suffix == ".pcd":
        write_pcd(path, _organised(shape))
    elif suffix == ".e57":
        write_e57(path, xyz_mm_of(shape), shape.colour, shape.modulation)
    else:
        export.write_depth(path, xyz_mm_of(shape)[:, :, 2])


def _scalars(shape: Shape) -> dict[str, NDArray[Any]]:
    return {name: values for name, values in shape.maps.items() if name in SCALARS}


def _of_points(shape: Shape, valid: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    """Give what is known of each point by name; a normal is 0, 0, 0 where there is none, as readers of PLY expect."""
    directions = np.nan_to_num(normals_of(shape).directions[valid])
    row, column = (places.astype(np.int32) for places in np.nonzero(valid))
    named = {f"n{axis}": directions[:, k] for k, axis in enumerate("xyz")} | {"row": row, "column": column}
    return named | {name: values[valid] for name, values in _scalars(shape).items()}


def _organised(shape: Shape) -> dict[str, NDArray[Any]]:
    """Give the fields of a PCD file by name, (H, W); NaN where there is no data, as PCL has it."""
    points_mm, directions = xyz_mm_of(shape), normals_of(shape).directions
    red, green, blue = (shape.colour[:, :, k].astype(np.uint32) for k in range(3))
    fields: dict[str, NDArray[Any]] = {axis: points_mm[:, :, k] for k, axis in enumerate("xyz")}
    fields["rgb"] = (red << 16 | green << 8 | blue).view(np.float32)
    fields |= {f"normal_{axis}": directions[:, :, k] for k, axis in enumerate("xyz")}
    return fields | _scalars(shape)
