"""Sound shots of objects as narrow as a fringe are returned, and broken ones are refused."""

from __future__ import annotations

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.decoding.agreement import Agreement, small_by_chance
from quadfringe.decoding.verdict_params import OFFSET_MAX_RAD, STANDING_MIN
from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._faults import BROKEN
from quadfringe.evaluation._isolated import FRINGES, isolated, printed


# Steps of less than a fringe: their order margins are low, and their channels agree.
@pytest.mark.filterwarnings("ignore:.*contradict every fringe order:quadfringe.DecodeWarning")
@pytest.mark.parametrize(("period_px", "share", "seed"), [(33, 0.02, 42), (74, 0.02, 42), (110, 0.06, 42)])
def test_a_narrow_object_of_low_order_margin_is_returned(period_px: int, share: float, seed: int) -> None:
    scene = isolated(period_px, share, seed, surface="steps")
    found = scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    hold("soundness.right_percent", found.right_percent)
    hold("soundness.right_of_returned_percent", found.right_of_returned_percent)


@pytest.mark.parametrize(
    ("surface", "period_px", "seed", "fault"),
    [
        ("face", 33, 43, "green and ir"),
        ("sphere", 33, 43, "green and ir"),
        ("peaks", 33, 41, "red twice"),
        ("sphere", 33, 41, "red twice"),
        ("face", 74, 43, "37, 36, 31"),
        ("peaks", 33, 41, "64, 63, 56"),
        ("sphere", 110, 43, "64, 63, 56"),
    ],
)
def test_a_broken_shot_of_a_small_object_is_refused(surface: str, period_px: int, seed: int, fault: str) -> None:
    """Without a verdict they have a shape, most of whose orders are wrong."""
    broken = BROKEN[fault](isolated(period_px, 0.02, seed, surface=surface))
    shot, plan = scenes.plan_of(broken, response="linear")
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    hold("soundness.broken_right_percent", scoring.score(broken, shape.phase_rad).right_of_returned_percent)
    with pytest.raises(DecodeError):
        qf.decode(shot, plan)


@pytest.mark.parametrize(("period_px", "share", "seed", "surface"), [(33, 0.04, 1, "peaks"), (50, 0.08, 2, "steps")])
def test_a_printed_object_that_no_other_reading_explains_is_returned(
    period_px: int, share: float, seed: int, surface: str
) -> None:
    scene = printed(period_px, share, seed, surface=surface)
    shot, plan = scenes.plan_of(scene, response="linear")
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    assert Agreement(shape, shot, plan).contradicted
    found = scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    hold("soundness.printed_right_percent", found.right_percent)
    hold("soundness.printed_right_of_returned_percent", found.right_of_returned_percent)


@pytest.mark.parametrize("fault", ["ir by 8 px", "37, 36, 31", "64, 63, 56", "green and ir"])
def test_a_broken_shot_of_a_printed_object_is_refused(fault: str) -> None:
    """Most of its lit pixels are returned without a verdict, with wrong orders."""
    broken = BROKEN[fault](printed(33, 0.04, 4, surface="peaks"))
    shot, plan = scenes.plan_of(broken, response="linear")
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    assert np.count_nonzero(shape.returned) > STANDING_MIN * np.count_nonzero(np.isfinite(shape.quality))
    hold("soundness.broken_right_percent", scoring.score(broken, shape.phase_rad).right_of_returned_percent)
    with pytest.raises(DecodeError):
        qf.decode(shot, plan)


@pytest.mark.parametrize("numbers", [(36.0, 35.0, 30.0), *(FRINGES[period_px] for period_px in (9, 33, 110))])
def test_chance_makes_offsets_small_as_often_as_stated(numbers: tuple[float, ...]) -> None:
    """Where G and IR know nothing of the phase, a tile has the offsets of the best of all orders."""
    first, *others = numbers
    angles_rad = np.random.default_rng(5).uniform(-np.pi, np.pi, (20000, 1, 2))
    turns = 2 * np.pi * np.arange(first)[:, np.newaxis] * np.array(others) / first
    offsets_rad = np.abs(np.angle(np.exp(1j * (angles_rad - turns)))).max(axis=2).min(axis=1)
    stated = small_by_chance(OFFSET_MAX_RAD, first, len(others))
    found = (offsets_rad < OFFSET_MAX_RAD).mean()
    hold("soundness.chance_sigmas", abs(found - stated) / np.sqrt(stated * (1 - stated) / len(offsets_rad)))
