"""Offsets of the G and IR fringes from the phase of a shape: other fringe numbers leave them, texture does not."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape
from quadfringe.decoding.fringe_fit import infrared_column
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["channels_agree", "fitted_rad"]

TILE_PX = 96  # side of a tile: a fringe or more, so that texture averages out
TILE_SHARE = 0.3  # least share of the pixels of a tile that are returned
TILES_MIN = 4
# A smaller object is cut into as many bands of rows, which cross all its fringes, each with this many pixels or more:
# those of a tile that is just full enough.
BAND_PIXELS_MIN = TILE_SHARE * TILE_PX**2
# Three quarters of the tiles are off by at most this. On coloured patches and photographs it is 0.1 rad in sound shots,
# and 0.2 rad or more with other fringe numbers. `pytest tests/test_real_objects.py` decodes both.
OFFSET_MAX_RAD = 0.12
QUANTILE = 0.75


def channels_agree(shape: Shape, shot: AnyShot, plan: Plan) -> bool:
    """Tell whether G and IR show their fringes where the phase of the shape puts them; False with too few tiles.

    B takes the place of IR if it has another fringe number than R.
    """
    light = linear_light_of(shot, plan)
    first, second, *third = plan.fringes.numbers
    channels = [(light["green"], second / first * shape.phase_rad)]
    if third and not plan.fringes.quadrature:
        channels.append((light["blue"], third[0] / first * shape.phase_rad))
    for number in third if plan.fringes.infrared else ():
        per_px = 2 * np.pi * number / plan.projector_width_px
        channels.append((light["ir"], (per_px * infrared_column(shape, plan)).astype(np.float32)))
    return all(_offset_rad(image, phase_rad) <= OFFSET_MAX_RAD for image, phase_rad in channels)


def _offset_rad(image: NDArray[Any], phase_rad: NDArray[Any]) -> float:
    """Give the quantile of the absolute offsets of the tiles; infinite with too few of them."""
    known = np.isfinite(phase_rad) & np.isfinite(image)
    rows, columns = (range(0, size - TILE_PX + 1, TILE_PX) for size in image.shape)
    tiles = [np.s_[y : y + TILE_PX, x : x + TILE_PX] for y in rows for x in columns]
    tiles = [tile for tile in tiles if known[tile].mean() >= TILE_SHARE]
    if len(tiles) < TILES_MIN:
        tiles = _bands(known)
    offsets = [fitted_rad(image[tile].reshape(1, -1), phase_rad[tile].reshape(1, -1)) for tile in tiles]
    return float(np.quantile(np.abs(offsets), QUANTILE)) if offsets else np.inf


def _bands(known: NDArray[np.bool_]) -> list[tuple[slice, slice]]:
    """Cut a small object into bands of rows with as many pixels each; none if it has too few."""
    below = np.cumsum(known.sum(axis=1))
    if below[-1] < TILES_MIN * BAND_PIXELS_MIN:
        return []
    ends = [0, *np.searchsorted(below, below[-1] * np.arange(1, TILES_MIN) / TILES_MIN), len(below)]
    return [np.s_[first:end, :] for first, end in pairwise(ends)]


def fitted_rad(light: NDArray[Any], phase_rad: NDArray[Any]) -> NDArray[np.float64]:
    """Give the angle by which fringes lie off their phase, by least squares, (T,) rad, for the pixels of tiles, (T, N).

    A pixel that is NaN in light or phase does not count; a tile without any gives 0.
    """
    known = np.isfinite(light) & np.isfinite(phase_rad)
    waves = np.stack([np.ones_like(phase_rad), np.cos(phase_rad), -np.sin(phase_rad)], axis=1)
    waves = np.where(known[:, np.newaxis], waves, np.float32(0))
    matrix = (waves @ waves.swapaxes(1, 2)).astype(np.float64) + 1e-6 * np.eye(3)
    lit = np.where(known, light, np.float32(0))[:, :, np.newaxis]
    _, cosine, sine = np.linalg.solve(matrix, (waves @ lit).astype(np.float64))[:, :, 0].T
    return np.asarray(np.arctan2(sine, cosine))
