"""Camera and projectors from boards: the whole chain on the virtual bench, the adjustment alone, and bad captures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold, tolerance

from quadfringe.calibration._adjustment import Adjustment, Sight
from quadfringe.calibration._grid import homography, jacobians
from quadfringe.calibration.bundle import Pose, RigCalibration, calibrate_camera, calibrate_rig
from quadfringe.calibration.detect import View
from quadfringe.calibration.poses import DegeneratePosesError
from quadfringe.calibration.projector import (
    ProjectorPoints,
)
from quadfringe.calibration.rehearsal import board_poses
from quadfringe.calibration.targets import ring_board
from quadfringe.data import core_device
from quadfringe.errors import CalibrationError, InputError
from quadfringe.evaluation import _rig_bench as bench

BOARD = ring_board()
SYSTEM = bench.bench_system()
POINT_SD_PX = 0.01
TRUE_PAIR = np.array([*bench.DEVIATION_DEG, *bench.DEVIATION_MM])


@pytest.mark.parametrize("layout", ["regular", "diamond"])
def test_the_bars_hold_on_the_bench(layout: str) -> None:
    """`evaluation/calibration.py` with a camera of half the size, in a fraction of the time."""
    figures = bench.measured(bench.bench_system(layout, camera_scale=0.5), poses=7, steps=5)
    for name in bench.FIGURES:
        hold(f"calibration.{name}", figures[name])


def points_of(device: Any, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    core = core_device(device)
    return np.array([core.project(tuple(p)) for p in points_mm.tolist()])


def simulated(places: NDArray[np.float64], seed: int, sd_px: float = POINT_SD_PX) -> list[Pose]:
    """Points as detection gives them: the projectors' points contain the error of the camera's point."""
    random = np.random.default_rng(seed)
    ids, found = np.arange(len(BOARD.points_mm)), []
    for place in places:
        points = BOARD.points_mm @ place[:3, :3].T + place[:3, 3]
        exact = points_of(SYSTEM.camera, points)
        error = sd_px * random.standard_normal(exact.shape)
        lit = []
        for device in (SYSTEM.projector, SYSTEM.infrared):
            pixels = points_of(device, points)
            slope = jacobians(homography(exact, pixels), exact)
            noise = sd_px * random.standard_normal(exact.shape)
            lit.append(ProjectorPoints(pixels + (slope @ error[:, :, None])[:, :, 0] + noise, slope, ids, (912, 1140)))
        found.append(Pose(View(exact + error, ids, (1024, 768)), *lit))
    return found


@pytest.fixture(scope="module")
def places() -> NDArray[np.float64]:
    return board_poses(BOARD, 9)


@pytest.fixture(scope="module")
def found(places: NDArray[np.float64]) -> RigCalibration:
    return calibrate_rig(simulated(places, seed=0), BOARD)


def test_stated_uncertainties_are_those_of_repeated_calibrations(places: NDArray[np.float64]) -> None:
    off = []
    for seed in range(12):
        done = calibrate_rig(simulated(places, seed), BOARD)
        error = np.array([*done.pair.rotation_deg, *done.pair.translation_mm]) - TRUE_PAIR
        lens = [
            (np.subtract(fit.device.focal_px, model.focal_px) / fit.sd.focal_px)
            for fit, model in ((done.camera, SYSTEM.camera), (done.visible, SYSTEM.projector))
        ]
        off.append(np.concatenate([error / done.pair.sd, *lens]))
    off = np.array(off)
    # 120 numbers of unit variance, correlated in tens: their mean square within a factor of two.
    hold("calibration.mean_square_in_sd", np.square(off).mean())
    hold("calibration.inside_95", (np.abs(off) < 1.96).mean())


def test_projectors_share_the_errors_of_the_camera_and_that_is_known(found: RigCalibration) -> None:
    assert set(found.point_sd_px) == {"camera", "visible", "infrared"}
    assert np.array(list(found.point_sd_px.values())) == pytest.approx(
        POINT_SD_PX, rel=tolerance("calibration.point_sd_relative")
    )
    hold("calibration.projector_rms_over_points", found.visible.rms_px / (POINT_SD_PX * np.sqrt(2)))


def test_wrong_points_are_left_out_and_spoil_nothing(places: NDArray[np.float64], found: RigCalibration) -> None:
    poses, random = simulated(places, seed=0), np.random.default_rng(5)
    rings, lit = [3, 50, 90], [10, 77]
    for i in (1, 4, 7):
        centres, pixels = poses[i].view.points_px.copy(), poses[i].infrared.points_px.copy()
        centres[rings] += np.array([[0.3], [5.0], [30.0]]) * (1, -1) + random.normal(0, 0.02, (3, 2))
        pixels[lit] += np.array([[0.5], [60.0]])
        infrared = replace(poses[i].infrared, points_px=pixels)
        poses[i] = replace(poses[i], view=replace(poses[i].view, points_px=centres), infrared=infrared)
    done = calibrate_rig(poses, BOARD)
    assert (done.camera.left_out, done.visible.left_out, done.infrared.left_out) == (9, 9, 15)
    for i, missed in enumerate(done.infrared.residuals_px):
        out = sorted(rings + lit) if i in (1, 4, 7) else []
        assert np.flatnonzero(np.isnan(missed).any(axis=1)).tolist() == out
    hold("calibration.spoiled_pose_in_sd", np.abs((done.pair.values - found.pair.values) / found.pair.sd))
    hold("calibration.cleaned_max_px", done.infrared.max_px)
    assert (found.camera.left_out, found.infrared.left_out) == (0, 0)


def test_a_pose_that_moved_is_named(places: NDArray[np.float64]) -> None:
    poses = simulated(places, seed=0)
    moved = poses[3].infrared
    poses[3] = replace(poses[3], infrared=replace(moved, points_px=moved.points_px + np.array((1.0, 0.4))))
    with pytest.raises(CalibrationError, match="infrared: 108 of 108 points of pose 4 contradict") as refused:
        calibrate_rig(poses, BOARD)
    assert refused.value.reason == "outlying"


def test_coordinates_have_their_own_precision(places: NDArray[np.float64]) -> None:
    """Rows of diamond mirrors lie half as far apart as columns, so that the same angle is twice as many of them."""
    poses, random = simulated(places, seed=1), np.random.default_rng(6)
    for i, pose in enumerate(poses):
        worse = pose.visible.points_px + random.normal(0, 3 * POINT_SD_PX, (108, 2)) * (0, 1)
        poses[i] = replace(pose, visible=replace(pose.visible, points_px=worse))
    done = calibrate_rig(poses, BOARD)
    assert done.point_sd_px["visible"] == pytest.approx(
        POINT_SD_PX * np.array((1, np.sqrt(10))), rel=tolerance("calibration.point_sd_relative")
    )


def test_records_are_whole(found: RigCalibration, places: NDArray[np.float64]) -> None:
    count = 3 * 8 + 2 * 6 + len(places) * 6
    assert len(found.names) == len(set(found.names)) == len(found.values) == count
    assert found.covariance.shape == (count, count)
    sd = dict(zip(found.names, np.sqrt(np.diag(found.covariance)), strict=True))
    assert sd["visible.focal_x_px"] == pytest.approx(found.visible.sd.focal_px[0])
    np.testing.assert_allclose(found.T_camera_board, places, atol=tolerance("calibration.board_pose"))
    assert [r.shape for r in found.infrared.residuals_px] == [(108, 2)] * len(places)
    assert found.camera.device.rotation == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    np.testing.assert_allclose(
        found.visible.device.translation_mm,
        SYSTEM.projector.translation_mm,
        atol=tolerance("calibration.projector_translation_mm"),
    )
    alone = calibrate_camera([pose.view for pose in simulated(places, seed=0)], BOARD)
    assert alone.visible is None
    assert alone.pair is None
    np.testing.assert_allclose(
        alone.camera.device.focal_px, SYSTEM.camera.focal_px, rtol=tolerance("calibration.camera_focal_relative")
    )


def test_derivatives_are_those_of_the_residuals(places: NDArray[np.float64], found: RigCalibration) -> None:
    pose = simulated(places[:1], seed=4)[0]
    rows = np.arange(0, 108, 9)
    sights = [Sight("camera", 0, BOARD.points_mm, pose.view.points_px)]
    for name in ("visible", "infrared"):
        lit = getattr(pose, name)
        sights.append(Sight(name, 0, BOARD.points_mm[rows], lit.points_px[rows], lit.slope[rows], rows))
    sd_px = dict.fromkeys(("camera", "visible", "infrared"), np.array([0.5, 0.3]))
    adjustment = Adjustment(sights, 1, radial3=True, sd_px=sd_px)
    by_name = dict(zip(found.names, found.values, strict=True))
    values = np.array([by_name.get(name, 0.01) for name in adjustment.names])
    exact = adjustment.jacobian(values).toarray()
    for column, value in enumerate(values):
        step = 1e-6 * max(abs(value), 1.0)
        moved = np.eye(len(values))[column] * step
        numeric = (adjustment.residuals(values + moved) - adjustment.residuals(values - moved)) / (2 * step)
        scale = max(np.abs(numeric).max(), 1e-3)
        np.testing.assert_allclose(
            exact[:, column] / scale, numeric / scale, atol=2e-5, err_msg=adjustment.names[column]
        )


def turned(turns: list[tuple[float, float, float]], depths_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    middle = BOARD.points_mm.mean(axis=0)
    motions = np.tile(np.eye(4), (len(turns), 1, 1))
    for motion, turn, depth_mm in zip(motions, turns, depths_mm, strict=True):
        motion[:3, :3] = cv2.Rodrigues(np.array(turn))[0]
        motion[:3, 3] = (3.0, -5.0, depth_mm) - motion[:3, :3] @ middle
    return motions


DEEP_MM = np.linspace(720, 900, 9)
DEGENERATE = {
    "too_few": board_poses(BOARD, 9)[:3],
    "fronto_parallel": turned([(0.0, 0.0, 0.02 * i) for i in range(9)], DEEP_MM),
    "fronto_parallel, all tilted alike": turned([(0.4, 0.2, 0.0)] * 9, DEEP_MM),
    "one_axis": turned([(a, 0.0, 0.0) for a in np.linspace(-0.5, 0.5, 9)], DEEP_MM),
    "one_depth": board_poses(BOARD, 9, range_mm=1.0),
}


@pytest.mark.parametrize("what", DEGENERATE)
def test_poses_that_cannot_tell_are_named_and_not_fitted(what: str) -> None:
    views = [pose.view for pose in simulated(DEGENERATE[what], seed=1)]
    with pytest.raises(DegeneratePosesError) as refused:
        calibrate_camera(views, BOARD)
    assert refused.value.reason == what.split(",")[0]


def spoiled(poses: list[Pose], what: str) -> list[Pose]:
    pose = poses[2]
    if what == "mixed image sizes":
        return [*poses[:2], replace(pose, view=replace(pose.view, size_px=(512, 384))), *poses[3:]]
    if what == "missing fringes":
        return [*poses[:2], replace(pose, infrared=None), *poses[3:]]
    if what == "other points":
        return [*poses[:2], replace(pose, visible=replace(pose.visible, ids=pose.visible.ids[::-1])), *poses[3:]]
    if what == "not lit":
        dark = np.where(np.arange(108)[:, None] < 5, pose.visible.points_px, np.nan)
        return [*poses[:2], replace(pose, visible=replace(pose.visible, points_px=dark)), *poses[3:]]
    if what == "mirrored projector":
        return [replace(p, visible=replace(p.visible, slope=p.visible.slope * ((-1.0,), (1.0,)))) for p in poses]
    other = [replace(p, visible=replace(p.visible, size_px=(1280, 800))) for p in poses[:1]]
    return other + poses[1:]


SPOILED = {
    "mixed image sizes": "512 x 384, 1024 x 768",
    "missing fringes": r"infrared: no points in poses \[3\]",
    "other points": "the point ids of pose 3 differ from those of its view",
    "not lit": "5 of 108 points of pose 3 are lit",
    "mirrored projector": "sees the projector image mirrored",
    "mixed projectors": "expected one projector size",
}


@pytest.mark.parametrize("what", SPOILED)
def test_bad_captures_are_named(what: str, places: NDArray[np.float64]) -> None:
    poses = spoiled(simulated(places, seed=2), what)
    with pytest.raises((InputError, CalibrationError), match=SPOILED[what]):
        calibrate_rig(poses, BOARD)


def test_a_wrong_size_of_the_board_shows_in_its_distance(places: NDArray[np.float64]) -> None:
    poses = simulated(places, seed=3)
    wrong = ring_board(pitch_mm=25.0)
    with pytest.raises(CalibrationError, match=r"its pitch is about 20(\.\d)? mm, not 25 mm"):
        calibrate_rig(poses, wrong, distance_mm=740.0)
    calibrate_rig(poses, BOARD, distance_mm=740.0)
