"""The standard error of a response that is estimated from one shot, and light that stays linear."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support.bars import hold

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


@pytest.mark.parametrize("scene", ["blocks_4", "blocks_8"])
def test_linear_light_on_random_blocks_stays_linear(scene: str) -> None:
    """Dark blocks at crests of fringes are no data; means of the others show exponents of 0.74 to 0.82."""
    (one,) = estimates((scene,), (1.0,), (2,))
    exponents = np.ones(4) if one.response is None else np.array([row[1] for row in one.response.rows])
    hold("response.linear_blocks_exponent_error", np.abs(exponents - 1))


def test_a_response_shows_through_random_blocks() -> None:
    (one,) = estimates(("blocks_8",), (1.8,), (2,))
    hold("response.blocks_error_over_sd", abs(one.error) / one.sd)
