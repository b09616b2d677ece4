"""Records survive saving and loading."""

from __future__ import annotations

import random
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tifffile
import trimesh

import quadfringe as qf
from quadfringe.config import ChannelResponse, Device, Response
from quadfringe.data import Calibration, ResponseCalibration, Shape
from quadfringe.errors import ConfigError, InputError
from quadfringe.io.arrays import read_npz

CALIBRATION = Calibration(
    camera=Device(width_px=8, height_px=6, focal_px=(20.0, 20.0), centre_px=(3.5, 2.5)),
    projector=Device(
        width_px=912,
        height_px=1140,
        focal_px=(1572.7, 1572.7),
        centre_px=(455.5, 569.5),
        distortion=(-0.1, 0.02, 1e-4, -1e-4, 0.0),
        rotation=((0.8, 0.0, 0.6), (0.0, 1.0, 0.0), (-0.6, 0.0, 0.8)),
        translation_mm=(-252.6, 22.4, -126.1),
    ),
    response=Response(red=ChannelResponse(exponent=0.5)),
    dark=(0.01, 0.0, 0.0, 0.02),
)


@pytest.fixture
def shape() -> Shape:
    rng = np.random.default_rng(7)
    maps = rng.random((6, 6, 8), np.float32)
    maps[:, 2, 3] = np.nan
    names = ("wrong_order_probability", "uncertainty_mm")
    sureness = dict(zip(names, maps[4:], strict=True))
    xyz = rng.random((6, 8, 3), np.float32) * 800
    xyz[2, 3] = np.nan
    return Shape(*maps[:4], xyz_mm=xyz, **sureness, config={"fringes": [36, 35, 30]}, calibration=CALIBRATION)


def test_npz_gives_everything_back(tmp_path: Path, shape: Shape) -> None:
    shape.save(tmp_path / "shape.npz")
    back = Shape.load(tmp_path / "shape.npz")
    for name, values in shape.maps.items():
        np.testing.assert_array_equal(back.maps[name], values)
        assert back.maps[name].dtype == np.float32
    assert back.config == shape.config
    assert back.calibration == CALIBRATION


def test_ply_is_binary_and_holds_valid_points_only(tmp_path: Path, shape: Shape) -> None:
    shape.save(tmp_path / "shape.ply")
    assert b"format binary_little_endian" in (tmp_path / "shape.ply").read_bytes()[:80]
    cloud = trimesh.load(tmp_path / "shape.ply")
    assert shape.xyz_mm is not None
    valid = np.isfinite(shape.quality)
    np.testing.assert_array_equal(cloud.vertices, shape.xyz_mm[valid])
    stored = cloud.metadata["_ply_raw"]["vertex"]["data"]
    for name in ("quality", "uncertainty_mm", "wrong_order_probability"):
        np.testing.assert_array_equal(stored[name], shape.maps[name][valid])


def test_figures_say_what_came_back_and_how_sure_it_is(shape: Shape) -> None:
    assert shape.uncertainty_mm is not None
    assert shape.wrong_order_probability is not None
    figures = shape.figures()
    assert figures["returned_percent"] == pytest.approx(100 * 47 / 48)
    assert figures["uncertainty_median_mm"] == pytest.approx(np.nanmedian(shape.uncertainty_mm))
    assert figures["wrong_orders_expected"] == pytest.approx(np.nansum(shape.wrong_order_probability))
    phase_only = replace(shape, uncertainty_mm=None, uncertainty_rad=shape.uncertainty_mm, xyz_mm=None).figures()
    assert "uncertainty_median_rad" in phase_only
    assert "uncertainty_median_mm" not in phase_only


@pytest.mark.parametrize("name", ["depth.tif", "depth.tiff"])
def test_tiff_keeps_no_data(tmp_path: Path, shape: Shape, name: str) -> None:
    shape.save(tmp_path / name)
    depth = tifffile.imread(tmp_path / name)
    assert depth.dtype == np.float32
    np.testing.assert_array_equal(depth, shape.depth_mm)


@pytest.mark.parametrize("name", ["shape.ply", "shape.tif"])
def test_a_shape_without_millimetres_says_so(tmp_path: Path, shape: Shape, name: str) -> None:
    with pytest.raises(InputError, match="decode with a calibration"):
        replace(shape, xyz_mm=None).save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_suffix_is_refused(tmp_path: Path, shape: Shape) -> None:
    with pytest.raises(InputError, match=r"\.npz, \.ply, \.pcd"):
        shape.save(tmp_path / "shape.xyz")


@pytest.mark.parametrize("keep", [0, 1, 100, 1000, -1])
def test_a_truncated_npz_is_named(tmp_path: Path, shape: Shape, keep: int) -> None:
    path = tmp_path / "shape.npz"
    shape.save(path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError, match=r"shape\.npz"):
        Shape.load(path)


@pytest.mark.filterwarnings("ignore")  # of the headers, which numpy parses as Python
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_any_damage_to_an_npz_is_named(tmp_path: Path, save: Callable[..., None]) -> None:
    """Numpy, zipfile and its decompressors have many kinds of errors."""
    path, noise = tmp_path / "maps.npz", random.Random(0)
    save(path, phase_rad=np.arange(200, dtype=np.float32).reshape(4, 50), config=np.array("{}"))
    sound = path.read_bytes()
    for _ in range(1000):
        damaged = bytearray(sound[: noise.choice([len(sound), noise.randrange(len(sound))])])
        for _ in range(min(len(damaged), noise.randrange(4))):
            damaged[noise.randrange(len(damaged))] = noise.randrange(256)
        path.write_bytes(damaged)
        with suppress(InputError):
            read_npz(path)


def test_an_npz_of_something_else_is_named(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(InputError, match="not a saved shape: no phase_rad"):
        Shape.load(tmp_path / "other.npz")


def test_calibration_gives_everything_back(tmp_path: Path) -> None:
    CALIBRATION.save(tmp_path / "c.json")
    assert Calibration.load(tmp_path / "c.json") == CALIBRATION


def test_response_gives_everything_back(tmp_path: Path) -> None:
    response = ResponseCalibration(ir=ChannelResponse(exponent=2.0), steps=12, inputs=("a.bmp",))
    response.save(tmp_path / "r.json")
    assert ResponseCalibration.load(tmp_path / "r.json") == response


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "not valid JSON"),
        ("[]", "expected a JSON object, got list"),
        ('{"red": {"exponet": 2}}', "red.exponet: this key is not known"),
        ('{"red": {"exponent": -2}}', "red.exponent: expected a number above 0, got -2"),
        ('{"schema_version": 9}', "schema_version"),
    ],
)
def test_a_bad_calibration_file_is_explained(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "r.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"r\.json") as caught:
        ResponseCalibration.load(path)
    assert reason in str(caught.value)


def test_a_result_carries_the_settings_in_force() -> None:
    with qf.open(qf.SystemConfig(decode=qf.DecodeConfig(modulation_min=0.01))) as scanner:
        shape = scanner.measure()
    settings = shape.config["decode"]
    assert settings["method"] == "joint"
    assert 0 < settings["quality_min"] < 1
    assert settings["period_px"] is None
    assert settings["modulation_min"] == 0.01, "written with the digits that a person types"
