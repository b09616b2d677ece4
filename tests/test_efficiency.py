"""The measure of efficiency, on estimators whose efficiency is known from theory."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage
from support.bars import hold, tolerance

from quadfringe.evaluation import efficiency as measure

RATIOS = (1.0, 35 / 36, 1.0, 30 / 36)
ROWS, COLUMNS = 400, 500
PHASE_RAD = np.broadcast_to(20.0 + 2 * np.pi * np.arange(COLUMNS) / 25.6, (ROWS, COLUMNS)).copy()
INNER = np.zeros((ROWS, COLUMNS), bool)
INNER[10:-10, 10:-10] = True
INFORMATION_OF_ALL = 1 + (35 / 36) ** 2 / 2 + (30 / 36) ** 2 / 2  # against red and blue alone
BOX_PX = 5


def least_squares(images: measure.Images, size_px: int) -> NDArray[np.float64]:
    """One Gauss-Newton step from the truth in a square window: the optimum for this window."""
    slopes = [
        -measure.MODULATION * k * np.sin(k * PHASE_RAD + s) for k, s in zip(RATIOS, measure.SHIFTS_RAD, strict=True)
    ]
    ideal = [
        measure.BACKGROUND + measure.MODULATION * np.cos(k * PHASE_RAD + s)
        for k, s in zip(RATIOS, measure.SHIFTS_RAD, strict=True)
    ]
    pull = sum(slope * (image - light) for slope, image, light in zip(slopes, images, ideal, strict=True))
    weight = sum(slope**2 for slope in slopes)
    return PHASE_RAD + ndimage.uniform_filter(pull, size_px) / ndimage.uniform_filter(weight, size_px)


def two_step(images: measure.Images) -> NDArray[np.float64]:
    """Red and blue alone, in a square window, their background known."""
    cosine, sine = images[0] - measure.BACKGROUND, measure.BACKGROUND - images[2]
    error_rad = np.angle((cosine + 1j * sine) * np.exp(-1j * PHASE_RAD))
    return PHASE_RAD + ndimage.uniform_filter(error_rad, BOX_PX)


def measured(estimate: measure.Estimator) -> measure.Efficiency:
    return measure.efficiency(estimate, PHASE_RAD, INNER, RATIOS, seeds=8, reach_px=6)


@pytest.mark.parametrize("size_px", [BOX_PX, 9])
def test_the_optimum_has_the_variance_of_the_bound(size_px: int) -> None:
    found = measured(lambda images: least_squares(images, size_px))
    assert found.variance_over_bound == pytest.approx(1, abs=tolerance("efficiency.variance_over_bound"))
    assert found.pixels_per_value == pytest.approx(size_px**2, rel=tolerance("efficiency.pixels_per_value"))
    assert found.response_sum == pytest.approx(1, abs=tolerance("efficiency.response_sum"))
    hold("efficiency.bias_rms_rad", found.bias_rms_rad)


def test_two_channels_of_four_are_told_from_the_optimum() -> None:
    found = measured(two_step)
    assert found.variance_over_bound == pytest.approx(
        INFORMATION_OF_ALL, rel=tolerance("efficiency.variance_over_bound")
    )
    assert found.pixels_per_value == pytest.approx(BOX_PX**2, rel=tolerance("efficiency.pixels_per_value"))


def test_smoothing_does_not_buy_efficiency() -> None:
    once = measured(two_step)
    twice = measured(lambda images: PHASE_RAD + ndimage.uniform_filter(two_step(images) - PHASE_RAD, BOX_PX))
    hold("efficiency.smoothed_variance", twice.variance_rad2 / once.variance_rad2)
    assert twice.variance_over_bound == pytest.approx(
        once.variance_over_bound, rel=tolerance("efficiency.smoothed_over_bound")
    )


def test_a_phase_that_ignores_the_images_is_refused() -> None:
    with pytest.raises(ValueError, match="follows the phase"):
        measured(lambda images: PHASE_RAD + 0 * images[0])
