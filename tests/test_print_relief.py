"""Print looks like relief in phase-shifted images, by the equation of `evaluation/print_relief.py`."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from support.bars import hold

from quadfringe.evaluation._print_relief import bent, fitted

STEPS = 12


@pytest.mark.parametrize("spot_px", [0.8, 1.2])
def test_the_spot_of_a_pixel_is_found_from_the_relief_of_print(spot_px: float) -> None:
    y, x = np.mgrid[:120, :160].astype(np.float64)
    albedo = 0.6 + 0.3 * np.sin(x / 4.0) * np.cos(y / 5.0)
    phase = 2 * np.pi * x / 25.0 + 0.1 * y
    angles = 2 * np.pi * np.arange(STEPS) / STEPS
    images = [cv2.GaussianBlur(albedo * (1 + np.cos(phase - angle)), (0, 0), spot_px) for angle in angles]
    wave = np.tensordot(np.exp(1j * angles), np.stack(images), 1)
    difference = np.angle(wave * np.exp(-1j * phase))
    inner = np.s_[10:-10, 10:-10]
    found = fitted(bent(np.abs(wave), phase)[0][inner], difference[inner])
    hold("print_relief.spot", found.spot_px / spot_px)
    hold("print_relief.explained_percent", 100 * found.explained)


def test_a_relief_of_the_other_sign_is_not_explained() -> None:
    bend = np.linspace(-1.0, 1.0, 100)
    found = fitted(bend, -0.1 * bend)
    assert (found.spot_px, found.explained) == (0.0, 0.0)
