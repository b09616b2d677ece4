"""Meshes as binary glTF 2.0, for other programs and for the page in the browser.

glTF wants linear colours, and shows a mesh without a material as polished metal; so colours are decoded, and the
material is matt.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["decoded", "encoded", "glb_bytes"]

FLOAT, UNSIGNED_INT = 5126, 5125
TRIANGLES = 4
VERTICES, INDICES = 34962, 34963  # what a part of the binary chunk holds
MATERIAL = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}, "doubleSided": True}


def decoded(colour: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Convert sRGB of 8 bit to linear light, 0 to 1 (IEC 61966-2-1)."""
    coded = np.arange(256) / 255
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    light: NDArray[np.float32] = linear.astype(np.float32)[colour]
    return light


def encoded(light: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Convert linear light, 0 to 1, to sRGB of 8 bit (IEC 61966-2-1)."""
    share = np.clip(light, 0, 1)
    coded = np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
    rounded: NDArray[np.uint8] = (coded * 255 + 0.5).astype(np.uint8)
    return rounded


@dataclass(frozen=True)
class _Part:
    """An array of the binary chunk, what it holds (target), and its accessor."""

    values: NDArray[Any]
    target: int
    accessor: dict[str, Any]


def glb_bytes(
    points: NDArray[np.float32],
    faces: NDArray[np.uint32],
    colour: NDArray[np.uint8],
    normals: NDArray[np.float32] | None = None,
) -> bytes:
    """Give a GLB of points (M, 3), faces (F, 3), sRGB colour (M, 3), and normals (M, 3) unless the reader finds them.

    >>> corners = np.eye(3, dtype=np.float32)
    >>> glb_bytes(corners, np.array([[0, 1, 2]], np.uint32), np.full((3, 3), 255, np.uint8))[:4]
    b'glTF'
    """
    vector = {"componentType": FLOAT, "type": "VEC3"}
    limits = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    # Colours of 8 bit are too coarse for dark linear light, and some readers take 16 bit for 8.
    parts = {
        "POSITION": _Part(np.asarray(points, np.float32), VERTICES, vector | limits),
        "COLOR_0": _Part(decoded(colour), VERTICES, vector),
    }
    if normals is not None:
        parts["NORMAL"] = _Part(np.asarray(normals, np.float32), VERTICES, vector)
    attributes = {name: place for place, name in enumerate(parts)}
    corners = np.asarray(faces, np.uint32).ravel()
    parts["faces"] = _Part(corners, INDICES, {"componentType": UNSIGNED_INT, "type": "SCALAR"})
    primitive = {"attributes": attributes, "indices": len(attributes), "material": 0, "mode": TRIANGLES}
    return _packed(list(parts.values()), primitive)


def _packed(parts: list[_Part], primitive: dict[str, Any]) -> bytes:
    """Put a mesh of one primitive into the two chunks of a file: JSON and binary."""
    views, accessors = [], []
    size = 0
    for place, part in enumerate(parts):
        values = part.values
        views.append({"buffer": 0, "byteOffset": size, "byteLength": values.nbytes, "target": part.target})
        accessors.append({"bufferView": place, "count": len(values), **part.accessor})
        size += values.nbytes
    tree = {
        "asset": {"version": "2.0", "generator": "quadfringe"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [MATERIAL],
        "buffers": [{"byteLength": size}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(part.values.tobytes() for part in parts)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
