"""Objects on black ground, and captures as other benches could have made them, are decoded and not refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold

import quadfringe as qf
from quadfringe.errors import DecodeError, DecodeWarning
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._isolated import isolated, patches, tinted
from quadfringe.evaluation._variants import VARIANTS, stepped, turned

# Bar, fringe period in px, share of the frame, seed. Objects of 2 % are narrower than a few fringes.
OBJECTS = [
    ("right_percent", 74, 0.15, 2),
    ("right_percent", 9, 0.05, 2),
    ("right_percent", 33, 0.2, 4),
    ("right_percent", 110, 0.2, 4),
    ("small_right_percent", 20, 0.02, 2),
    ("small_right_percent", 74, 0.02, 4),
    ("small_right_percent", 74, 0.02, 16),  # two fringes of low order margin
    ("small_right_percent", 110, 0.02, 11),  # one and a third
]
WORST = [
    ("plate", "cut out", 4),
    ("plate", "darkened", 4),
    ("bottle", "as captured", 6),
    ("bottle", "inclined, cut out", 4),
    ("bottle", "binned, cut out", 4),
]


@pytest.mark.parametrize(("bar", "period_px", "fill", "seed"), OBJECTS)
def test_an_object_on_black_is_decoded(bar: str, period_px: int, fill: float, seed: int) -> None:
    scene = isolated(period_px, fill, seed)
    score = scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    hold(f"isolated.{bar}", score.right_percent)
    hold("isolated.right_of_returned_percent", score.right_of_returned_percent)


def test_a_sphere_whose_fringes_cancel_in_a_window_is_decoded() -> None:
    """Windows at the rim see sphere and ground, and green and infrared have no contrast in some of them."""
    scene = isolated(74, 0.15, 18, surface="sphere")
    score = scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    hold("isolated.right_percent", score.right_percent)
    hold("isolated.right_of_returned_percent", score.right_of_returned_percent)


@pytest.mark.parametrize(
    ("period_px", "fill", "seed", "surface", "contrast", "side_px", "tint"),
    [
        (74, 0.13, 203, "peaks", 0.3, 148, 0.0),
        (50, 0.4, 541, "steps", 0.3, 150, 0.0),
        (20, 0.4, 876, "peaks", 0.6, 24, 0.1),
    ],
)
def test_an_object_with_a_texture_that_the_channels_share_is_decoded(
    period_px: int, fill: float, seed: int, surface: str, contrast: float, side_px: int, tint: float
) -> None:
    scene = isolated(period_px, fill, seed, surface=surface, contrast=contrast, albedo=tinted(side_px, seed, tint))
    score = scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    hold("isolated.textured_right_percent", score.right_percent)
    hold("isolated.textured_right_of_returned_percent", score.right_of_returned_percent)


@pytest.fixture(scope="module")
def coloured() -> scoring.Scene:
    """An object of coloured patches, whose median order margin is below that of shots with other fringe numbers."""
    return isolated(20, 0.15, 2, contrast=0.5, noise=0.02, albedo=patches(60, 2))


def test_a_coloured_object_is_not_refused(coloured: scoring.Scene) -> None:
    score = scoring.score(coloured, scenes.shape_of(coloured, response="linear").phase_rad)
    hold("isolated.coloured_right_of_returned_percent", score.right_of_returned_percent)


def test_a_coloured_object_with_other_fringe_numbers_is_refused(coloured: scoring.Scene) -> None:
    for numbers in ((36.0, 35.0, 30.0), (49.0, 48.0, 42.0)):
        with pytest.raises(DecodeError):
            scenes.shape_of(replace(coloured, fringe_numbers=numbers), response="linear")


@pytest.mark.parametrize("pair", [("red", "blue"), ("green", "ir"), ("red", "green")])
def test_a_coloured_object_with_exchanged_channels_is_refused(coloured: scoring.Scene, pair: tuple[str, str]) -> None:
    first, second = (coloured.channels[name] for name in pair)
    with pytest.raises(DecodeError):
        scenes.shape_of(replace(coloured, **{pair[0]: second, pair[1]: first}), response="linear")


@pytest.mark.filterwarnings("ignore:.*darker than the black:quadfringe.DecodeWarning")
@pytest.mark.parametrize(("name", "variant", "offset"), WORST)
def test_variants_of_captures_are_decoded(data_dir: Path, name: str, variant: str, offset: int) -> None:
    response = scenes.response_of(data_dir, name)
    scene = VARIANTS[variant](stepped(data_dir, name, offset), offset)
    score = scoring.score(scene, scenes.shape_of(scene, response=response).phase_rad)
    hold("variants.right_percent", score.right_percent)
    hold("variants.right_of_returned_percent", score.right_of_returned_percent)


@pytest.mark.parametrize("offset", [0, 1])
@pytest.mark.parametrize("name", scenes.CAPTURES)
def test_a_capture_that_is_turned_by_90_degrees_is_decoded_or_refused_as_such(
    data_dir: Path, name: str, offset: int
) -> None:
    response = scenes.response_of(data_dir, name)
    scene = turned(stepped(data_dir, name, offset), offset)
    with pytest.warns(DecodeWarning, match="turned by 90 degrees"):
        score = scoring.score(scene, scenes.shape_of(scene, response=response).phase_rad)
    hold(f"variants.{name}_turned_joint_right_worst_percent", score.right_percent)
    with pytest.raises(DecodeError, match=r"turned by 90 degrees: fringes run along the rows.*joint") as caught:
        scenes.shape_of(scene, response=response, method="published")
    assert caught.value.reason == "turned images"


def test_inclined_fringes_are_not_taken_for_turned_ones(data_dir: Path) -> None:
    response = scenes.response_of(data_dir, "plate")
    scene = VARIANTS["inclined"](stepped(data_dir, "plate", 4), 4)
    scenes.shape_of(scene, response=response, method="published")


def test_the_fringe_period_can_be_told() -> None:
    scene = isolated(20, 0.05, 2)
    shot, plan = scenes.plan_of(scene, response="linear", period_px=18.0)
    shape = qf.decode(shot, plan)
    assert shape.config["decode"]["period_px"] == 18.0
    hold("isolated.right_percent", scoring.score(scene, shape.phase_rad).right_percent)
    for period_px in (2.0, -5.0, np.nan, (2.0, 20.0), (30.0, 20.0), (10.0, 20.0, 30.0)):
        with pytest.raises(qf.ConfigError, match="period_px"):
            qf.DecodeConfig(period_px=period_px)


def test_the_fringe_period_can_be_told_as_a_range() -> None:
    scene = isolated(20, 0.05, 2)

    def phase(period_px: float | tuple[float, float] | None) -> NDArray[np.float32]:
        shot, plan = scenes.plan_of(scene, response="linear", period_px=period_px)
        shape = qf.decode(shot, plan)
        assert shape.config["decode"]["period_px"] == (list(period_px) if isinstance(period_px, tuple) else period_px)
        return shape.phase_rad

    np.testing.assert_array_equal(phase((12.0, 30.0)), phase(None), "an estimate in the range stands")
    np.testing.assert_array_equal(phase((25.0, 36.0)), phase(30.0), "one outside gives way to the geometric mean")


def test_a_small_object_with_other_fringe_numbers_is_refused() -> None:
    scene = isolated(110, 0.02, 11)
    for numbers in ((36.0, 35.0, 30.0), (13.0, 12.0, 10.0), (12.0, 11.0, 10.0)):
        with pytest.raises(DecodeError, match="period_px"):
            scenes.shape_of(replace(scene, fringe_numbers=numbers), response="linear")
