"""Files that earlier versions wrote, and names that they used, still work."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.config import load_system
from quadfringe.data import Calibration, Shape, Shot
from quadfringe.io.images import write_image
from quadfringe.recording import Recording

Map = NDArray[np.float32]

GOLDEN = Path(__file__).parent / "golden"
FRINGES = ["--fringes", "9", "8", "6", "--projector-width", "912"]


def run(*words: object) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


def golden_take() -> Recording:
    with pytest.warns(qf.RecordingWarning, match="earlier version.* cannot be verified"):
        return Recording(GOLDEN / "take.h5")


@pytest.fixture(scope="module")
def stored() -> Shape:
    return Shape.load(GOLDEN / "shape.npz")


@pytest.fixture(scope="module")
def shot() -> Shot:
    with golden_take() as take:
        (found,) = list(take)
    assert isinstance(found, Shot)
    return found


def assert_same_phase(phase_rad: Map, stored: Shape) -> None:
    """Compare a phase with the stored one: the same pixels and orders, and the same values away from the border.

    In the two outermost columns version 0.1.0 was off by up to 0.2 rad.
    """
    np.testing.assert_array_equal(np.isfinite(phase_rad), np.isfinite(stored.phase_rad))
    difference_rad = np.abs(phase_rad - stored.phase_rad)
    assert np.nanmax(difference_rad) < np.pi
    hold("golden.phase_rad", difference_rad[:, 2:-2])


def assert_same_shape(found: Shape, stored: Shape) -> None:
    assert_same_phase(found.phase_rad, stored)


def test_a_settings_file_with_the_old_name_is_read() -> None:
    assert load_system(GOLDEN / "system.toml").decode.method == "joint"
    assert qf.DecodeConfig.model_validate({"method": "best"}) == qf.DecodeConfig(method="joint")


def test_a_saved_shape_is_read(stored: Shape) -> None:
    assert stored.config["decode"]["method"] in ("best", "joint")
    assert stored.returned.all()
    assert stored.xyz_mm is not None
    assert "phase_rad" in run("info", GOLDEN / "shape.npz")


def test_a_recording_is_read_and_decoded(shot: Shot, stored: Shape) -> None:
    with golden_take() as take:
        config, calibration = take.header.config, take.header.calibration
    assert config is not None
    assert config.decode.method == "joint"
    plan = qf.Plan(912, fringes=config.fringes, calibration=calibration, decode=config.decode)
    assert_same_shape(qf.decode(shot, plan), stored)


def test_a_calibration_is_read(shot: Shot, stored: Shape) -> None:
    calibration = Calibration.load(GOLDEN / "calibration.json")
    fringes = qf.Fringes(numbers=(9.0, 8.0, 6.0))
    found = qf.decode(shot, qf.Plan(912, fringes=fringes, calibration=calibration))
    assert_same_shape(found, stored)
    assert found.xyz_mm is not None


@pytest.mark.parametrize("method", ["best", "joint"])
def test_the_command_line_takes_both_names(shot: Shot, stored: Shape, tmp_path: Path, method: str) -> None:
    words: list[object] = ["decode", *FRINGES, "--method", method, "--out", tmp_path / "shape.npz"]
    for name, image in shot.channels.items():
        write_image(tmp_path / f"{name}.png", image)
        words += [f"--{name}", tmp_path / f"{name}.png"]
    run(*words)
    found = Shape.load(tmp_path / "shape.npz")
    assert found.config["decode"]["method"] == "joint"
    assert_same_shape(found, stored)


def test_a_batch_decodes_an_old_recording(tmp_path: Path, stored: Shape) -> None:
    import zarr

    run("batch", GOLDEN / "take.h5", "--out", tmp_path)
    found = np.asarray(zarr.open_group(tmp_path / "take.zarr", mode="r")["phase_rad"][0])
    assert_same_phase(found, stored)


def test_golden_files_are_small() -> None:
    assert sum(path.stat().st_size for path in GOLDEN.iterdir()) < 100_000
