"""The albedo of a scene of the virtual bench, and how far a decoded one is from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.evaluation.world import scenes

__all__ = ["AlbedoFigures", "judge_albedo", "true_albedo"]

Map = NDArray[np.float64]
LEVEL, AMPLITUDE = 0.555, 0.5  # of the light of the bench on albedo 1: half of the projected light, and the room light
QUARTER_AHEAD = (0.0, 0.0, np.pi / 2, 0.0)  # phase of R, G, B, IR at column 0, rad


@dataclass(frozen=True)
class AlbedoFigures:
    """Errors of an albedo over the pixels that have one, the mean of the channels R, G, B, IR.

    rms_percent: root mean square of the error, relative to the mean albedo of the channel.
    fringe_percent: amplitude of what is left of the fringes, relative to the albedo.
    noise_percent: noise of a pixel, relative to the mean light. Where the albedo changes from pixel to pixel,
    an estimate from one exposure can have little less.
    """

    rms_percent: float
    fringe_percent: float
    noise_percent: float


def true_albedo(name: str, seed: int) -> Map:
    """Give the light without fringes of a scene, (H, W, 4), from its image without noise and its true columns.

    The unit is the albedo of a surface, as in the scenes. NaN in the shadow of a projector.
    """
    bench = _core.Bench()
    world = scenes.SCENES[name](bench, np.random.default_rng([seed, 77]))
    options = {"albedo": world.albedo} if world.albedo is not None else {}
    images = bench.render(
        world.cast, world.fringe_numbers, noise=0.0, bit_depth=16, **(options | (world.options or {}))
    )
    waves = np.cos(_phases(world.cast.column_px().astype(np.float64), world.fringe_numbers, bench.visible.width))
    light = np.stack([images[channel] for channel in ("red", "green", "blue", "ir")], axis=2) / 65535
    lit = np.isfinite(waves[..., 0]) & ~world.cast.shadow()
    albedo: Map = np.where(lit[..., None], light / (LEVEL + AMPLITUDE * waves), np.nan)
    return albedo


def judge_albedo(albedo: NDArray[np.float32], taken: scenes.Take, truth: Map) -> AlbedoFigures:
    """Compare an albedo (H, W, 4) with that of the scene, at pixels that do not mix two sides of an edge of depth."""
    known = np.isfinite(albedo[..., 0]) & np.isfinite(truth[..., 0]) & taken.counted
    found, true = albedo[known] / LEVEL, truth[known]
    rms = np.sqrt(np.mean((found - true) ** 2, axis=0)) / true.mean(axis=0)
    column_px = taken.phase_rad[known] * scenes.WIDTH_PX / (2 * np.pi * taken.fringe_numbers[0])
    phases = _phases(column_px, taken.fringe_numbers, scenes.WIDTH_PX)
    relative = (found - true) / true.mean(axis=0)
    fringes = 2 * np.abs(np.mean(relative * np.exp(1j * phases), axis=0))
    noise = scenes.NOISE / (LEVEL * true.mean(axis=0))
    return AlbedoFigures(*(100 * float(share.mean()) for share in (rms, fringes, noise)))


def _phases(column_px: Map, numbers: tuple[float, ...], width_px: int) -> Map:
    """Give the phases of R, G, B, IR at these columns, rad."""
    first, second, third = numbers
    turns = column_px[..., None] / width_px * np.array([first, second, first, third])
    phases: Map = 2 * np.pi * turns + QUARTER_AHEAD
    return phases
