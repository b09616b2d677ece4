"""Offsets of the G and IR fringes from the phase of a shape: other fringe numbers leave them, texture does not."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding.fringe_fit import infrared_column
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["channels_agree"]

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
    known = np.isfinite(shape.phase_rad)
    tiles = _tiles_of(known & np.logical_and.reduce([np.isfinite(image) for image in light.values()]))
    offsets_rad = np.zeros((len(tiles), len(channels)))
    for tile, found_rad in zip(tiles, offsets_rad, strict=True):
        pixels = known[tile]
        red, blue, phase_rad = (image[tile][pixels][None] for image in (light["red"], light["blue"], shape.phase_rad))
        brightness = _core.shared_brightness(red, blue, phase_rad) if plan.fringes.quadrature else None
        for i, (image, wave_rad) in enumerate(channels):
            known_light, known_rad = image[tile][pixels][None], wave_rad[tile][pixels][None]
            found_rad[i] = _core.fringe_offsets(known_light, known_rad, brightness)[0]
    quantiles_rad = np.quantile(np.abs(offsets_rad), QUANTILE, axis=0) if tiles else np.inf
    return bool(np.all(quantiles_rad <= OFFSET_MAX_RAD))


def _tiles_of(known: NDArray[np.bool_]) -> list[tuple[slice, slice]]:
    """Give the tiles with enough known pixels, or bands of a small object; none if it is too small for these."""
    rows, columns = (range(0, size - TILE_PX + 1, TILE_PX) for size in known.shape)
    tiles = [np.s_[y : y + TILE_PX, x : x + TILE_PX] for y in rows for x in columns]
    tiles = [tile for tile in tiles if known[tile].mean() >= TILE_SHARE]
    return tiles if len(tiles) >= TILES_MIN else _bands(known)


def _bands(known: NDArray[np.bool_]) -> list[tuple[slice, slice]]:
    """Cut a small object into bands of rows with as many pixels each; none if it has too few."""
    below = np.cumsum(known.sum(axis=1))
    if below[-1] < TILES_MIN * BAND_PIXELS_MIN:
        return []
    ends = [0, *np.searchsorted(below, below[-1] * np.arange(1, TILES_MIN) / TILES_MIN), len(below)]
    return [np.s_[first:end, :] for first, end in pairwise(ends)]
