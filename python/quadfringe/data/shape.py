"""`Shape`: a decoded shot, with the settings and the calibration that made it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import checked
from quadfringe.data.calibration import Calibration
from quadfringe.errors import InputError
from quadfringe.files import require_suffix

__all__ = ["Shape"]

Map = NDArray[np.float32]
MAPS = ("phase_rad", "column_px", "modulation", "quality")
MORE_MAPS = ("wrong_order_probability", "uncertainty_rad", "uncertainty_mm", "xyz_mm")
SCALARS = ("quality", "uncertainty_mm", "wrong_order_probability")
SUFFIXES = (".npz", ".ply", ".tif", ".tiff")


@dataclass(frozen=True)
class Shape:
    """A decoded shot: maps (H, W) float32, points (H, W, 3) mm when calibrated; NaN where there is no data.

    `uncertainty_mm` is one standard deviation of the depth (`uncertainty_rad` of the phase when not calibrated) for the
    order that was chosen, `wrong_order_probability` that of another order. `config` and `calibration` are the settings
    that made it and travel with it into an NPZ file.
    """

    phase_rad: Map
    column_px: Map
    modulation: Map
    quality: Map
    xyz_mm: Map | None = None
    wrong_order_probability: Map | None = None
    uncertainty_rad: Map | None = None
    uncertainty_mm: Map | None = None
    config: Mapping[str, Any] = field(default_factory=dict, repr=False)
    calibration: Calibration | None = field(default=None, repr=False)

    @property
    def maps(self) -> dict[str, Map]:
        """Every map by name; `uncertainty_mm` in place of `uncertainty_rad`, and `xyz_mm`, when calibrated."""
        maps = {name: getattr(self, name) for name in (*MAPS, "order", *MORE_MAPS)}
        return {name: values for name, values in maps.items() if values is not None}

    @property
    def order(self) -> Map:
        """Fringe order, (H, W): whole turns of the absolute phase, rounded down."""
        order: Map = np.floor(self.phase_rad / np.float32(2 * np.pi))
        return order

    @property
    def returned(self) -> NDArray[np.bool_]:
        """Pixels with a phase, (H, W)."""
        return np.isfinite(self.phase_rad)

    @property
    def depth_mm(self) -> Map:
        """Depth along the camera's axis, (H, W), mm; raises `InputError` when not calibrated."""
        return self.points_mm[:, :, 2]

    @property
    def points_mm(self) -> Map:
        """Points in the camera frame, (H, W, 3), mm; raises `InputError` when not calibrated."""
        if self.xyz_mm is None:
            raise InputError("this shape has phase only: decode with a calibration to have millimetres")
        return self.xyz_mm

    def figures(self) -> dict[str, float]:
        """Give what the shape says of itself, by name with unit.

        `returned_percent`; where pixels came back also `uncertainty_median_mm` (or `_rad`), one standard deviation, and
        `wrong_orders_at_most`, the sum of their probabilities of another order, an upper bound.
        """
        returned = self.returned
        found = {"returned_percent": 100.0 * float(returned.mean())}
        if not returned.any():
            return found
        for name, sigma in (("rad", self.uncertainty_rad), ("mm", self.uncertainty_mm)):
            if sigma is not None:
                found[f"uncertainty_median_{name}"] = float(np.nanmedian(sigma))
        if self.wrong_order_probability is not None:
            found["wrong_orders_at_most"] = float(np.nansum(self.wrong_order_probability, dtype=np.float64))
        return found

    def with_settings(self, config: Mapping[str, Any], calibration: Calibration | None) -> Shape:
        """Give the same maps with the settings that made them."""
        return replace(self, config=config, calibration=calibration)

    def save(self, path: Path | str) -> None:
        """Write by suffix: .ply points, .tif depth, .npz everything. Whole or not at all.

        PLY holds the valid points only, with the modulation as grey colour, and as scalars `quality`, `uncertainty_mm`
        and `wrong_order_probability`.
        """
        from quadfringe.io import export

        path = Path(path)
        suffix = require_suffix(path, SUFFIXES)
        if suffix == ".npz":
            export.write_npz(path, self.maps, self._texts())
        elif suffix == ".ply":
            points = self.points_mm
            valid = np.isfinite(points).all(axis=2)
            scalars = {name: values[valid] for name, values in self.maps.items() if name in SCALARS}
            export.write_ply(path, points[valid], export.grey(self.modulation)[valid], scalars)
        else:
            export.write_depth(path, self.depth_mm)

    def _texts(self) -> dict[str, str]:
        texts = {"config": json.dumps(dict(self.config))}
        if self.calibration is not None:
            texts["calibration"] = self.calibration.model_dump_json(exclude_none=True)
        return texts

    @classmethod
    def load(cls, path: Path | str) -> Shape:
        """Read back what `save` wrote as NPZ."""
        from quadfringe.io.export import read_npz

        stored = read_npz(Path(path))
        missing = [name for name in MAPS if name not in stored]
        if missing:
            raise InputError(f"{path}: not a saved shape: no {', '.join(missing)}")
        calibration = None
        if "calibration" in stored:
            values = json.loads(str(stored["calibration"]))
            calibration = checked(Calibration, values, f"{path}, calibration")
        config = json.loads(str(stored["config"])) if "config" in stored else {}
        maps = {name: stored[name] for name in (*MAPS, *MORE_MAPS) if name in stored}
        return cls(**maps, config=config, calibration=calibration)
