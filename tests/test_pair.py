"""The pair of projectors: its pose, its correction, and unwrapping with both calibrations."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.bars import hold, tolerance
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.calibration.projector_pair import AXES, deviated, pair_pose
from quadfringe.cli import app
from quadfringe.config import DecodeConfig, Device
from quadfringe.data import Calibration, device_from_core
from quadfringe.decoding import Decoder, Plan
from quadfringe.errors import ConfigError, InputError
from quadfringe.evaluation.reproduce import Reproduction, depth, deviated_pair, projector_calibration, row_profile
from quadfringe.evaluation.reproduce import correction as correction_of
from quadfringe.evaluation.reproduce import tolerance as tolerance_of
from quadfringe.evaluation.reproduce._pair_bench import ideal_pair, real_pair
from quadfringe.io.images import read_image

APART = ((1.0, 1.0, 1.0), (0.5, 0.5, 0.5))
Figures = dict[str, float]


def run(*arguments: object) -> Any:
    return CliRunner().invoke(app, [str(a) for a in arguments])


# The pose of the pair (S10)


def test_the_pose_of_a_deviated_pair_is_found_back() -> None:
    pair = ideal_pair(*APART)
    found = pair_pose(
        pair.visible.rotation, pair.visible.translation_mm, pair.infrared.rotation, pair.infrared.translation_mm
    )
    np.testing.assert_allclose(found.values, [1.0, 1.0, 1.0, 0.5, 0.5, 0.5], atol=1e-9)
    assert np.isnan(found.sd).all()


def test_stated_intervals_hold_as_often_as_they_say() -> None:
    rng = np.random.default_rng(7)
    pair = ideal_pair(*APART)
    poses = [(np.array(d.rotation), np.array(d.translation_mm)) for d in (pair.visible, pair.infrared)]
    truth = np.concatenate([np.concatenate([cv2.Rodrigues(r)[0].ravel(), t]) for r, t in poses])
    # Both projectors share the error of the camera: strong correlation, which must not widen the interval.
    own, shared = np.diag([2e-4] * 3 + [0.1] * 3), np.diag([1e-3] * 3 + [0.5] * 3)
    covariance = np.block([[own**2 + shared**2, shared**2], [shared**2, own**2 + shared**2]])
    inside, known = [], np.concatenate(APART)
    for draw in rng.multivariate_normal(truth, covariance, size=400):
        first, second = (cv2.Rodrigues(draw[i : i + 3])[0] for i in (0, 6))
        pose = pair_pose(first, draw[3:6], second, draw[9:12], covariance)
        low, high = pose.interval(0.95).T
        inside.append(bool(((low <= known) & (known <= high)).all()))
    hold("pair.interval_95", np.mean(inside))


def test_a_pose_that_cannot_be_is_refused() -> None:
    one, origin = np.eye(3), np.zeros(3)
    with pytest.raises(InputError, match="proper rotation"):
        pair_pose(np.diag([1.0, 1.0, -1.0]), origin, one, origin)
    with pytest.raises(InputError, match=r"shape \(12, 12\)"):
        pair_pose(one, origin, one, origin, np.eye(6))
    with pytest.raises(InputError, match="symmetric"):
        pair_pose(one, origin, one, origin, np.triu(np.ones((12, 12))))
    with pytest.raises(InputError, match="between 0 and 1"):
        pair_pose(one, origin, one, origin, np.eye(12)).interval(95)


# Published results


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pair")


def test_a_deviated_pair_is_unwrapped_wrong(folder: Path) -> None:
    found = deviated_pair(folder, shrink=4)
    figures, picture = found.figures, found.picture
    assert figures["single_wrong_order_percent"] == 0
    hold("pair.single_rms_rad", figures["single_rms_rad"])
    hold("pair.deviated_wrong_order_percent", figures["deviated_wrong_order_percent"])
    assert picture.stat().st_size > 10_000


@pytest.fixture(scope="module")
def allowed(folder: Path) -> Reproduction:
    return tolerance_of(folder, shrink=16)


def test_tolerances_are_where_the_geometry_puts_them(allowed: Reproduction) -> None:
    found = allowed.figures
    assert tuple(found) == AXES
    # The search along the fringes ends before any harm is done.
    assert [one.name for one in allowed.records if one.at_least] == ["ty_mm"]
    assert "ty at least 100 mm" in allowed.verdict
    # A sixth of a turn of half the infrared fringe, seen from 632 mm by a lens of 1573 px.
    columns = 912 / 30 / 12
    assert found["ry_deg"] == pytest.approx(np.degrees(columns / 1573), rel=tolerance("pair.tolerance_relative"))
    assert found["tx_mm"] == pytest.approx(columns * 632 / 1573, rel=tolerance("pair.tolerance_relative"))
    assert found["rz_deg"] > found["ry_deg"]
    hold("pair.tolerance_ty_over_tx", found["ty_mm"] / found["tx_mm"])


@pytest.fixture(scope="module")
def correction(folder: Path) -> Figures:
    return correction_of(folder, shrink=2).figures


def test_the_corrected_pair_is_as_good_as_one_projector(correction: Figures) -> None:
    hold("pair.deviated_rms_rad", correction["before_rms_rad"])
    hold("pair.deviated_wrong_order_percent", correction["before_wrong_order_percent"])
    hold("pair.wrong_order_percent", correction["after_wrong_order_percent"])
    for kind in ("after_rms_rad", "after_joint_rms_rad", "infrared_after_rms_rad"):
        hold("pair.rms_rad", [correction[kind], correction[f"{kind}_row130"]])


def test_the_row_of_the_corrected_pair_is_better_than_published(folder: Path) -> None:
    found = row_profile(folder, shrink=4)
    known = {one.name: one for one in found.records}
    before, after = (known[f"infrared_{when}_rms_rad_row130"] for when in ("before", "after"))
    assert (before.published, after.published) == (0.277, 0.031)
    hold("pair.deviated_rms_rad", before.value)
    hold("pair.rms_rad", after.value)
    assert "WORSE" not in found.verdict


def test_what_remains_is_allowed(correction: Figures, allowed: Reproduction) -> None:
    for axis in AXES:
        assert abs(correction[f"remaining_{axis}"]) < allowed.figures[axis], axis


def test_the_search_needs_no_coaxial_pair_at_any_depth(folder: Path) -> None:
    found = depth(folder, shrink=2, depths_mm=(700.0, 800.0, 900.0))
    figures, picture = found.figures, found.picture
    for translation in ("0.5mm", "5mm"):
        hold("pair.rms_rad", figures[f"searched_{translation}_rms_rad"])
        hold("pair.rms_rad", figures[f"searched_{translation}_infrared_rms_rad"])
        hold("pair.wrong_order_percent", figures[f"searched_{translation}_wrong_order_percent"])
        hold("pair.searched_returned_percent", figures[f"searched_{translation}_returned_percent"])
        hold("pair.deviated_wrong_order_percent", figures[f"plain_{translation}_wrong_order_percent"])
    # The pre-deformed image drifts with depth: ten times the translation, ten times the drift.
    drift = [figures[f"corrected_{t}_infrared_rms_rad"] for t in ("0.5mm", "5mm")]
    hold("pair.drift_rms_rad", drift[0])
    hold("pair.drift_of_ten_times", drift[1] / drift[0])
    hold("pair.drifted_wrong_order_percent", figures["corrected_5mm_wrong_order_percent"])
    assert picture.stat().st_size > 10_000


def test_a_calibrated_pair_is_as_good_as_a_known_one(folder: Path) -> None:
    """A sixteenth of the pixels, few poses and steps; `quadfringe reproduce projector-calibration` runs it in full."""
    found = projector_calibration(folder, shrink=4, poses=6, steps=4)
    figures, picture = found.figures, found.picture
    for name in ("camera", "visible", "infrared"):
        hold(f"calibration.{name}_mean_px", figures[f"{name}_mean_px"])
    assert all(abs(figures[f"{axis}_error"]) <= figures[f"{axis}_interval"] for axis in AXES)
    off = np.array([figures[f"{axis}_error"] for axis in AXES])
    hold("calibration.pair_rotation_error_deg", np.linalg.norm(off[:3]))
    hold("calibration.pair_translation_error_mm", np.linalg.norm(off[3:]))
    for where in ("corrected", "searched_700mm", "searched_900mm"):
        hold("pair.wrong_order_percent", figures[f"{where}_wrong_order_percent"])
        hold("pair.noisy_rms_rad", figures[f"{where}_infrared_rms_rad"])
    assert picture.stat().st_size > 10_000


# As a user meets it


def calibration(pair: Any, folder: Path) -> Path:
    pair.calibration.save(folder / "calibration.json")
    return folder / "calibration.json"


@pytest.mark.parametrize("layout", ["regular", "diamond"])
def test_pattern_writes_the_predeformed_image(tmp_path: Path, layout: str) -> None:
    pair = real_pair(layout=layout)  # type: ignore[arg-type]
    known = calibration(pair, tmp_path)
    plain, deformed = tmp_path / "plain", tmp_path / "deformed"
    assert run("pattern", "--out", plain, "--layout", layout).exit_code == 0
    arguments = ("pattern", "--out", deformed, "--layout", layout, "--calibration", known, "--predeformed-z-mm", 800)
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    images = [read_image(folder / "infrared.png") for folder in (plain, deformed)]
    assert [image.shape for image in images] == [(1140, 912)] * 2
    assert np.abs(images[0].astype(float) - images[1]).mean() > 20
    np.testing.assert_array_equal(read_image(plain / "visible.png"), read_image(deformed / "visible.png"))


def test_what_cannot_be_predeformed_is_an_error(tmp_path: Path) -> None:
    pair = real_pair()
    single = pair.calibration.model_copy(update={"infrared": None})
    single.save(tmp_path / "single.json")
    z = ("--predeformed-z-mm", 800)
    cases = [
        (z, "both projectors"),
        ((*z, "--calibration", tmp_path / "single.json"), "both projectors"),
        (("--calibration", tmp_path / "single.json"), "--predeformed-z-mm"),
        ((*z, "--calibration", calibration(pair, tmp_path), "--width", 800), "912 x 1140"),
    ]
    for options, reason in cases:
        result = run("pattern", "--out", tmp_path / "out", *options)
        assert result.exit_code == 2, result.output
        assert reason in result.stderr
        assert not (tmp_path / "out").exists()


def measured(**changes: Any) -> float:
    """Give the share of pixels of a plane whose depth is right, over the lit ones, of a bench that is not coaxial."""
    pair = real_pair(shrink=4)
    bench = {"camera": pair.camera, "projector": pair.visible, "infrared": pair.infrared}
    scene = {"surface": "plane", "noise": 0.01, "seed": 3}
    config = qf.SystemConfig.model_validate({**bench, "scene": scene, **changes})
    with qf.open(config) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    assert shot.truth is not None
    assert shape.config["decode"]["unwrapping"] == (changes["decode"].get("unwrapping") or "coaxial")
    lit = np.isfinite(shot.truth.depth_mm) & ~shot.truth.shadow & ~shot.truth.edge
    return float(np.mean(np.abs(shape.depth_mm - shot.truth.depth_mm)[lit] < 5))


def test_a_system_measures_with_a_pair_that_is_not_coaxial() -> None:
    decode = {"method": "published", "unwrapping": "pair", "depth_range_mm": (600.0, 1000.0)}
    hold("pair.right_depth", measured(decode=decode))


def test_a_system_shows_predeformed_fringes() -> None:
    fringes = {"predeformed_z_mm": 800.0}
    hold("pair.right_depth", measured(decode={"method": "published"}, fringes=fringes))
    hold("pair.right_depth", measured(decode={"method": "published", "unwrapping": "pair"}, fringes=fringes))


def test_the_search_needs_both_projectors_and_says_so() -> None:
    pair = ideal_pair(*APART, shrink=4)
    shot = qf.Shot(*(np.zeros((192, 256), np.uint8) for _ in range(4)))
    single = pair.calibration.model_copy(update={"infrared": None})
    for method, known in product(("joint", "published"), (None, single)):
        searched = DecodeConfig.model_validate({"method": method, "unwrapping": "pair"})
        with pytest.raises(InputError, match="both projectors"):
            Decoder(shot, Plan(912, calibration=known, decode=searched))


def test_calibrations_keep_the_infrared_projector(tmp_path: Path) -> None:
    pair = real_pair()
    again = Calibration.load(calibration(pair, tmp_path))
    assert again.infrared == pair.infrared
    stored = json.loads((tmp_path / "calibration.json").read_text())
    stored["infrared"]["focal"] = [1, 2]
    (tmp_path / "bad.json").write_text(json.dumps(stored))
    with pytest.raises(ConfigError, match=r"infrared\.focal"):
        Calibration.load(tmp_path / "bad.json")


def test_deviating_back_gives_the_device() -> None:
    device: Device = real_pair().visible
    moved = deviated(device, (0, 0, 2.0), (0, 0, 3.0))
    back = deviated(moved, (0, 0, -2.0), (0, 0, -3.0))
    np.testing.assert_allclose(back.translation_mm, device.translation_mm, atol=1e-9)
    assert device_from_core(real_pair().bench.visible) == device
