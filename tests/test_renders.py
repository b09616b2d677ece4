"""Renders of an independent program, with rig and exact truth: geometry and phase."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from support.bars import hold

from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import numpy_chain, scoring

if TYPE_CHECKING:
    from quadfringe import Calibration

NOISE = 0.03  # sigma, fraction of full scale


@pytest.fixture(scope="module")
def calibration(data_dir: Path) -> Calibration:
    return scenes.calibration_of(scenes.rig(data_dir))


@pytest.mark.parametrize("name", scenes.RENDERS)
def test_without_noise_every_order_is_right(name: str, data_dir: Path, calibration: Calibration) -> None:
    scene = scenes.render(data_dir, name)
    shape = scenes.shape_of(scene, calibration=calibration)
    score = scoring.score(scene, shape.phase_rad, shape.xyz_mm)
    assert score.wrong_pixels == 0
    assert score.in_shadow_pixels == 0
    hold("renders.returned_percent", score.returned_percent)
    inner = scoring.inside(scene.scored, scoring.fringe_px(scene))
    score = scoring.score(scene, shape.phase_rad, shape.xyz_mm, inner)
    assert score.depth_rms_mm is not None
    hold("renders.clean_phase_rms_rad", score.phase_rms_rad)
    hold("renders.clean_depth_rms_mm", score.depth_rms_mm)


@pytest.mark.parametrize("seed", [0, 100])
@pytest.mark.parametrize("name", scenes.RENDERS)
def test_noise_of_three_percent_leaves_a_tenth_of_a_millimetre(
    name: str, seed: int, data_dir: Path, calibration: Calibration
) -> None:
    scene = scenes.render(data_dir, name, NOISE, seed)
    shape = scenes.shape_of(scene, calibration=calibration)
    score = scoring.score(scene, shape.phase_rad, shape.xyz_mm)
    hold("renders.right_of_returned_percent", score.right_of_returned_percent)
    hold("renders.returned_percent", score.returned_percent)
    assert score.depth_rms_mm is not None
    hold("renders.depth_rms_mm", score.depth_rms_mm)
    hold("renders.phase_rms_rad", score.right_phase_rms_rad)


def test_points_lie_on_their_camera_rays(data_dir: Path, calibration: Calibration) -> None:
    shape = scenes.shape_of(scenes.render(data_dir, "peaks"), calibration=calibration)
    assert shape.xyz_mm is not None
    k = scenes.rig(data_dir)["camera"]["K"]
    x_mm, y_mm, z_mm = np.moveaxis(shape.xyz_mm, -1, 0)
    rows, columns = np.indices(z_mm.shape)
    seen = np.isfinite(z_mm)
    hold("renders.ray_px", np.abs(k[0][0] * x_mm / z_mm + k[0][2] - columns)[seen])
    hold("renders.ray_px", np.abs(k[1][1] * y_mm / z_mm + k[1][2] - rows)[seen])


@pytest.mark.parametrize("name", scenes.RENDERS)
def test_the_published_way_agrees_with_the_plain_numpy_chain(name: str, data_dir: Path) -> None:
    scene = scenes.render(data_dir, name)
    plain = numpy_chain.decode(scene.red, scene.green, scene.blue, scene.ir)
    shape = scenes.shape_of(scene, method="published")
    inner = scoring.inside(scene.scored, scoring.fringe_px(scene))
    returned = inner & np.isfinite(shape.phase_rad)
    hold("renders.numpy_returned", returned.sum() / inner.sum())
    apart = np.angle(np.exp(1j * (shape.phase_rad - plain.phase_rad)[returned].astype(np.float64)))
    hold("renders.numpy_apart_rad", scoring.rms(apart))
    for phase_rad in (plain.phase_rad, shape.phase_rad):
        assert scoring.score(scene, phase_rad, mask=inner).wrong_pixels == 0
