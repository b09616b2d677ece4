"""Fringe numbers are proposed only if both ratios of the channels agree with them; small objects are named rightly."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support.halves import changed, half_plan, half_shot

import quadfringe as qf
from quadfringe.decoding import closure_params
from quadfringe.decoding.closures import closure_of_waves
from quadfringe.evaluation import broken


def told(shot: qf.Shot) -> tuple[str, str]:
    """Give the name of the cause of a refusal and its words."""
    with pytest.raises(qf.DecodeError) as refused:
        qf.decode(shot, half_plan())
    return refused.value.reason, str(refused.value)


@pytest.mark.parametrize(("scene", "seed"), [("coin", 7), ("glossy_face", 21), ("sphere", 22)])
def test_ratios_that_no_numbers_fit_are_told_without_numbers(scene: str, seed: int) -> None:
    """36, 35, 31 have the ratio of infrared of about 49, 48, 42, and another one of green."""
    name, words = told(half_shot(scene, seed, (36.0, 35.0, 31.0)))
    assert name == "fringe numbers"
    assert re.search(r"it has 35\.0\d \+/- 0\.0\d of green and 3[01]\.\d+ \+/- 0\.0\d of infrared", words)
    assert "which fits" not in words


@pytest.mark.parametrize("seed", [9, 23])
def test_numbers_with_other_differences_are_called_no_others(seed: int) -> None:
    """40, 39, 33 have the ratios 35.1 and 29.7 to 36."""
    name, words = told(half_shot("face", seed, (40.0, 39.0, 33.0)))
    assert name == "fringe numbers"
    fits = re.search(r"which fits ([\d, ]+)", words)
    assert fits[1] == "40, 39, 33" if fits else re.search(r"it has 35\.1\d .* and 29\.7\d", words)


@pytest.mark.parametrize(("numbers", "seed"), [((37.0, 36.0, 31.0), 8), ((35.0, 34.0, 29.0), 14)])
def test_numbers_with_the_same_differences_are_named_on_narrow_objects(numbers: tuple[float, ...], seed: int) -> None:
    name, words = told(half_shot("clutter", seed, numbers))
    assert name == "fringe numbers"
    assert f"which fits {', '.join(f'{one:g}' for one in numbers)}" in words


@pytest.mark.parametrize("pair", [("red", "green"), ("green", "ir")])
@pytest.mark.parametrize(("scene", "share", "seed"), [("face", 0.06, 31), ("sphere", 0.08, 32)])
def test_exchanged_channels_of_a_small_object_are_named(
    pair: tuple[str, str], scene: str, share: float, seed: int
) -> None:
    shot = changed(broken.cut_out(half_shot(scene, seed), share, seed), broken.exchanged(*pair))
    name, words = told(shot)
    assert name == "fringe orders"
    assert f"{pair[0]} and {pair[1]} seem to be swapped" in words


@pytest.mark.parametrize(("scene", "share", "seed"), [("face", 0.06, 31), ("sphere", 0.08, 33)])
def test_other_numbers_of_a_small_object_are_named(scene: str, share: float, seed: int) -> None:
    name, words = told(broken.cut_out(half_shot(scene, seed, (25.0, 24.0, 20.0)), share, seed))
    assert name == "fringe numbers"
    assert "which fits 25, 24, 20" in words


@pytest.mark.parametrize("columns", [512, 256])
def test_the_error_of_a_ratio_is_that_of_repeated_shots(columns: int) -> None:
    """Phases with noise, smooth over a fringe: repeated shots scatter by what is stated, or by less of it.

    Noise that raises a frequency lowers the next one, so that squares scatter more than chance among them would.
    """
    import cv2

    found, stated = [], []
    turns = 2 * np.pi * np.arange(columns) / 20.0
    for seed in range(12):
        noise = np.random.default_rng(seed)
        rad = [np.float32(0.3) * noise.standard_normal((256, columns)).astype(np.float32) for _ in range(3)]
        rad = [cv2.GaussianBlur(one, (0, 0), sigmaX=8, sigmaY=3) * 8 for one in rad]
        shares = zip((1.0, 35 / 36, 30 / 36), rad, strict=True)
        waves = [np.exp(1j * (share * turns + one)).astype(np.complex128) for share, one in shares]
        closure = closure_of_waves(waves, half_plan())
        assert closure is not None
        found.append((closure.green, closure.infrared))
        stated.append(closure.errors)
    ratio = np.median(stated, axis=0) / np.std(found, axis=0, ddof=1)
    print(columns, ratio)
    assert np.all((ratio > 0.8) & (ratio < 3))


def test_few_fringes_have_no_error() -> None:
    waves = [np.exp(2j * np.pi * np.arange(60) / period) * np.ones((40, 1)) for period in (20.0, 20.6, 24.0)]
    closure = closure_of_waves(waves, half_plan())
    assert closure is not None
    assert closure_params.SQUARES_MIN > 1
    assert closure.errors == (np.inf, np.inf)
