"""The truth of the captures, and of the shots that are made of them."""

from pathlib import Path

import cv2
import numpy as np

from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation._variants import ROTATION_DEG, VARIANTS, stepped
from quadfringe.evaluation.scoring import Scene


def ramp(jump_rad: float = 0.0) -> Scene:
    """Give a scene whose true phase rises along the rows, and jumps in the middle."""
    columns = np.mgrid[:120.0, :160.0][1]
    phase_rad = 0.3 * columns + jump_rad * (columns > 80)
    light = np.zeros(phase_rad.shape, np.uint8)
    everywhere = np.ones(phase_rad.shape, np.bool_)
    sd_rad = np.full(phase_rad.shape, 0.01)
    return Scene("ramp", *[light] * 4, (36.0, 35.0, 30.0), 912, phase_rad, everywhere, phase_sd_rad=sd_rad)


def test_the_truth_of_an_inclined_shot_lies_between_pixels() -> None:
    inclined = VARIANTS["inclined"](ramp(), 0)
    turn = cv2.invertAffineTransform(cv2.getRotationMatrix2D((80, 60), ROTATION_DEG, 1.0))
    rows, columns = np.mgrid[:120.0, :160.0]
    from_column = turn[0, 0] * columns + turn[0, 1] * rows + turn[0, 2]
    inner = cv2.erode(inclined.scored.astype(np.uint8), np.ones((5, 5))) > 0
    # The nearest pixel lies up to 0.7 px away, 0.2 rad; OpenCV rounds places to 1/32 px.
    np.testing.assert_allclose(inclined.phase_rad[inner], 0.3 * from_column[inner], atol=0.01)
    assert inclined.phase_sd_rad is not None
    np.testing.assert_allclose(inclined.phase_sd_rad[inner], 0.01 * 2 / 3)


def test_the_truth_of_an_inclined_shot_is_not_mixed_at_a_step() -> None:
    smooth, step = (VARIANTS["inclined"](ramp(jump_rad), 0) for jump_rad in (0.0, 9.0))
    change_rad = (step.phase_rad - smooth.phase_rad)[step.scored]
    np.testing.assert_allclose(np.minimum(np.abs(change_rad), np.abs(change_rad - 9)), 0, atol=0.3)


def test_a_binned_truth_has_half_the_noise() -> None:
    binned = VARIANTS["binned"](ramp(), 0)
    assert binned.phase_sd_rad is not None
    np.testing.assert_allclose(binned.phase_sd_rad, 0.005)


def test_the_truth_of_captures_has_a_hundredth_of_a_radian_of_noise(data_dir: Path) -> None:
    for name in scenes.CAPTURES:
        scene = stepped(data_dir, name, 0)
        assert scene.phase_sd_rad is not None
        np.testing.assert_allclose(np.median(scene.phase_sd_rad[scene.scored]), 0.012, rtol=0.2)
