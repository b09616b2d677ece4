"""The standard error of a response that is estimated from one shot, and light that stays linear."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe import _core
from quadfringe.config import Device
from quadfringe.data import core_device
from quadfringe.evaluation.response_shots import Estimate, estimates

# `python evaluation/response_sd.py` has more scenes, gammas and seeds.
SCENES = ("photographs_face",)


@cache
def found(gamma: float) -> tuple[Estimate, ...]:
    return tuple(estimates(SCENES, (gamma,), (5,)))


def test_the_error_of_the_exponent_is_as_stated() -> None:
    ratios = [abs(one.error) / one.sd for one in found(2.0)]
    hold("response.error_over_sd", ratios)
    assert len(ratios) == len(SCENES)


def test_the_second_harmonic_shrinks_and_keeps_its_sign_or_vanishes() -> None:
    for one in found(2.0):
        assert abs(one.left) < abs(one.before)
    hold("response.second_harmonic_left", np.abs([one.left for one in found(2.0)]))


def test_linear_light_on_photographs_stays_linear() -> None:
    """With texture this strong one channel alone shows an exponent of 0.91, seven standard errors from 1."""
    assert [one.response for one in estimates(SCENES, (1.0,), (1,))] == [None]


@pytest.mark.parametrize("side_px", [2, 4])
def test_linear_light_on_random_blocks_stays_linear(side_px: int) -> None:
    """Dark blocks at the crests of fringes are no data. The means of the other pixels show exponents of 0.8."""
    camera = Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))
    bench = _core.Bench(camera=core_device(camera))
    cells = 0.2 + 0.8 * np.random.default_rng(5).random((192 // side_px, 256 // side_px, 4))
    albedo = cells.repeat(side_px, 0).repeat(side_px, 1).astype(np.float32)
    numbers = (18.0, 17.0, 15.0)
    images = bench.render(bench.cast("face"), numbers, noise=0.01, seed=5, albedo=albedo)
    shot = qf.Shot(images["red"], images["green"], images["blue"], images["ir"])
    assert qf.estimate_response(shot, qf.Plan(912, fringes=numbers)) == "linear"
