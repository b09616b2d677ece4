"""The calibration file: versions, readable lists, OpenCV's FileStorage and back; registration of the two chips."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.bars import hold, tolerance
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.calibration.opencv_files import devices_from_opencv, read_opencv, write_opencv
from quadfringe.calibration.registration import register_infrared
from quadfringe.cli import app
from quadfringe.config import Response
from quadfringe.data import Calibration, CalibrationRecord, CalibrationStep, core_device
from quadfringe.errors import ConfigError, DecodeError, InputError

SUFFIXES = (".yml", ".yaml", ".xml", ".json")


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    with qf.open() as scanner:
        known = scanner.calibration
    bent = known.projector.model_copy(update={"distortion": (-0.1, 0.05, 1e-3, -2e-3, 0.01)})
    step = CalibrationStep(
        name="poses", inputs=("01", "02"), figures={"camera_mean_px": 0.1}, good=True, verdict="fine"
    )
    record = CalibrationRecord(
        made_utc="2026-01-02T03:04:05+00:00", quadfringe_version="0.1.0", rig="bench", steps=(step,)
    )
    return known.model_copy(
        update={"projector": bent, "infrared": bent, "record": record, "projector_response": Response()}
    )


def test_a_calibration_gives_everything_back_and_reads_well(calibration: Calibration, tmp_path: Path) -> None:
    calibration.save(tmp_path / "c.json")
    assert Calibration.load(tmp_path / "c.json") == calibration
    text = (tmp_path / "c.json").read_text()
    assert '"distortion": [-0.1, 0.05, 0.001, -0.002, 0.01]' in text
    assert json.loads(text)["schema_version"] == 2
    assert json.loads(text)["record"]["steps"][0]["figures"] == {"camera_mean_px": 0.1}


def test_files_of_schema_1_are_read_and_of_3_refused(calibration: Calibration, tmp_path: Path) -> None:
    old = {
        "schema_version": 1,
        "camera": calibration.camera.model_dump(),
        "projector": calibration.projector.model_dump(),
    }
    (tmp_path / "old.json").write_text(json.dumps(old))
    assert Calibration.load(tmp_path / "old.json").infrared is None
    (tmp_path / "new.json").write_text(json.dumps(old | {"schema_version": 3}))
    with pytest.raises(ConfigError, match=r"schema_version: expected 1 or 2, got 3"):
        Calibration.load(tmp_path / "new.json")


@pytest.mark.parametrize("pose", [{"translation_mm": [0, 1, 0]}, {"rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}])
def test_a_camera_with_a_pose_is_refused(pose: dict[str, object], calibration: Calibration, tmp_path: Path) -> None:
    values = calibration.model_dump(mode="json")
    values["camera"].update(pose)
    (tmp_path / "c.json").write_text(json.dumps(values))
    with pytest.raises(ConfigError, match=r"camera: expected a camera without rotation and translation_mm; give those"):
        Calibration.load(tmp_path / "c.json")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_opencv_reads_what_we_write_and_we_what_it_writes(
    calibration: Calibration, tmp_path: Path, suffix: str
) -> None:
    path = tmp_path / f"c{suffix}"
    write_opencv(path, calibration)
    again = read_opencv(path)
    for name in ("camera", "projector", "infrared"):
        assert getattr(again, name) == getattr(calibration, name)


def test_opencv_projects_as_the_kernel_does(calibration: Calibration, tmp_path: Path) -> None:
    write_opencv(tmp_path / "c.yml", calibration)
    storage = cv2.FileStorage(str(tmp_path / "c.yml"), cv2.FILE_STORAGE_READ)
    matrix, distortion, rotation, translation = (
        storage.getNode(key).mat()
        for key in ("projector_matrix", "projector_distortion", "R_projector_camera", "T_projector_camera")
    )
    point = (30.0, -20.0, 810.0)
    pixel, _ = cv2.projectPoints(np.array([point]), cv2.Rodrigues(rotation)[0], translation, matrix, distortion)
    np.testing.assert_allclose(pixel[0, 0], core_device(calibration.projector).project(point), atol=1e-9)


def test_foreign_files_are_explained(calibration: Calibration, tmp_path: Path) -> None:
    (tmp_path / "text.yml").write_text("no storage")
    for name, reason in (
        ("text.yml", "camera_matrix is missing|expected an OpenCV FileStorage"),
        ("none.yml", "No such file"),
    ):
        with pytest.raises(InputError, match=reason):
            read_opencv(tmp_path / name)
    matrices = {
        "camera_matrix": np.array([[1000.0, 0, 500], [0, 1000, 400], [0, 0, 1]]),
        "camera_size": np.array([[1000.0, 800]]),
        "projector_matrix": np.array([[1000.0, 0.5, 500], [0, 1000, 400], [0, 0, 1]]),
    }
    with pytest.raises(ConfigError, match=r"projector_matrix: expected fx, 0, cx"):
        devices_from_opencv(matrices)
    with pytest.raises(ConfigError, match="got 8 numbers"):
        devices_from_opencv(matrices | {"camera_distortion": np.zeros((1, 8))})
    with pytest.raises(InputError, match="expected a name that ends in"):
        write_opencv(tmp_path / "c.txt", calibration)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["text.yml"]


def test_the_command_line_exports_and_imports(calibration: Calibration, tmp_path: Path) -> None:
    calibration.save(tmp_path / "c.json")
    runner = CliRunner()
    files = {name: str(tmp_path / name) for name in ("c.json", "c.yml", "again.json")}
    assert runner.invoke(app, ["calibrate", "export", files["c.json"], "--out", files["c.yml"]]).exit_code == 0
    assert runner.invoke(app, ["calibrate", "import", files["c.yml"], "--out", files["again.json"]]).exit_code == 0
    assert Calibration.load(tmp_path / "again.json").projector == calibration.projector


AFFINE = np.array([[1.002, 0.003, 1.5], [-0.0031, 0.999, -2.25]])


def test_the_chips_are_registered_from_shared_points() -> None:
    random = np.random.default_rng(0)
    visible = random.uniform((0, 0), (1024, 768), (300, 2))
    infrared = visible @ AFFINE[:, :2].T + AFFINE[:, 2] + 0.03 * random.standard_normal((300, 2))
    infrared[:5] += 9.0
    infrared[5] = np.nan
    found = register_infrared(visible, infrared)
    np.testing.assert_allclose(found.ir_registration, AFFINE, atol=tolerance("calibration.registration_error"))
    assert (found.points, found.left_out) == (294, 5)
    hold("calibration.registration_rms_px", found.after_rms_px)
    assert found.before_rms_px > tolerance("calibration.registration_rms_px")
    off_deg = tolerance("calibration.registration_rotation_deg")
    assert found.rotation_deg == pytest.approx(-0.175, abs=off_deg)


def test_points_that_cannot_register_are_explained() -> None:
    random = np.random.default_rng(0)
    visible = random.uniform(0, 500, (40, 2))
    with pytest.raises(DecodeError, match="px apart"):
        register_infrared(visible, visible[::-1])
    with pytest.raises(InputError, match="3 points are seen by both"):
        register_infrared(visible[:3], visible[:3])
    line = np.column_stack([np.arange(40.0), 2 * np.arange(40.0)])
    with pytest.raises(InputError, match="in a line"):
        register_infrared(line, line)
    with pytest.raises(InputError, match="two lists of points"):
        register_infrared(visible, visible[:5])
