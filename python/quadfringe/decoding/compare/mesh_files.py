"""Read the triangles of a mesh file, which may come from anybody, in a helper process."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare import params
from quadfringe.errors import InputError
from quadfringe.files import read_bytes, require_suffix
from quadfringe.io.bounded import BoundedError, Helper, Limits
from quadfringe.io.export import GLB_FROM_MM

__all__ = ["SUFFIXES", "triangles_in"]

SUFFIXES = (".stl", ".ply", ".obj", ".glb")  # formats that hold everything in one file


def triangles_in(path: Path) -> NDArray[np.float64]:
    """Read triangles, (N, 3, 3), mm; raises `InputError` for a file that holds no mesh or takes too long.

    Files have mm along the axes of the camera frame, and .glb metres with y up, as `Shape.save` writes them. Materials
    and other files that it names are not opened.
    """
    require_suffix(path, SUFFIXES)
    if not path.exists():
        raise InputError(f"{path}: no such file; expected a mesh such as {', '.join(SUFFIXES)}")
    size = path.stat().st_size
    limits = Limits(
        params.MESH_S + size / params.MESH_BYTES_PER_S, params.MESH_MEMORY_BYTES + params.MESH_MEMORY_RATIO * size
    )
    try:
        with Helper(limits) as helper:
            triangles = helper.run(_triangles, path)
    except BoundedError as error:
        raise InputError(f"{path}: cannot be read as a mesh: it {error}") from error
    return triangles / GLB_FROM_MM if path.suffix.lower() == ".glb" else triangles


def _triangles(path: Path) -> NDArray[np.float64]:
    """Read with trimesh; runs in the helper process."""
    import trimesh

    data = read_bytes(path)
    try:
        mesh = trimesh.load_mesh(BytesIO(data), file_type=path.suffix.lower()[1:])
        return np.asarray(getattr(mesh, "triangles", np.empty((0, 3, 3))), np.float64)
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001 - readers of trimesh answer damage with almost any exception
        words = str(error).partition("\n")[0] or type(error).__name__
        raise InputError(f"{path}: cannot be read as a mesh: {words}") from None
