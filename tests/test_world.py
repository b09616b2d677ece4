"""Scenes that resemble real objects: drawn from their seed alone, with a truth that passes as perfect."""

from __future__ import annotations

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.data import Shape
from quadfringe.evaluation import world
from quadfringe.evaluation.world import scenes
from quadfringe.evaluation.world.judging import fringe_px
from quadfringe.evaluation.world.scenes import Take

DRAWN = ("painted_face", "translucent_face")


def shape_of(take: Take, error_mm: float = 0.0, turns: int = 0) -> Shape:
    """Give the truth as a shape, with this error of the depth and orders off by some turns."""
    maps = {name: np.full(take.lit.shape, 0.1, np.float32) for name in ("modulation", "quality", "column_px")}
    phase_rad = np.where(take.lit, take.phase_rad + 2 * np.pi * turns, np.nan).astype(np.float32)
    xyz_mm = np.zeros((*take.lit.shape, 3), np.float32)
    xyz_mm[..., 2] = take.depth_mm + error_mm
    xyz_mm[~take.lit] = np.nan
    doubt = np.where(take.lit, 0.005, np.nan).astype(np.float32)
    sigma_mm = np.full(take.lit.shape, 0.1, np.float32)
    return Shape(phase_rad, **maps, xyz_mm=xyz_mm, wrong_order_probability=doubt, uncertainty_mm=sigma_mm)


@pytest.mark.parametrize("name", DRAWN)
def test_a_scene_follows_from_its_seed(name: str) -> None:
    one, again, other = (world.take(name, seed) for seed in (1, 1, 2))
    assert np.array_equal(one.shot.red, again.shot.red)
    assert not np.array_equal(one.shot.red, other.shot.red)
    assert one.counted.mean() > 0.8


def test_the_halves_share_no_seed() -> None:
    assert not set(world.TUNE) & set(world.REPORT)


def test_the_painted_face_differs_between_channels() -> None:
    take = world.take("painted_face", 1)
    red, ir = (image.astype(float) for image in (take.shot.red, take.shot.ir))
    skin = np.s_[420:460, 420:480]
    assert abs(red[skin].mean() - ir[skin].mean()) > 5


def test_the_truth_is_judged_as_perfect() -> None:
    take = world.take("steps", 1)
    found = world.judge(shape_of(take), take)
    assert found.rms_mm < 1e-4
    assert (found.returned_percent, found.wrong_percent, found.inside_1_percent) == (100.0, 0.0, 100.0)


def test_errors_orders_and_doubts_are_counted() -> None:
    take = world.take("steps", 1)
    found = world.judge(shape_of(take, error_mm=0.25), take)
    assert found.rms_mm == pytest.approx(0.25, abs=1e-4)
    assert [found.inside_1_percent, found.inside_2_percent, found.inside_3_percent] == [0.0, 0.0, 100.0]
    assert found.stated_wrong_percent == pytest.approx(0.5)
    wrong = shape_of(take, turns=1)
    doubts = world.Doubts()
    doubts.add(wrong, take)
    (row,) = [row for row in doubts.rows() if row[1]]
    assert row == ("0.003 to 0.01", int(take.counted.sum()), pytest.approx(0.005), 1.0)


def test_a_shape_without_millimetres_is_refused() -> None:
    take = world.take("plane", 1)
    shape = shape_of(take)
    with pytest.raises(ValueError, match="expected a shape decoded with a calibration"):
        world.judge(Shape(shape.phase_rad, shape.column_px, shape.modulation, shape.quality), take)


def test_the_truth_keeps_all_detail(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world.resolution, "PERIODS_PX", (8, 26))
    for along in ("x", "y"):
        ratios = world.height_ratios(shape_of, along, seed=1)
        assert ratios == pytest.approx({8: 1.0, 26: 1.0}, abs=0.02)
    assert world.edge_width_px(shape_of, seed=1) < 3


@pytest.mark.parametrize("along", ["x", "y"])
def test_the_joint_method_keeps_half_of_fine_waves_and_states_the_rest(
    monkeypatch: pytest.MonkeyPatch, along: str
) -> None:
    monkeypatch.setattr(world.resolution, "PERIODS_PX", (12, 16))
    inside_percent: list[float] = []
    with qf.open(qf.SystemConfig()) as scanner:
        known = scanner.calibration

    def decoded(take: world.Take) -> Shape:
        plan = qf.Plan(known.projector.width_px, take.fringe_numbers, known, response="linear")
        shape = qf.Decoder(take.shot, plan).decode_without_verdict(take.shot)
        inside_percent.append(world.judge(shape, take).inside_3_percent)
        return shape

    ratios = world.height_ratios(decoded, along, seed=1)
    hold("detail.fine_waves_kept", ratios[16])
    hold("detail.fine_waves_inside", inside_percent)


@pytest.mark.parametrize(
    ("ratios", "period_px"),
    [({4: 0.0, 8: 0.4, 16: 0.6}, 12.0), ({4: 0.7, 8: 0.9}, 4.0), ({4: 0.6, 8: 0.3, 16: 0.7}, 12.0)],
)
def test_the_period_of_half_the_height_is_interpolated(ratios: dict[int, float], period_px: float) -> None:
    assert world.half_height_period_px(ratios) == pytest.approx(period_px)


def test_half_the_height_may_never_be_reached() -> None:
    assert np.isnan(world.half_height_period_px({4: 0.0, 8: 0.4}))


def test_fringes_of_other_scenes_cover_the_range_of_the_method() -> None:
    periods_px = sorted(fringe_px(world.take(f"fringes_{name}", 1)) for name in scenes.OTHER_FRINGES)
    assert periods_px[0] < 10
    assert periods_px[-1] > 75
