"""A sample of the attack by spoilt shots; `python -m hostile --shots 1000` in the folder tests is the whole."""

from __future__ import annotations

import numpy as np
import pytest
from hostile.shots import CASES, METHODS, ShotOutcome, hostile_shots

import quadfringe as qf

SEEDS = range(3)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", CASES)
def test_a_spoilt_shot_is_refused_with_its_cause(case: str, method: str) -> None:
    outcomes = list(hostile_shots(case, method, SEEDS))
    assert [outcome for outcome in outcomes if outcome.fault or not outcome.named] == []


# Seeds at which an earlier version returned shapes whose orders were all wrong.


@pytest.mark.parametrize(
    ("case", "method", "seed", "reason"),
    [
        ("wrong code", "joint", 2, "fringe numbers"),
        ("wrong code", "joint", 5, "fringe numbers"),
        ("wrong code", "published", 6, "fringe numbers"),
        ("wrong code", "published", 435, "fringe orders"),
        ("channel missing", "published", 18, "blind channel"),
        ("channel missing", "published", 29, "blind channel"),
        ("channel missing", "published", 115, "blind channel"),
        ("saturated", "published", 22, "saturation"),
        ("saturated", "published", 146, "saturation"),
        ("saturated", "joint", 258, "saturation"),
        ("noise only", "published", 126, "no fringes"),
        ("noise only", "published", 489, "fringe orders"),
        ("mirrored", "published", 0, "mirrored or rotated"),
    ],
)
def test_what_failed_once_is_refused_with_its_cause(case: str, method: str, seed: int, reason: str) -> None:
    (outcome,) = hostile_shots(case, method, range(seed, seed + 1))
    assert (outcome.reason, outcome.wrong) == (reason, 0.0)


def test_a_sound_shot_of_the_same_kind_is_returned() -> None:
    """The attack decodes shots that would be sound if they were not spoilt."""
    from hostile import shots

    for seed in (2, 4):
        random = np.random.default_rng(seed)
        images, truth, calibration = shots._sound(random, seed)
        shot = qf.Shot(*(images[name] for name in shots.CHANNELS))
        for method in METHODS:
            plan = qf.Plan(912, calibration=calibration, decode={"method": method})
            assert shots._decoded("saturated", method, seed, shot, plan, truth).reason == "returned"


@pytest.mark.parametrize("method", METHODS)
def test_swapped_chips_are_refused(method: str) -> None:
    """The wire does not show them: tests/camera/test_wire_faults.py."""
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="plane", noise=0.01, bayer="rggb"))) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    assert isinstance(shot, qf.BayerShot)
    swapped = qf.BayerShot(shot.ir, shot.bayer, shot.raw)
    with pytest.raises(qf.DecodeError):
        qf.decode(swapped, qf.Plan(912, calibration=calibration, decode={"method": method}))


def test_a_wrong_shape_is_a_fault() -> None:
    assert ShotOutcome("mirrored", "joint", 0, "returned", wrong=0.002).fault
    assert ShotOutcome("mirrored", "joint", 0, "traceback").fault
    assert not ShotOutcome("mirrored", "joint", 0, "returned", wrong=0.0005).fault
