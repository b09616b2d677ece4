"""Sound shots of objects as narrow as a fringe are returned, and broken ones are refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from support.bars import hold

from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._isolated import isolated
from quadfringe.evaluation.scoring import Scene


# Steps of less than a fringe: their order margins are low, and their channels agree.
@pytest.mark.filterwarnings("ignore:.*contradict every fringe order:quadfringe.DecodeWarning")
@pytest.mark.parametrize(("period_px", "share", "seed"), [(33, 0.02, 42), (74, 0.02, 42), (110, 0.06, 42)])
def test_a_narrow_object_of_low_order_margin_is_returned(period_px: int, share: float, seed: int) -> None:
    scene = isolated(period_px, share, seed, surface="steps")
    found = scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    hold("soundness.right_percent", found.right_percent)
    hold("soundness.right_of_returned_percent", found.right_of_returned_percent)


def exchanged(scene: Scene) -> Scene:
    assert scene.ir is not None
    return replace(scene, green=scene.ir, ir=scene.green)


def twice(scene: Scene) -> Scene:
    return replace(scene, green=scene.red)


def numbered(*numbers: float) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, fringe_numbers=numbers)


# All of them were returned with orders that were all wrong, with order margins from 0.35 to 0.78.
@pytest.mark.parametrize(
    ("surface", "period_px", "seed", "fault"),
    [
        ("face", 33, 43, exchanged),
        ("sphere", 33, 43, exchanged),
        ("peaks", 33, 41, twice),
        ("sphere", 33, 41, twice),
        ("face", 74, 43, numbered(37, 36, 31)),
        ("peaks", 33, 41, numbered(64, 63, 56)),
        ("sphere", 110, 43, numbered(64, 63, 56)),
    ],
)
def test_a_broken_shot_of_a_small_object_is_refused(
    surface: str, period_px: int, seed: int, fault: Callable[[Scene], Scene]
) -> None:
    broken = fault(isolated(period_px, 0.02, seed, surface=surface))
    with pytest.raises(DecodeError):
        scenes.shape_of(broken, response="linear")
