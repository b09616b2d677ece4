"""A shape as objects of other libraries: Open3D and xarray."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from quadfringe.data.mesh import normals_of
from quadfringe.data.points import xyz_mm_of
from quadfringe.data.reason import Reason
from quadfringe.errors import require

if TYPE_CHECKING:
    from quadfringe.data.shape import Shape

__all__ = ["UNITS", "open3d_of", "xarray_of"]

# Unit and meaning of each map; 1 for a pure number.
UNITS = {
    "phase_rad": ("rad", "absolute phase of the first fringe number"),
    "column_px": ("px", "projector column that lights the point"),
    "modulation": ("1", "fringe amplitude, fraction of full scale"),
    "quality": ("1", "trust in the fringe order"),
    "order": ("1", "fringe order"),
    "wrong_order_probability": ("1", "probability that the fringe order is wrong"),
    "uncertainty_rad": ("rad", "standard deviation of the phase"),
    "uncertainty_mm": ("mm", "standard deviation of the depth"),
    "xyz_mm": ("mm", "point in the camera frame: x right, y down, z forward"),
    "reason": ("1", "why there is no data, 0 where there is some"),
    "albedo": ("1", "light without fringes, linear, fraction of full scale"),
}
LAST = {"xyz_mm": "axis", "albedo": "channel"}  # the third dimension of a map


def open3d_of(shape: Shape) -> Any:
    """Give the points as `open3d.geometry.PointCloud`; see `Shape.to_open3d`."""
    points_mm = xyz_mm_of(shape)
    open3d = require("open3d", "open3d")
    valid = np.isfinite(points_mm).all(axis=2)
    vectors = open3d.utility.Vector3dVector
    cloud = open3d.geometry.PointCloud()
    cloud.points = vectors(points_mm[valid].astype(np.float64))
    cloud.normals = vectors(np.nan_to_num(normals_of(shape).directions[valid]).astype(np.float64))
    cloud.colors = vectors(shape.colour[valid] / 255.0)
    return cloud


def xarray_of(shape: Shape, texts: dict[str, str]) -> Any:
    """Give the maps as `xarray.Dataset`; see `Shape.to_xarray`."""
    xarray = require("xarray", "xarray")
    rows, columns = shape.phase_rad.shape
    coordinates: dict[str, Any] = {}
    for name, count, first in (("row", rows, "at the top"), ("column", columns, "at the left")):
        attributes = {"units": "px", "long_name": f"{name} of the camera image, 0 {first}"}
        coordinates[name] = (name, np.arange(count), attributes)
    if shape.xyz_mm is not None:
        coordinates["axis"] = ("axis", ["x", "y", "z"])
    if shape.albedo is not None:
        coordinates["channel"] = ("channel", ["red", "green", "blue", "ir"])
    variables = {}
    for name, values in shape.maps.items():
        unit, meaning = UNITS[name]
        dimensions = ("row", "column", LAST.get(name, ""))[: values.ndim]
        variables[name] = (dimensions, values, {"units": unit, "long_name": meaning, **_flags(name)})
    return xarray.Dataset(variables, coordinates, texts)


def _flags(name: str) -> dict[str, Any]:
    """Name the values of a map of reasons, as the conventions of CF do."""
    if name != "reason":
        return {}
    values = np.array([one.value for one in Reason], np.uint8)
    return {"flag_values": values, "flag_meanings": " ".join(one.name.lower() for one in Reason)}
