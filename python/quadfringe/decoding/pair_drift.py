"""Drift of the infrared fringes against the visible ones of a decoded shot, over tiles of the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import fit_params
from quadfringe.decoding.fringe_fit import Fit, Waves, expected_column, relative_waves, shown_waves
from quadfringe.decoding.plan import Plan

__all__ = ["Drift", "infrared_drift"]

Real = NDArray[np.float64]
Number = TypeVar("Number", float, Real)
# Checked by pytest tests/test_doctor.py on shots with known defects.
TILE_PX = 96  # side of a tile: several fringes, so that the offset of a tile averages the noise
TILE_SHARE = 0.3  # share of a tile that must carry fringes
TILES_MIN = 2
SHIFT_MAX = 6  # largest order error that is considered, fringes
# Of the tiles: a projector that has moved moves the fringes in all of them, while printed edges move single tiles. A
# larger quantile takes coloured squares for drift: 2.7 px in one tile of twenty, 0.2 px in three quarters of the tiles
# (`python evaluation/diagnosis.py`).
QUANTILE = 0.75


@dataclass(frozen=True)
class Drift:
    """Offset of the infrared fringes from their expected position, projector px, over tiles of the image.

    `off` is the share of tiles whose orders are all wrong by the same number of whole fringes.
    """

    median_px: float
    worst_px: float
    off: float


def infrared_drift(shot: AnyShot, shape: Shape, plan: Plan, fit: Fit | None = None) -> Drift | None:
    """Compare infrared fringes with the position that the calibration predicts; None without, or with too few tiles.

    Without an infrared projector in the calibration, both projectors count as coaxial. A large misalignment shifts
    every order by the same number of fringes, and the shape still looks plausible; the green fringes, which come from
    the projector of red and blue, then give that number, because their mean is good to a hundredth of a fringe.
    Crosstalk moves fringes as well: what `fit` is sure of is taken out before.
    """
    if not plan.fringes.infrared:
        return None
    seen = relative_waves(shot, shape, plan)
    periods = [plan.projector_width_px / number for number in plan.fringes.numbers]
    column = shape.column_px.astype(float)
    places = (column, column, expected_column(shape, plan))
    inside = seen.inside & np.isfinite(places[2])
    waves = _without_crosstalk(seen._replace(inside=inside), shape, plan, fit)
    tiles = _tiles(inside)
    if len(tiles) < TILES_MIN:
        return None
    offsets = np.array(
        [
            [
                _offset_px(wave[tile][inside[tile]], place[tile][inside[tile]], period)
                for wave, place, period in zip(waves, places, periods, strict=True)
            ]
            for tile in tiles
        ]
    )
    green_px = _wrapped(offsets[:, 1] - offsets[:, 0], periods[1])
    shift = _fringes_off(green_px, periods)
    off = np.mean([_nearest_shift(one, periods) == shift for one in green_px]) if shift else 0.0
    away = _wrapped(offsets[:, 2] - offsets[:, 0] - shift * periods[0], periods[2])
    around = np.abs(_with_neighbours(away, tiles, periods[2]))
    return Drift(float(np.median(away)), float(np.quantile(around, QUANTILE)), float(off))


def _with_neighbours(away_px: Real, tiles: list[tuple[slice, slice]], period: float) -> Real:
    """Return the mean offset of each tile and those next to it: print moves a tile, a moved projector all of them."""
    corners = np.array([(y.start, x.start) for y, x in tiles])
    near = np.abs(corners[:, None] - corners).max(axis=2) <= TILE_PX
    angle = np.angle(np.where(near, np.exp(2j * np.pi * away_px / period), 0).sum(axis=1))
    return np.asarray(angle * period / (2 * np.pi))


def _without_crosstalk(seen: Waves, shape: Shape, plan: Plan, fit: Fit | None) -> list[Real]:
    """Give the waves of red, green and infrared without the fringes of other channels that they surely contain."""
    waves = {name: seen.light[name] / np.maximum(seen.backgrounds[name], 1e-6) - 1.0 for name in plan.fringes.channels}
    if fit is not None:
        pixels = np.flatnonzero(seen.inside)
        shown, _ = shown_waves(shape, plan, pixels)
        sure = (fit.crosstalk_least > fit_params.SOUND) & ~np.eye(len(fit.names), dtype=bool)
        for i, name in enumerate(fit.names):
            if sure[i].any():
                stray = shown @ np.where(sure[i], fit.crosstalk[i], 0) * fit.contrast[i]
                waves[name].ravel()[pixels] -= stray.astype(waves[name].dtype)
    return [waves[name] for name in ("red", "green", "ir")]


def _tiles(inside: NDArray[np.bool_]) -> list[tuple[slice, slice]]:
    rows, columns = inside.shape
    tiles = [
        (slice(y, y + TILE_PX), slice(x, x + TILE_PX))
        for y in range(0, rows - TILE_PX + 1, TILE_PX)
        for x in range(0, columns - TILE_PX + 1, TILE_PX)
    ]
    return [tile for tile in tiles if inside[tile].mean() >= TILE_SHARE]


def _offset_px(wave: NDArray[np.floating], column: Real, period: float) -> float:
    """Return the offset of the fringes of a wave from their place, projector px, within half a period."""
    phase = 2 * np.pi * column / period
    design = np.stack([np.cos(phase), -np.sin(phase), np.ones_like(phase)], axis=1)
    cos, sin, _ = np.linalg.lstsq(design, wave, rcond=None)[0]
    return float(np.arctan2(sin, cos)) * period / (2 * np.pi)


def _fringes_off(green_px: Real, periods: list[float]) -> int:
    """Return the order error of red and blue, fringes, that the offsets of green show together, if they surely do.

    Print and crosstalk move the fringes of a tile by more than the hundredth that an order does, but to either side, so
    that the mean decides, and only if it surely lies beyond half an order.
    """
    from scipy.special import ndtr, stdtrit

    mean = np.exp(2j * np.pi * green_px / periods[1]).mean()
    mean_px = float(np.angle(mean)) * periods[1] / (2 * np.pi)
    around = _wrapped(green_px - mean_px, periods[1])
    count = len(green_px)
    error_px = np.sqrt((around**2).sum() / (count - 1) / count) * stdtrit(count - 1, ndtr(fit_params.SURE_SDS))
    sure = abs(mean_px) - error_px > 0.5 * abs(_wrapped(periods[0], periods[1]))
    return _nearest_shift(mean_px, periods) if sure else 0


def _nearest_shift(green_px: float, periods: list[float]) -> int:
    """Return the smallest order error of red and blue, fringes, that explains an offset of green."""
    shifts = sorted(range(-SHIFT_MAX, SHIFT_MAX + 1), key=abs)
    missed = [abs(_wrapped(green_px - shift * periods[0], periods[1])) for shift in shifts]
    close = min(missed) + 0.25 * abs(periods[0] - periods[1])
    return next(shift for shift, miss in zip(shifts, missed, strict=True) if miss <= close)


def _wrapped(offset_px: Number, period: float) -> Number:
    return (offset_px + period / 2) % period - period / 2
