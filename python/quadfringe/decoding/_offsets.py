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

__all__ = ["channels_agree", "fitted_rad", "shared_brightness"]

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
# Share of the squares left by one albedo that the shared brightness may leave, to be taken. A larger share lets a wrong
# response, of which red and blue make a brightness, move the fringes of others: with 1 a sound shot is refused (`pytest
# tests/test_doctor_board.py -k response`). A smaller one takes texture for offsets. Other shares were not tried.
SHARED_LEFT_MAX = 0.5
# Least albedo of red over that of blue, and least square of their light of brightness 1: they keep quotients finite.
RATIO_MIN, LIGHT_MIN = 1e-3, 1e-3


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
        brightness = shared_brightness(red, blue, phase_rad) if plan.fringes.quadrature else None
        for i, (image, wave_rad) in enumerate(channels):
            found_rad[i] = fitted_rad(image[tile][pixels][None], wave_rad[tile][pixels][None], brightness)[0]
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


def shared_brightness(red: NDArray[Any], blue: NDArray[Any], phase_rad: NDArray[Any]) -> NDArray[np.float32]:
    """Give the brightness of the pixels of tiles, (T, N): the albedo that all channels have in common, up to a factor.

    With red = b (1 + m cos t) and blue = g b (1 - n sin t) at the phase t, the brightness b drops out of
    g red (1 - n sin t) = blue (1 + m cos t). Least squares give 1 / g, m / g and n; then b follows from both channels.
    """
    known = np.isfinite(red) & np.isfinite(blue) & np.isfinite(phase_rad)
    red, blue, phase_rad = (np.where(known, values, np.float32(0)) for values in (red, blue, phase_rad))
    cosine, sine = np.cos(phase_rad), np.sin(phase_rad)
    found = _least_squares(np.stack([blue, blue * cosine, red * sine], axis=1), red)
    ratio, of_red, of_blue = found.astype(np.float32).T[:, :, np.newaxis]
    ratio = np.maximum(ratio, RATIO_MIN)
    light_red = 1 + np.clip(of_red / ratio, 0, 1) * cosine
    light_blue = (1 - np.clip(of_blue, 0, 1) * sine) / ratio
    brightness: NDArray[np.float32] = (red * light_red + blue * light_blue) / (light_red**2 + light_blue**2 + LIGHT_MIN)
    return brightness


def fitted_rad(
    light: NDArray[Any], phase_rad: NDArray[Any], brightness: NDArray[Any] | None = None
) -> NDArray[np.float64]:
    """Give the angle by which fringes lie off their phase, by least squares, (T,) rad, for the pixels of tiles, (T, N).

    A tile has one albedo, or that of `brightness`, (T, N), up to a factor, whichever explains its light better. A pixel
    that is NaN in light or phase does not count; a tile without any gives 0.
    """
    alone_rad, residual = _fit(light, phase_rad, None)
    if brightness is None:
        return alone_rad
    shared_rad, left = _fit(light, phase_rad, brightness)
    return np.where(left < SHARED_LEFT_MAX * residual, shared_rad, alone_rad)


def _fit(
    light: NDArray[Any], phase_rad: NDArray[Any], brightness: NDArray[Any] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fit offset and fringes to the light of tiles; give the angle off the phase and the sum of the squares left."""
    known = np.isfinite(light) & np.isfinite(phase_rad)
    waves = np.stack([np.ones_like(phase_rad), np.cos(phase_rad), -np.sin(phase_rad)], axis=1)
    waves = np.where(known[:, np.newaxis], waves, np.float32(0))
    if brightness is not None:
        waves *= brightness[:, np.newaxis]
    light = np.where(known, light, np.float32(0))
    found = _least_squares(waves, light)
    left = light - (found.astype(np.float32)[:, np.newaxis] @ waves)[:, 0]
    _, cosine, sine = found.T
    return np.arctan2(sine, cosine), np.sum(left**2, axis=1, dtype=np.float64)


def _least_squares(terms: NDArray[Any], light: NDArray[Any]) -> NDArray[np.float64]:
    """Give the factors of terms, (T, K, N), whose sum comes nearest to the light, (T, N); 0 without any light."""
    matrix = (terms @ terms.swapaxes(1, 2)).astype(np.float64) + 1e-6 * np.eye(terms.shape[1])
    found: NDArray[np.float64] = np.linalg.solve(matrix, (terms @ light[:, :, np.newaxis]).astype(np.float64))[:, :, 0]
    return found
