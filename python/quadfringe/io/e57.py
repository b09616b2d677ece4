"""E57 files (ASTM E2807), which programs for laser scans read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import InputError, require
from quadfringe.files import atomic

__all__ = ["write_e57"]


def write_e57(
    path: Path,
    xyz_mm: NDArray[np.float32],
    colour: NDArray[np.uint8],
    intensity: NDArray[np.float32],
) -> None:
    """Write the valid points (H, W, 3) as one scan with row and column, colour (H, W, 3) and intensity (H, W).

    The standard wants metres; axes stay those of the camera, x right, y down, z forward.
    """
    pye57 = require("pye57", "e57")
    valid = np.isfinite(xyz_mm).all(axis=2)
    if not valid.any():
        raise InputError(f"{path}: the shape has no points")
    row, column = np.nonzero(valid)
    if max(row[-1], int(column.max())) > np.iinfo(np.uint16).max:
        raise InputError(f"{path}: an E57 file has at most 65536 rows and columns, the shape {valid.shape}")
    points_m = (1e-3 * xyz_mm[valid]).astype(np.float32)
    data: dict[str, NDArray[Any]] = {
        f"cartesian{axis}": points_m[:, k].astype(np.float64) for k, axis in enumerate("XYZ")
    }
    data |= {f"color{name}": colour[valid][:, k] for k, name in enumerate(("Red", "Green", "Blue"))}
    data["intensity"] = np.nan_to_num(intensity[valid]).astype(np.float32)
    data |= {"rowIndex": row.astype(np.uint16), "columnIndex": column.astype(np.uint16)}
    with atomic(path) as temporary, pye57.E57(str(temporary), mode="w") as file:
        file.write_scan_raw(data, name=path.stem)
        file.close()
