"""PCD files of the Point Cloud Library: organised clouds, one point for each pixel."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.files import atomic

__all__ = ["write_pcd"]

HEADER = """# .PCD v0.7 - Point Cloud Data file format
VERSION 0.7
FIELDS {names}
SIZE {sizes}
TYPE {types}
COUNT {counts}
WIDTH {width}
HEIGHT {height}
VIEWPOINT 0 0 0 1 0 0 0
POINTS {points}
DATA binary
"""


def write_pcd(path: Path, fields: Mapping[str, NDArray[Any]]) -> None:
    """Write fields (H, W) by name as an organised binary PCD; each becomes float32."""
    height, width = next(iter(fields.values())).shape
    points = np.empty((height, width), [(name, "<f4") for name in fields])
    for name, values in fields.items():
        points[name] = values
    count = len(fields)
    repeated = {name: " ".join([word] * count) for name, word in (("sizes", "4"), ("types", "F"), ("counts", "1"))}
    header = HEADER.format(names=" ".join(fields), width=width, height=height, points=height * width, **repeated)
    with atomic(path) as temporary, temporary.open("wb") as stream:
        stream.write(header.encode("ascii"))
        stream.write(points.tobytes())
