"""Coloured prints under 3 % noise: what the albedo leaves of the phase, and whether it is owned up to."""

from __future__ import annotations

import numpy as np
import pytest

import quadfringe as qf
from quadfringe.evaluation import scoring
from quadfringe.evaluation._textures import TEXTURES
from quadfringe.evaluation.reproduce import WIDTH_PX, inside

SEED = 1


# Greatest error (root mean square of all returned pixels), its median, and the least share of errors inside one, two
# and three standard deviations.
@pytest.mark.parametrize(
    ("name", "rms_rad", "median_rad", "shares"),
    [
        ("white", 0.005, 0.0035, (0.73, 0.95, 0.99)),
        ("shades", 0.0135, 0.0075, (0.53, 0.80, 0.91)),
        ("patches", 0.015, 0.0075, (0.96, 0.99, 0.99)),
        ("printed", 0.027, 0.0125, (0.94, 0.98, 0.99)),
    ],
)
def test_colours_leave_the_phase_alone(
    name: str, rms_rad: float, median_rad: float, shares: tuple[float, float, float]
) -> None:
    shot, truth_rad = TEXTURES[name](SEED)
    shape = qf.decode(shot, qf.Plan(projector_width_px=WIDTH_PX))
    border = int(np.ceil(WIDTH_PX / qf.Fringes().numbers[0]))
    inner = np.s_[border:-border, border:-border]
    error_rad = inside(shape.phase_rad - truth_rad, border)[inner].astype(np.float64)
    sigma_rad = shape.uncertainty_rad[inner]
    returned = np.isfinite(error_rad)
    assert returned.mean() > 0.97
    error_rad, sigma_rad = np.abs(error_rad[returned]), sigma_rad[returned]
    assert scoring.rms(error_rad) < rms_rad
    assert np.median(error_rad) < median_rad
    for times, share in zip((1, 2, 3), shares, strict=True):
        assert np.mean(error_rad <= times * sigma_rad) > share, times
