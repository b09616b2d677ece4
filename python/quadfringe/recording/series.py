"""Shapes that a batch decoded: one for each shot of a recording, read from the zarr store one by one.

>>> from quadfringe.recording.series import Series
>>> Series.open("out/take.zarr")
Traceback (most recent call last):
...
quadfringe.errors.InputError: out/take.zarr: no such folder; expected the result of a batch
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import SystemConfig, checked
from quadfringe.data import Calibration, Shape
from quadfringe.data._checks import check_types
from quadfringe.errors import InputError, require
from quadfringe.io.declared import IMAGE_PX
from quadfringe.recording._results import DONE, FORMAT, LAST, MAPS, MORE_MAPS, REFUSED

__all__ = ["Series"]


@dataclass(frozen=True)
class Series:
    """The results of one recording. times_us (N,): host time of the shots; status (N,): which of them have a shape."""

    path: Path
    times_us: NDArray[np.int64]
    status: NDArray[np.uint8]
    calibration: Calibration | None
    config: SystemConfig
    _group: Any

    def __len__(self) -> int:
        return len(self.times_us)

    @classmethod
    def open(cls, path: Path | str) -> Series:
        """Open a store OUT/NAME.zarr; raises `InputError` for anything but the result of a batch."""
        path = Path(path)
        if not path.is_dir():
            raise InputError(f"{path}: no such folder; expected the result of a batch")
        zarr = require("zarr", "batch")
        try:
            group = zarr.open_group(path, mode="r")
            attributes = dict(group.attrs)
            if attributes.get("format") != FORMAT:
                raise InputError(f"{path}: expected the result of a batch, got another zarr group")
            arrays = {name: group[name] for name in (*MAPS, "status", "time_us")}
            arrays |= {name: group[name] for name in MORE_MAPS if name in group}
            _check(path, arrays)
            times_us, status = arrays["time_us"][:], arrays["status"][:]
        except InputError:
            raise
        except (KeyError, ValueError, TypeError, OSError, RuntimeError) as error:
            raise InputError(f"{path}: expected the result of a batch: {error}") from error
        calibration = None
        if (known := _table(path, attributes, "settings").get("calibration")) is not None:
            calibration = checked(Calibration, known, f"{path}, calibration")
        config = checked(SystemConfig, _table(path, attributes["settings"], "config"), f"{path}, config")
        return cls(path, times_us, status, calibration, config, group)

    def shape(self, shot: int) -> Shape:
        """Read the shape of a shot, 0 to N - 1; raises `InputError` for one that is not decoded or has no shape.

        The store keeps no projector columns, which follow from the phase with a calibration and are NaN without one.
        """
        if not 0 <= shot < len(self):
            raise InputError(f"{self.path}: shot {shot}: expected 0 to {len(self) - 1}")
        if self.status[shot] != DONE:
            why = "has no shape; errors.json says why" if self.status[shot] == REFUSED else "is not decoded yet"
            raise InputError(f"{self.path}: shot {shot} {why}")
        try:
            maps: dict[str, Any] = {name: self._map(name, shot) for name in (*MAPS, *MORE_MAPS) if name in self._group}
        except (KeyError, ValueError, OSError, RuntimeError) as error:
            raise InputError(f"{self.path}: shot {shot}: cannot be read: {error}") from error
        settings = self.config.model_dump(mode="json", exclude_none=True)
        columns = self._columns(maps["phase_rad"])
        check_types(maps, self.path)
        return Shape(column_px=columns, **maps).with_settings(settings, self.calibration)

    def _map(self, name: str, shot: int) -> NDArray[Any]:
        return np.asarray(self._group[name][shot], np.uint8 if name == "reason" else np.float32)

    def _columns(self, phase_rad: NDArray[np.float32]) -> NDArray[np.float32]:
        width_px = math.nan if self.calibration is None else self.calibration.projector.width_px
        per_rad = width_px / (2 * math.pi * self.config.fringes.numbers[0])
        return phase_rad * np.float32(per_rad)


def _table(path: Path, tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = tables.get(name)
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected {name}, a table, got {type(found).__name__}")
    return found


def _check(path: Path, arrays: dict[str, Any]) -> None:
    """Raise `InputError` unless the arrays fit each other and have the size of images."""
    shots, *size = arrays["phase_rad"].shape
    for name, array in arrays.items():
        last = LAST[name][1:] if name in LAST else ()
        expected = (shots,) if name in ("status", "time_us") else (shots, *size, *last)
        if array.shape != expected or len(size) != 2 or array.dtype.kind not in "fiu":
            raise InputError(f"{path}: {name}: expected numbers {expected}, got {array.dtype} {array.shape}")
    if math.prod(size) > IMAGE_PX or not shots:
        raise InputError(f"{path}: expected shots of at most {IMAGE_PX:,} pixels, got {shots} of {math.prod(size):,}")
