"""Files that the page of saved shapes opens, by suffix: each is one item, or a series of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.errors import InputError
from quadfringe.files import read_bytes
from quadfringe.io.declared import IMAGE_PX
from quadfringe.io.mesh_files import SUFFIXES as MESHES
from quadfringe.io.mesh_files import read_mesh
from quadfringe.recording.series import Series
from quadfringe.view._items import Grid, Item, Solid

__all__ = ["SUFFIXES", "Opened", "open_file"]

SUFFIXES = (".npz", ".zarr", *MESHES)
PLAIN = 200  # grey of what has no colour
VALUES = ("quality", "uncertainty_mm")


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
    reader = _npz if suffix == ".npz" else _mesh
    return Opened(path, 1, partial(_read, reader, path))


def _read(reader: Callable[[Path], Item], path: Path, _index: int) -> Item:
    return reader(path)


def _npz(path: Path) -> Item:
    shape = Shape.load(path)
    try:
        return Grid(shape)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _mesh(path: Path) -> Item:
    """Read points or triangles; points with row and column become a grid again."""
    loaded = read_mesh(path)
    points_mm, values = np.asarray(loaded.points_mm, np.float32), loaded.values
    if not len(points_mm) or not np.isfinite(points_mm).all():
        raise InputError(f"{path}: expected finite points, got {len(points_mm)} points")
    colour = np.full(points_mm.shape, PLAIN, np.uint8) if loaded.colour is None else loaded.colour
    if not len(loaded.faces) and path.suffix.lower() != ".ply":
        raise InputError(f"{path}: expected a mesh with triangles")
    if len(loaded.faces) or not {"row", "column"} <= values.keys():
        kept = {name: values[name] for name in ("row", "column", *VALUES) if name in values}
        return Solid(points_mm, loaded.faces, colour, kept)
    return _grid(path, points_mm, colour, values)


def _grid(path: Path, points_mm: NDArray[np.float32], colour: NDArray[np.uint8], values: Mapping[str, Any]) -> Grid:
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
        spread(np.asarray(values[name], np.float32), np.nan) if name in values else None for name in VALUES
    )
    shape = Shape(
        none, none, none, none if quality is None else quality, xyz_mm=spread(points_mm, np.nan), uncertainty_mm=sigma
    )
    return Grid(shape, spread(colour, 0))
