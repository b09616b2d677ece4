"""Shots of the peaks surface, white and with coloured textures, under noise, with the true phase."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import spatial

from quadfringe.data import AnyShot, Shot
from quadfringe.evaluation._scenes import noisy_8bit
from quadfringe.evaluation.reproduce import peaks_shot

NOISE = 0.03  # standard deviation, share of full scale
CELLS, PRINT_SEED = 400, 5

Albedo = NDArray[np.float64]  # (H, W, 4)
Take = tuple[AnyShot, NDArray[Any]]  # a shot and its true phase, rad


def white(seed: int) -> Take:
    """Give the surface without texture."""
    return peaks_shot(noise=NOISE, seed=seed)


def patches(seed: int) -> Take:
    """Give coloured squares of 20 mm."""
    return peaks_shot(noise=NOISE, seed=seed, patch_mm=20.0)


def shades(seed: int) -> Take:
    """Give smooth shades, waves of 150 to 500 pixels that differ from channel to channel."""
    return printed_with(shades_of, seed)


def printed(seed: int) -> Take:
    """Give the shades times patches with sharp borders and random colours."""
    return printed_with(lambda shape: shades_of(shape) * patches_of(shape), seed)


def printed_with(albedo_of: Callable[[tuple[int, ...]], Albedo], seed: int) -> Take:
    """Print an albedo on the clean shot, then add noise and round to 8 bit."""
    clean, truth_rad = peaks_shot(noise=0.0, bit_depth=16)
    albedo = albedo_of(clean.red.shape)
    channels = [
        noisy_8bit(np.round(image * albedo[..., c]).astype(np.uint16), NOISE, 10 * seed + c)
        for c, image in enumerate(clean.channels.values())
    ]
    red, green, blue, ir = channels
    return Shot(red, green, blue, ir), truth_rad


def shades_of(shape: tuple[int, ...]) -> Albedo:
    """Give waves of 150 to 500 pixels in each channel, 0.6 to 1, (H, W, 4)."""
    random = np.random.default_rng(PRINT_SEED)
    y, x = np.mgrid[: shape[0], : shape[1]]
    found = np.empty((*shape, 4))
    for channel in range(4):
        along, across = random.uniform(2 * np.pi / 500, 2 * np.pi / 150, 2)
        found[..., channel] = 0.8 + 0.2 * np.cos(along * x + channel) * np.cos(across * y)
    return found


def patches_of(shape: tuple[int, ...]) -> Albedo:
    """Give cells of some 50 pixels around random points, each with a random colour, (H, W, 4)."""
    random = np.random.default_rng(PRINT_SEED)
    centres = random.uniform((0, 0), shape, (CELLS, 2))
    y, x = np.mgrid[: shape[0], : shape[1]]
    _, cell = spatial.KDTree(centres).query(np.stack([y, x], axis=-1))
    colours = random.uniform((0.3, 0.3, 0.3, 0.8), 1.0, (CELLS, 4))
    return np.asarray(colours[cell])


TEXTURES: dict[str, Callable[[int], Take]] = {
    "white": white,
    "patches": patches,
    "shades": shades,
    "printed": printed,
}
