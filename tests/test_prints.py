"""Textured surfaces under 3 % noise: the phase error that the albedo leaves, and its stated uncertainty."""

from __future__ import annotations

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.evaluation import scoring
from quadfringe.evaluation._textures import TEXTURES
from quadfringe.evaluation.reproduce import WIDTH_PX, inside

SEED = 1
SD_OVER_MEDIAN = 1.4826  # standard deviation of a normal distribution over the median of its absolute values


@pytest.mark.parametrize("name", TEXTURES)
def test_textures_leave_the_phase_alone(name: str) -> None:
    shot, truth_rad = TEXTURES[name](SEED)
    shape = qf.decode(shot, qf.Plan(projector_width_px=WIDTH_PX))
    assert shape.uncertainty_rad is not None
    border = int(np.ceil(WIDTH_PX / qf.Fringes().numbers[0]))
    inner = np.s_[border:-border, border:-border]
    error_rad = inside(shape.phase_rad - truth_rad, border)[inner].astype(np.float64)
    returned = np.isfinite(error_rad)
    hold("textures.returned", returned.mean())
    error_rad, sd_rad = np.abs(error_rad[returned]), shape.uncertainty_rad[inner][returned]
    hold(f"textures.{name}_rms_rad", scoring.rms(error_rad))
    hold(f"textures.{name}_median_rad", np.median(error_rad))
    for times in (1, 2, 3):
        hold(f"textures.{name}_inside_{times}sd", np.mean(error_rad <= times * sd_rad))
    hold(f"textures.{name}_stated_over_actual", np.median(sd_rad) / (SD_OVER_MEDIAN * np.median(error_rad)))
