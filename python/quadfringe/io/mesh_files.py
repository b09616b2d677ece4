"""Read meshes and clouds of other programs, which may come from anybody, in a helper process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import InputError
from quadfringe.files import read_bytes, require_suffix
from quadfringe.io.bounded import BoundedError, Helper, Limits
from quadfringe.io.export import GLB_FROM_MM
from quadfringe.io.glb import encoded

__all__ = ["SUFFIXES", "LoadedMesh", "read_mesh"]

SUFFIXES = (".stl", ".ply", ".obj", ".glb")  # formats that hold everything in one file
# Time for reading any file, s, and bytes that may take another second. A text of 8 MB, which holds a million triangles,
# takes 4 s, and one of some kB imports trimesh in 0.5 s. Less time refuses large meshes on a busy machine, more of it
# delays the error for a hostile file. `pytest tests/test_compare_meshes.py` reads hostile files.
TIME_S, BYTES_PER_S = 4.0, 1e6
# Memory for reading any file, bytes, and for each of its bytes. Follows from a text of 14 bytes for a triangle, which
# takes 72 bytes, and the copies of it. Less memory refuses large meshes.
MEMORY_BYTES, MEMORY_RATIO = 1 << 30, 64


@dataclass(frozen=True)
class LoadedMesh:
    """Points (N, 3) mm float64, triangles (F, 3) uint32, none for a cloud, and colours (N, 3) uint8 if there are any.

    `values` are the properties of the points in a PLY file by name, (N,).
    """

    points_mm: NDArray[np.float64]
    faces: NDArray[np.uint32]
    colour: NDArray[np.uint8] | None = None
    values: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def triangles_mm(self) -> NDArray[np.float64]:
        """Corners of the triangles, (F, 3, 3)."""
        return self.points_mm[self.faces]


def read_mesh(path: Path) -> LoadedMesh:
    """Read a mesh or a cloud; raises `InputError` for a file that holds none or takes too long.

    Files have mm along the axes of the camera frame, and .glb metres with y up, as `Shape.save` writes them. Materials
    and other files that it names are not opened.
    """
    require_suffix(path, SUFFIXES)
    if not path.exists():
        raise InputError(f"{path}: no such file; expected a mesh such as {', '.join(SUFFIXES)}")
    size = path.stat().st_size
    limits = Limits(TIME_S + size / BYTES_PER_S, MEMORY_BYTES + MEMORY_RATIO * size)
    try:
        with Helper(limits) as helper:
            return helper.run(_loaded, path)
    except BoundedError as error:
        raise InputError(f"{path}: cannot be read as a mesh: it {error}") from error


def _loaded(path: Path) -> LoadedMesh:
    """Read with trimesh; runs in the helper process."""
    import trimesh

    data, suffix = read_bytes(path), path.suffix.lower()
    try:
        # The triangles of STL share no corners: they are merged, so that a page shades the surface smoothly.
        loaded: Any = trimesh.load(BytesIO(data), file_type=suffix[1:], process=suffix == ".stl")
        if isinstance(loaded, trimesh.Scene):
            loaded = _one(loaded)
        return _described(loaded, suffix)
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001 - readers of trimesh answer damage with almost any exception
        words = str(error).partition("\n")[0] or type(error).__name__
        raise InputError(f"{path}: cannot be read as a mesh: {words}") from None


def _one(scene: Any) -> Any:
    """Join the meshes of a glTF scene; its colours are linear, and trimesh drops those of a mesh with a material."""
    import trimesh

    for mesh in scene.geometry.values():
        colour = getattr(mesh.visual, "vertex_attributes", {}).get("color")
        if colour is None and mesh.visual.kind == "vertex":
            colour = mesh.visual.vertex_colors
        if colour is not None:
            most = np.iinfo(colour.dtype).max if colour.dtype.kind == "u" else 1.0
            coded = encoded(np.asarray(colour, np.float32)[:, :3] / most)
            mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=coded)
    return scene.to_mesh()


def _described(loaded: Any, suffix: str) -> LoadedMesh:
    points = np.asarray(getattr(loaded, "vertices", np.empty((0, 3))), np.float64).reshape(-1, 3)
    faces = np.asarray(getattr(loaded, "faces", np.empty((0, 3))), np.int64).reshape(-1, 3)
    if faces.size and not (faces.min() >= 0 and faces.max() < len(points)):
        raise InputError(f"a triangle names point {faces.max()} of {len(points)}")
    points_mm = points / GLB_FROM_MM if suffix == ".glb" else points
    return LoadedMesh(points_mm, faces.astype(np.uint32), _colours(loaded, len(points)), _values(loaded, len(points)))


def _values(loaded: Any, count: int) -> dict[str, NDArray[Any]]:
    """Give the properties of the points of a PLY file that are single numbers."""
    vertices = (getattr(loaded, "metadata", {}).get("_ply_raw") or {}).get("vertex", {}).get("data")
    names = getattr(getattr(vertices, "dtype", None), "names", None) or ()
    found = {name: np.asarray(vertices[name]) for name in names}
    return {name: values.reshape(count) for name, values in found.items() if values.size == count}


def _colours(loaded: Any, count: int) -> NDArray[np.uint8] | None:
    """Give a colour for each point; a picture on the surface is sampled."""
    found = None if hasattr(loaded, "faces") else getattr(loaded, "colors", None)
    visual: Any = getattr(loaded, "visual", None)
    if getattr(visual, "kind", None) == "texture":
        visual = visual.to_color()
    if getattr(visual, "kind", None) in ("vertex", "face"):
        found = visual.vertex_colors
    return None if found is None or np.shape(found)[:1] != (count,) else np.asarray(found, np.uint8)[:, :3]
