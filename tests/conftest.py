"""Fixtures of all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import quadfringe as qf
from quadfringe.config import Device
from quadfringe.data import Calibration
from quadfringe.evaluation._scenes import data_folder


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of captures and renders; without it a test is skipped, or fails when CI is set."""
    folder = data_folder()
    if not (folder / "renders" / "rig.json").is_file():
        reason = f"no test data in {folder}; set QUADFRINGE_DATA to the folder that holds renders/"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    return folder


SMALL_SYSTEM = """
[camera]
width_px = 512
height_px = 384
focal_px = [1290.0, 1290.0]
centre_px = [255.5, 191.5]

[scene]
surface = "steps"
noise = 0.01
"""


@pytest.fixture(scope="session")
def small_bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one simulated shot of 512 x 384 pixels as files, its system file, calibration and truth."""
    from quadfringe.evaluation.simulate import virtual_bench_config, write_simulation

    folder = tmp_path_factory.mktemp("bench")
    (folder / "system.toml").write_text(SMALL_SYSTEM)
    write_simulation(folder, virtual_bench_config(folder / "system.toml"))
    return folder


@pytest.fixture(scope="session")
def bench() -> tuple[qf.Shot, Calibration]:
    """A shot of a face, 512 x 384 px, 1 % noise, and the calibration of its bench."""
    small = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
    with qf.open(qf.SystemConfig(camera=small, scene=qf.SceneConfig(surface="face", noise=0.01, seed=2))) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    assert isinstance(shot, qf.Shot)
    assert calibration is not None
    return shot, calibration
