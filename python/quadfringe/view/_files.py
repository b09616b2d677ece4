"""Files that the page of saved shapes opens, by suffix: each is one item, or a series of them."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.errors import InputError, require
from quadfringe.files import FILE_BYTES, read_bytes
from quadfringe.io.declared import IMAGE_PX
from quadfringe.io.export import GLB_FROM_MM
from quadfringe.io.glb import encoded
from quadfringe.recording.series import Series
from quadfringe.view._bodies import NO_FACES
from quadfringe.view._items import Grid, Item, Solid

__all__ = ["SUFFIXES", "Opened", "open_file"]

SUFFIXES = (".npz", ".zarr", ".ply", ".glb", ".obj", ".stl")
PLAIN = 200  # grey of what has no colour
# What trimesh raises for a file that it cannot read.
UNREADABLE = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, EOFError, RuntimeError, struct.error)


@dataclass(frozen=True)
class Opened:
    """An opened file: `count` items, of which `item` reads one; raises `InputError` for one that cannot be shown."""

    path: Path
    count: int
    item: Callable[[int], Item]
    is_series: bool = False


def open_file(path: Path) -> Opened:
    """Find out what a file holds; raises `InputError` for one that cannot be opened, naming it and what was expected.

    Shapes are read when they are asked for.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: expected a saved shape, {', '.join(SUFFIXES)}")
    if suffix == ".zarr":
        series = Series.open(path)
        return Opened(path, len(series), lambda shot: Grid(series.shape(shot)), is_series=True)
    if not path.is_file():
        read_bytes(path, 0)  # says why
    reader = {".npz": _npz, ".ply": _ply}.get(suffix, _mesh)
    return Opened(path, 1, partial(_read, reader, path))


def _read(reader: Callable[[Path], Item], path: Path, _index: int) -> Item:
    return reader(path)


def _npz(path: Path) -> Item:
    shape = Shape.load(path)
    try:
        return Grid(shape)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _ply(path: Path) -> Item:
    """Read points or triangles; points with row and column become a grid again."""
    loaded = _loaded(path)
    vertices = (getattr(loaded, "metadata", {}).get("_ply_raw") or {}).get("vertex", {}).get("data")
    names = getattr(getattr(vertices, "dtype", None), "names", None) or ()
    kept = [name for name in ("row", "column", "quality", "uncertainty_mm") if name in names]
    values = {name: np.asarray(vertices[name]).reshape(len(vertices)) for name in kept}
    points_mm, colour = _points(path, loaded), _colours(loaded)
    faces = getattr(loaded, "faces", NO_FACES)
    if len(faces) or not {"row", "column"} <= values.keys():
        values = {name: numbers for name, numbers in values.items() if len(numbers) == len(points_mm)}
        return Solid(points_mm, np.asarray(faces, np.uint32), colour, values)
    return _grid(path, points_mm, colour, values)


def _grid(path: Path, points_mm: NDArray[np.float32], colour: NDArray[np.uint8], values: dict[str, Any]) -> Grid:
    row, column = (np.asarray(values[name], np.int64) for name in ("row", "column"))
    height, width = int(row.max()) + 1, int(column.max()) + 1
    if min(row.min(), column.min()) < 0 or height * width > IMAGE_PX:
        raise InputError(f"{path}: row, column: expected those of an image of at most {IMAGE_PX:,} pixels")

    def spread(numbers: NDArray[Any], empty: float) -> NDArray[Any]:
        found = np.full((height, width, *numbers.shape[1:]), empty, numbers.dtype)
        found[row, column] = numbers
        return found

    none = np.full((height, width), np.nan, np.float32)
    quality, sigma = (
        spread(np.asarray(values[name], np.float32), np.nan) if name in values else None
        for name in ("quality", "uncertainty_mm")
    )
    shape = Shape(
        none, none, none, none if quality is None else quality, xyz_mm=spread(points_mm, np.nan), uncertainty_mm=sigma
    )
    return Grid(shape, spread(colour, 0))


def _mesh(path: Path) -> Item:
    loaded = _loaded(path)
    points_mm, colour = _points(path, loaded), _colours(loaded)
    if path.suffix.lower() == ".glb":  # metres with y up
        points_mm = np.asarray(points_mm / GLB_FROM_MM, np.float32)
    faces = np.asarray(getattr(loaded, "faces", NO_FACES), np.uint32)
    if not len(faces):
        raise InputError(f"{path}: expected a mesh with triangles")
    return Solid(points_mm, faces, colour)


def _loaded(path: Path) -> Any:
    """Read a file with trimesh, as one mesh or cloud."""
    trimesh = require("trimesh", "view")
    if path.stat().st_size > FILE_BYTES:
        raise InputError(f"{path}: expected at most {FILE_BYTES / 1e6:.0f} MB")
    try:
        # The triangles of STL share no corners: they are merged, so that the surface is shaded smoothly.
        loaded = trimesh.load(path, process=path.suffix.lower() == ".stl")
        return _one(trimesh, loaded, path.suffix.lower()) if isinstance(loaded, trimesh.Scene) else loaded
    except UNREADABLE as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error


def _one(trimesh: Any, scene: Any, suffix: str) -> Any:
    """Join the meshes of a scene; colours of glTF are linear, and trimesh drops those of a mesh with a material."""
    for mesh in scene.geometry.values() if suffix == ".glb" else ():
        colour = getattr(mesh.visual, "vertex_attributes", {}).get("color")
        if colour is None and mesh.visual.kind == "vertex":
            colour = mesh.visual.vertex_colors
        if colour is not None:
            most = np.iinfo(colour.dtype).max if colour.dtype.kind == "u" else 1.0
            coded = encoded(np.asarray(colour, np.float32)[:, :3] / most)
            mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=coded)
    return scene.to_mesh()


def _points(path: Path, loaded: Any) -> NDArray[np.float32]:
    points = np.asarray(getattr(loaded, "vertices", np.empty((0, 3))), np.float32)
    if points.ndim != 2 or not len(points) or not np.isfinite(points).all():
        raise InputError(f"{path}: expected finite points, got {len(points)} points")
    return points


def _colours(loaded: Any) -> NDArray[np.uint8]:
    """Give a colour for each point, grey for a file without colours; a picture on the surface is sampled."""
    count = len(loaded.vertices)
    found = getattr(loaded, "colors", None) if not hasattr(loaded, "faces") else None
    visual: Any = getattr(loaded, "visual", None)
    if getattr(visual, "kind", None) == "texture":
        visual = visual.to_color()
    if getattr(visual, "kind", None) in ("vertex", "face"):
        found = visual.vertex_colors
    if found is None or np.shape(found)[:1] != (count,):
        return np.full((count, 3), PLAIN, np.uint8)
    return np.asarray(found, np.uint8)[:, :3]
