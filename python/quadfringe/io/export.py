"""Write arrays for other programs: PLY for MeshLab and CloudCompare, TIFF for image tools, NPZ for NumPy."""

from __future__ import annotations

import lzma
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import InputError, require
from quadfringe.files import atomic, read_bytes

__all__ = ["grey", "read_npy", "read_npz", "write_depth", "write_npz", "write_ply"]

# A damaged file: numpy parses its header as Python, and zipfile and its decompressors have errors of other kinds.
DAMAGED = (
    *(OSError, EOFError, ValueError, TypeError, LookupError, ArithmeticError, RuntimeError, MemoryError, SyntaxError),
    *(tokenize.TokenError, struct.error, zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)


NUMPY_FILES = {"NPZ": "an archive of arrays (.npz)", "NPY": "a single array (.npy)"}


def grey(modulation: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Convert modulation (H, W) to a grey picture (H, W, 3) uint8; it follows the albedo and shows no fringes."""
    top = np.nanquantile(modulation, 0.99) if np.isfinite(modulation).any() else 1.0
    shades = np.nan_to_num(modulation / max(float(top), 1e-9)).clip(0, 1) * 255
    return np.repeat(shades.astype(np.uint8)[:, :, None], 3, axis=2)


def write_ply(
    path: Path,
    points_mm: NDArray[np.float32],
    colour: NDArray[np.uint8],
    scalars: Mapping[str, NDArray[np.float32]],
) -> None:
    """Write N points as binary PLY: x, y, z (N, 3), mm, colour (N, 3), and scalars (N,) by name."""
    require("trimesh", "export")
    from trimesh import PointCloud
    from trimesh.exchange.ply import export_ply

    cloud = PointCloud(points_mm, colors=colour)
    cloud.vertex_attributes = {name: np.ascontiguousarray(values, np.float32) for name, values in scalars.items()}
    with atomic(path) as temporary:
        temporary.write_bytes(export_ply(cloud))


def write_depth(path: Path, depth_mm: NDArray[np.float32]) -> None:
    """Write a depth map (H, W) as 32-bit float TIFF, mm; missing data stays NaN."""
    tifffile = require("tifffile", "export")
    with atomic(path) as temporary:
        tifffile.imwrite(temporary, depth_mm.astype(np.float32), metadata={"unit": "mm"})


def write_npz(path: Path, maps: Mapping[str, NDArray[Any]], texts: Mapping[str, str]) -> None:
    """Write named maps and named JSON texts to one NPZ file."""
    arrays: dict[str, Any] = {**maps, **{name: np.array(text) for name, text in texts.items()}}
    with atomic(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **arrays)


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read every array of an NPZ file; raises `InputError` for any other file."""
    stored = _load(path, "NPZ")
    if isinstance(stored, np.ndarray):
        raise InputError(f"{path}: expected an archive of arrays (.npz), got a single array")
    return stored


def read_npy(path: Path) -> NDArray[Any]:
    """Read the array of an NPY file; raises `InputError` for any other file."""
    stored = _load(path, "NPY")
    if isinstance(stored, dict):
        raise InputError(f"{path}: expected a single array (.npy), got an archive of arrays")
    return stored


def _load(path: Path, kind: str) -> NDArray[Any] | dict[str, NDArray[Any]]:
    data = read_bytes(path)
    if data and not data.startswith((b"PK", np.lib.format.MAGIC_PREFIX)):
        raise InputError(f"{path}: expected {NUMPY_FILES[kind]}, got another kind of file")
    try:
        stored = np.load(BytesIO(data), allow_pickle=False)
        return stored if isinstance(stored, np.ndarray) else {name: stored[name] for name in stored.files}
    except DAMAGED as error:
        raise InputError(f"{path}: not a readable {kind} file: {error}") from error
