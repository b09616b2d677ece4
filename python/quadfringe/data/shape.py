"""`Shape`: a decoded shot, with the settings and the calibration that made it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import brief, checked
from quadfringe.data._checks import check_maps, check_types
from quadfringe.data.calibration import Calibration
from quadfringe.data.drawing import cards, plots
from quadfringe.data.points import xyz_mm_of
from quadfringe.data.reason import Reason
from quadfringe.errors import InputError
from quadfringe.files import require_suffix
from quadfringe.io.arrays import read_npz
from quadfringe.io.export import grey, surface_picture
from quadfringe.io.texts import json_of

if TYPE_CHECKING:
    from quadfringe.data.mesh import Mesh, Normals

__all__ = ["SUFFIXES", "Shape", "xyz_mm_of"]

Map = NDArray[np.float32]
MAPS = ("phase_rad", "column_px", "modulation", "quality")
MORE_MAPS = ("wrong_order_probability", "uncertainty_rad", "uncertainty_mm", "xyz_mm", "albedo", "reason")
SUFFIXES = (".npz", ".ply", ".pcd", ".stl", ".obj", ".glb", ".e57", ".tif", ".tiff")


@dataclass(frozen=True, repr=False)
class Shape:
    """A decoded shot: maps (H, W), points (H, W, 3) and albedo (H, W, 4), float32; NaN where there is no data.

    phase_rad: absolute phase of the first fringe number, 0 at projector column 0.
    column_px: projector column that lights the point.
    modulation: fringe amplitude in linear light, fraction of full scale.
    quality: trust in the fringe order, 0 to 1; known wherever there is light.
    xyz_mm: points in the camera frame, (H, W, 3); None without a calibration.
    wrong_order_probability: probability that the fringe order is wrong.
    uncertainty_rad, uncertainty_mm: standard deviation of the phase, or with a calibration of the depth, for the order
    that was chosen; the other one is None.
    albedo: light of R, G, B and IR without fringes, linear, fraction of full scale, (H, W, 4): the albedo of the
    surface times the mean light on it. None by methods other than joint, and with `albedo = false` in `[decode]`.
    reason: why each pixel has no data, values of `Reason`, (H, W) uint8; None in files of earlier versions.

    `config` holds the settings in force, with method, response and version, and `calibration` the calibration; both are
    saved in an NPZ file. Raises `InputError` for maps of unequal size.
    """

    phase_rad: Map
    column_px: Map
    modulation: Map
    quality: Map
    xyz_mm: Map | None = None
    wrong_order_probability: Map | None = None
    uncertainty_rad: Map | None = None
    uncertainty_mm: Map | None = None
    albedo: Map | None = None
    reason: NDArray[np.uint8] | None = None
    config: Mapping[str, Any] = field(default_factory=dict)
    calibration: Calibration | None = None

    def __post_init__(self) -> None:
        maps = {name: getattr(self, name) for name in (*MAPS, *MORE_MAPS)}
        check_maps({name: values for name, values in maps.items() if name in MAPS or values is not None})

    def __repr__(self) -> str:
        rows, columns = self.phase_rad.shape
        words = [f"{columns} x {rows}", f"{100 * float(self.returned.mean()):.1f} % returned"]
        depth_mm = self.depth_mm
        if depth_mm is not None and np.isfinite(depth_mm).any():
            low, high = np.nanquantile(depth_mm, (0.01, 0.99))
            words.append(f"98 % at {low:.1f} to {high:.1f} mm")
        decode = self.config.get("decode", {})
        words += [f"{name} {decode[name]}" for name in ("method", "method_version") if name in decode]
        return f"Shape({', '.join(words)})"

    def _repr_html_(self) -> str:
        return str(cards().shape_card(self))

    def plot(self) -> Any:
        """Plot depth, uncertainty, quality and absolute phase, those that are known; give the axes in an array.

        Raises `MissingExtraError` without matplotlib (extra `plot`).

        >>> shape.plot()[0, 0].set_title("my part")                                      # doctest: +SKIP
        """
        return plots().plot_shape(self)

    @property
    def maps(self) -> dict[str, NDArray[Any]]:
        """Every map by name; with a calibration `xyz_mm` too, and `uncertainty_mm` in place of `uncertainty_rad`."""
        maps = {name: getattr(self, name) for name in (*MAPS, "order", *MORE_MAPS)}
        return {name: values for name, values in maps.items() if values is not None}

    @property
    def order(self) -> Map:
        """Fringe order, (H, W): whole turns of the absolute phase, rounded down."""
        order: Map = np.floor(self.phase_rad / np.float32(2 * np.pi))
        return order

    @property
    def returned(self) -> NDArray[np.bool_]:
        """True at pixels with a phase, (H, W)."""
        return np.isfinite(self.phase_rad)

    @property
    def depth_mm(self) -> Map | None:
        """Depth along the axis of the camera, (H, W), mm; None without a calibration."""
        return None if self.xyz_mm is None else self.xyz_mm[:, :, 2]

    @property
    def colour(self) -> NDArray[np.uint8]:
        """The surface without fringes as a picture, (H, W, 3) sRGB: the albedo, or without one the modulation in grey.

        White is the brightest hundredth. Pixels without albedo are grey by their modulation, without data black.
        """
        if self.albedo is None:
            return grey(self.modulation)
        return surface_picture(self.albedo, self.modulation)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is doubtful about the shape, and what to do about it, in words; empty when nothing is."""
        return tuple(self.config.get("warnings", ()))

    @property
    def geometry(self) -> str:
        """Whether the shot checks its calibration along y, in words that begin "rows checked" or "rows not checked".

        Fringes give projector columns. Images that moved along y, and a projector that was turned, show only where the
        light ends above or below. Empty without a calibration, and for shapes of earlier versions. No shot checks the
        distance between the devices, on which the size of everything depends.
        """
        return str(self.config.get("geometry", ""))

    def figures(self) -> dict[str, float]:
        """Compute figures of the shape, by name with unit.

        `returned_percent`; if any pixels are returned, also `uncertainty_median_mm` (or `_rad`), one standard
        deviation, and `wrong_orders_expected`, the sum of their probabilities of a wrong order. With a
        response that was estimated from shots also `response_phase_rad`: the RMS error of the phase that its
        uncertainty leaves at most, which `uncertainty_rad` and `uncertainty_mm` do not contain.
        """
        returned = self.returned
        found = {"returned_percent": 100.0 * float(returned.mean())}
        if not returned.any():
            return found
        for name, sigma in (("rad", self.uncertainty_rad), ("mm", self.uncertainty_mm)):
            if sigma is not None:
                found[f"uncertainty_median_{name}"] = float(np.nanmedian(sigma))
        if self.wrong_order_probability is not None:
            found["wrong_orders_expected"] = float(np.nansum(self.wrong_order_probability, dtype=np.float64))
        if (evidence := self.config.get("response_evidence")) is not None:
            found["response_phase_rad"] = float(evidence["phase_rad"])
        return found

    def reasons(self) -> dict[Reason, float]:
        """Give the share of pixels of each reason that occurs, in percent; empty without a map of reasons."""
        if self.reason is None:
            return {}
        counts = np.bincount(self.reason.ravel(), minlength=len(Reason))
        return {reason: 100.0 * float(counts[reason]) / self.reason.size for reason in Reason if counts[reason]}

    def with_settings(self, config: Mapping[str, Any], calibration: Calibration | None) -> Shape:
        """Give the same maps with the settings that made them."""
        return replace(self, config=config, calibration=calibration)

    def mesh(self, *, step: int = 1, fill_holes_px: int = 0, colour: NDArray[np.uint8] | None = None) -> Mesh:
        """Triangulate the points on the grid of pixels; no triangle lies across a step in depth.

        `step` takes every n-th pixel of every n-th row. Holes of at most `fill_holes_px` pixels (0 to 1000) whose
        rim is one smooth surface are filled, and their vertices marked. `colour` is a picture (H, W, 3) uint8; the
        default is `Shape.colour`. Raises `InputError` without a calibration, and for values out of range.

        >>> import numpy as np
        >>> rows, columns = np.mgrid[0:4, 0:6].astype(np.float32)
        >>> plane = np.stack([columns, rows, np.full_like(rows, 800)], axis=2)
        >>> Shape(rows, rows, rows, rows, xyz_mm=plane).mesh()
        Mesh(24 vertices, 30 triangles)
        """
        from quadfringe.data.mesh import mesh_of

        return mesh_of(self, step, fill_holes_px, colour)

    def normals(self) -> Normals:
        """Find the normals (H, W, 3) and their uncertainty (H, W), rad; raises `InputError` without a calibration."""
        from quadfringe.data.mesh import normals_of

        return normals_of(self)

    def to_trimesh(self) -> Any:
        """Give the mesh as `trimesh.Trimesh`, as `Mesh.to_trimesh` does; for choices, use `mesh`."""
        return self.mesh().to_trimesh()

    def to_open3d(self) -> Any:
        """Give the points as `open3d.geometry.PointCloud` in mm, with normals and colours.

        For a `TriangleMesh`, use `mesh().to_open3d()`. Raises `InputError` without a calibration, and
        `MissingExtraError` without Open3D.
        """
        from quadfringe.data.conversions import open3d_of

        return open3d_of(self)

    def to_xarray(self) -> Any:
        """Give all `maps` as `xarray.Dataset` with dimensions row, column, and for points axis (x, y, z).

        Each variable has the attributes `units` and `long_name`, and `reason` names its values (`flag_meanings`); the
        data set has `config` and `calibration` as JSON.
        Raises `MissingExtraError` without xarray.
        """
        from quadfringe.data.conversions import xarray_of

        return xarray_of(self, self._texts())

    def save(self, path: Path | str, *, faces: bool = False, step: int = 1, fill_holes_px: int = 0) -> None:
        """Write by suffix; whole or not at all.

        .npz: every map, config and calibration, the only file that `load` reads. .ply and .pcd: points with
        normals, colour, `quality`, `uncertainty_mm` and `wrong_order_probability`; PLY holds the valid points
        with their row and column, PCD one point for each pixel. .stl, .obj, .glb, and with `faces` .ply: the mesh,
        for which `step` and `fill_holes_px` are those of `mesh`; see `Mesh.save`. .e57: valid points in metres with
        colour, row and column. .tif: depth in mm. Raises
        `InputError` for another suffix, a folder that does not exist, a choice that the kind of file does not have,
        and without a calibration for all but .npz; `MissingExtraError` without trimesh, pye57 or tifffile.
        """
        from quadfringe.data import shape_files
        from quadfringe.io import export

        path = Path(path)
        suffix = require_suffix(path, SUFFIXES)
        if shape_files.check_choices(path, suffix, faces=faces, step=step, fill_holes_px=fill_holes_px):
            self.mesh(step=step, fill_holes_px=fill_holes_px).save(path)
        elif suffix == ".npz":
            export.write_npz(path, self.maps, self._texts())
        else:
            shape_files.write_pixels(self, path, suffix)

    def _texts(self) -> dict[str, str]:
        texts = {"config": json.dumps(dict(self.config))}
        if self.calibration is not None:
            texts["calibration"] = self.calibration.model_dump_json(exclude_none=True)
        return texts

    @classmethod
    def load(cls, path: Path | str) -> Shape:
        """Read what `save` wrote as NPZ; raises `InputError` for any other file."""
        path = Path(path)
        if path.suffix.lower() in SUFFIXES[1:]:
            raise InputError(f"{path}: expected a shape saved as .npz; the other files hold only a part of one")
        stored = read_npz(path)
        missing = [name for name in MAPS if name not in stored]
        if missing:
            raise InputError(f"{path}: not a saved shape: no {', '.join(missing)}")
        maps = {name: stored[name] for name in (*MAPS, *MORE_MAPS) if name in stored}
        check_types(maps, path)
        calibration = None
        if "calibration" in stored:
            calibration = checked(Calibration, _table(stored, "calibration", path), f"{path}, calibration")
        config = _settings(stored, path)
        try:
            return cls(**maps, config=config, calibration=calibration)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error


def _table(stored: Mapping[str, NDArray[Any]], name: str, path: Path) -> dict[str, Any]:
    """Give the JSON object in a member of an NPZ file."""
    member = stored[name]
    if member.dtype.kind != "U" or member.ndim:
        raise InputError(f"{path}, {name}: expected a text, got {member.dtype} {member.shape}")
    values = json_of(str(member), f"{path}, {name}")
    if not isinstance(values, dict):
        raise InputError(f"{path}, {name}: expected a JSON object, got {type(values).__name__}")
    return values


def _settings(stored: Mapping[str, NDArray[Any]], path: Path) -> dict[str, Any]:
    """Give the settings that made a saved shape; `Shape` itself relies on these two types."""
    config = _table(stored, "config", path) if "config" in stored else {}
    for name, kind in (("decode", dict), ("warnings", list)):
        if not isinstance(config.get(name, kind()), kind):
            raise InputError(f"{path}, config: {name}: expected a {kind.__name__}, got {brief(config[name])}")
    return config
