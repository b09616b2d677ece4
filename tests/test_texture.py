"""Surfaces whose albedo changes within a fringe: squares, letters and bars, photographs, folds."""

from __future__ import annotations

import pytest
from support.bars import hold
from support.scenes import figures_of

from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._isolated import isolated, tinted

TINT = 0.1


@pytest.mark.parametrize(
    ("period_px", "surface", "seed", "fringes"),
    [(33, "face", 11, 1), (33, "face", 11, 2), (50, "steps", 13, 1), (50, "steps", 13, 2), (74, "peaks", 14, 2)],
)
def test_squares_of_a_fringe_keep_their_orders(period_px: int, surface: str, seed: int, fringes: int) -> None:
    albedo = tinted(fringes * period_px, seed, TINT)
    scene = isolated(period_px, 0.4, seed, surface=surface, albedo=albedo)
    score = scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    hold("texture.squares_right_percent", score.right_percent)
    hold("texture.squares_right_of_returned_percent", score.right_of_returned_percent)


@pytest.mark.parametrize("seed", [2, 4])
def test_photographs_bend_a_surface_little(seed: int) -> None:
    hold("texture.photographs_rms_mm", figures_of("photographs_peaks", seed).rms_mm)


@pytest.mark.parametrize("seed", [2, 4])
def test_folds_and_hair_are_returned(seed: int) -> None:
    hold("texture.cloth_returned_percent", figures_of("cloth", seed).returned_percent)


@pytest.mark.parametrize("seed", [2, 4])
def test_bars_and_letters_are_returned(seed: int) -> None:
    hold("texture.painted_face_returned_percent", figures_of("painted_face", seed).returned_percent)
