"""Coloured prints under 3 % noise: what the albedo leaves of the phase, and whether it is owned up to."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import scoring

import quadfringe as qf

sys.path.append(str(scoring.ROOT / "benches"))
import accuracy

SEED = 1


# Greatest error (root mean square of all returned pixels), its median, and the least share of errors inside one, two
# and three standard deviations. Sharp prints are above the 0.03 rad that the others keep: beside their edges a window
# sees several colours, and a colour that changes within half a fringe looks like a phase to R and B.
@pytest.mark.parametrize(
    ("name", "rms_rad", "median_rad", "shares"),
    [
        ("white", 0.006, 0.004, (0.68, 0.93, 0.98)),
        ("shades", 0.03, 0.0105, (0.38, 0.64, 0.79)),
        ("patches", 0.03, 0.012, (0.90, 0.96, 0.98)),
        ("printed", 0.06, 0.0225, (0.82, 0.94, 0.97)),
    ],
)
def test_colours_leave_the_phase_alone(
    name: str, rms_rad: float, median_rad: float, shares: tuple[float, float, float]
) -> None:
    shot, truth_rad = getattr(accuracy, name)(SEED)
    shape = qf.decode(shot, qf.Plan(projector_width_px=accuracy.WIDTH_PX))
    border = int(np.ceil(accuracy.WIDTH_PX / accuracy.FRINGES[0]))
    inner = np.s_[border:-border, border:-border]
    error_rad = accuracy.inside(shape.phase_rad - truth_rad, border)[inner].astype(np.float64)
    sigma_rad = shape.uncertainty_rad[inner]
    returned = np.isfinite(error_rad)
    assert returned.mean() > 0.97
    error_rad, sigma_rad = np.abs(error_rad[returned]), sigma_rad[returned]
    assert scoring.rms(error_rad) < rms_rad
    assert np.median(error_rad) < median_rad
    for times, share in zip((1, 2, 3), shares, strict=True):
        assert np.mean(error_rad <= times * sigma_rad) > share, times
