"""E57 files: points, colours, rows and columns; pye57 itself reads them where it is installed."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold

import quadfringe as qf
from quadfringe.data import Calibration, Shape
from quadfringe.errors import InputError, MissingExtraError


@pytest.fixture(scope="module")
def face(bench: tuple[qf.Shot, Calibration]) -> Shape:
    shot, calibration = bench
    return qf.decode(shot, qf.Plan(912, calibration=calibration))


class ScanFile:
    """The few names of pye57 that are used, where it is not installed: the last scan is kept in the class."""

    scan: ClassVar[dict[str, NDArray[Any]]] = {}

    def __init__(self, path: str, mode: str) -> None:
        self.path, self.mode = Path(path), mode

    def __enter__(self) -> ScanFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write_scan_raw(self, data: dict[str, NDArray[Any]], *, name: str) -> None:
        kinds = {"cartesian": "f8", "color": "u1", "intensity": "f4", "rowIndex": "u2", "columnIndex": "u2"}
        for field, values in data.items():
            assert values.dtype == next(kind for start, kind in kinds.items() if field.startswith(start)), field
        assert len({len(values) for values in data.values()}) == 1
        ScanFile.scan = data
        self.path.write_bytes(name.encode())

    def read_scan_raw(self, _index: int) -> dict[str, NDArray[Any]]:
        return ScanFile.scan

    def close(self) -> None:
        pass


def test_e57_holds_points_colours_rows_and_columns(
    face: Shape, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if find_spec("pye57") is None:
        monkeypatch.setitem(sys.modules, "pye57", SimpleNamespace(E57=ScanFile))
    path = tmp_path / "face.e57"
    face.save(path)
    with import_module("pye57").E57(str(path), mode="r") as file:
        scan = file.read_scan_raw(0)
    assert face.xyz_mm is not None
    valid = np.isfinite(face.xyz_mm).all(axis=2)
    points_m = np.stack([scan[f"cartesian{axis}"] for axis in "XYZ"], axis=1)
    hold("e57.coordinate_mm", 1e3 * np.abs(points_m - face.xyz_mm[valid] / 1e3).max())
    np.testing.assert_array_equal(np.stack([scan["rowIndex"], scan["columnIndex"]], axis=1), np.argwhere(valid))
    colour = np.stack([scan[f"color{name}"] for name in ("Red", "Green", "Blue")], axis=1)
    np.testing.assert_array_equal(colour, face.colour[valid])
    np.testing.assert_array_equal(scan["intensity"], face.modulation[valid])


def test_e57_without_points_or_library_is_refused(face: Shape, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = np.full_like(face.phase_rad, np.nan)
    assert face.xyz_mm is not None
    monkeypatch.setitem(sys.modules, "pye57", SimpleNamespace(E57=ScanFile))
    with pytest.raises(InputError, match="no points"):
        replace(face, phase_rad=nothing, xyz_mm=np.full_like(face.xyz_mm, np.nan)).save(tmp_path / "x.e57")
    monkeypatch.setitem(sys.modules, "pye57", None)
    with pytest.raises(MissingExtraError, match=r"quadfringe\[e57\]"):
        face.save(tmp_path / "x.e57")
    assert list(tmp_path.iterdir()) == []
