"""The detail that a method keeps: heights of waves by their period, and the width of an edge.

A wide window lowers the noise and removes detail, so that noise alone says little about a method.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.data import Shape
from quadfringe.evaluation.world import relief
from quadfringe.evaluation.world.scenes import NOISE, Take, World, expose

PERIODS_PX = (4, 6, 8, 12, 16, 26, 39, 64, 100)
AMPLITUDE_MM = 0.2
STEP_MM, TILT_RAD = 5.0, 0.06
EDGE_REACH_PX, BIN_PX = 12.0, 0.25

Decode = Callable[[Take], Shape]
Values = NDArray[np.float64]


def pixel_mm(bench: _core.Bench) -> float:
    """Give the side of a camera pixel on the plane of the reliefs."""
    return relief.PLANE_Z_MM / bench.camera.focal_px[0]


def height_ratios(decode: Decode, along: str, seed: int, noise: float = NOISE) -> dict[int, float]:
    """Give the share of the height that waves along "x" or "y" keep, by their period in camera pixels."""
    bench = _core.Bench()
    random = np.random.default_rng([seed, 78])
    found = {}
    for period_px in PERIODS_PX:
        period_mm, start = period_px * pixel_mm(bench), random.uniform(0, 2 * np.pi)
        cast = relief.waves(period_mm, AMPLITUDE_MM, along, start).cast(bench)
        taken = expose(bench, World(cast), seed, noise)
        shape = decode(taken)
        place_mm = cast.xyz_mm()[..., 0 if along == "x" else 1].astype(np.float64)
        found[period_px] = _left(shape, taken, 2 * np.pi * place_mm / period_mm + start)
    return found


def _left(shape: Shape, taken: Take, turn_rad: Values) -> float:
    """Fit the wave to the negative depths, because heights point to the camera."""
    assert shape.xyz_mm is not None
    used = shape.returned & taken.counted & (np.abs(shape.phase_rad - taken.phase_rad) < np.pi)
    used[:, :64] = used[:, -64:] = used[:64] = used[-64:] = False
    waves = np.stack([np.ones(used.sum()), np.sin(turn_rad[used]), np.cos(turn_rad[used])], axis=1)
    _, height_mm, _ = np.linalg.lstsq(waves, -shape.xyz_mm[..., 2][used].astype(np.float64), rcond=None)[0]
    return float(height_mm / AMPLITUDE_MM)


def half_height_period_px(ratios: dict[int, float]) -> float:
    """Give the shortest period, px, from which on at least half of the height is left; NaN when there is none."""
    periods, left = np.array(sorted(ratios)), np.array([ratios[p] for p in sorted(ratios)])
    low = np.flatnonzero(left < 0.5)
    if not low.size:
        return float(periods[0])
    at = low[-1]
    if at + 1 == len(periods):
        return float("nan")
    return float(np.interp(0.5, left[at : at + 2], periods[at : at + 2]))


def edge_width_px(decode: Decode, seed: int, noise: float = NOISE) -> float:
    """Give the distance over which a step of 5 mm rises from 10 to 90 %, camera pixels across the edge.

    The edge is nearly along the rows, where neither camera nor projector hides a part of it.
    """
    bench = _core.Bench()
    cast = relief.step(STEP_MM, TILT_RAD).cast(bench)
    taken = expose(bench, World(cast), seed, noise)
    shape = decode(taken)
    assert shape.xyz_mm is not None
    points_mm = cast.xyz_mm().astype(np.float64)
    away_px = (points_mm[..., 1] * np.cos(TILT_RAD) - points_mm[..., 0] * np.sin(TILT_RAD)) / pixel_mm(bench)
    used = shape.returned & taken.lit & (np.abs(shape.phase_rad - taken.phase_rad) < np.pi)
    used &= np.abs(away_px) < EDGE_REACH_PX
    used[:, :64] = used[:, -64:] = False
    bins = np.floor((away_px[used] + EDGE_REACH_PX) / BIN_PX).astype(int)
    raised = (relief.PLANE_Z_MM - shape.xyz_mm[..., 2][used]) / STEP_MM
    size = int(2 * EDGE_REACH_PX / BIN_PX)
    profile = np.bincount(bins, raised, size) / np.maximum(np.bincount(bins, minlength=size), 1)
    last_low, first_high = np.flatnonzero(profile < 0.1), np.flatnonzero(profile > 0.9)
    return float((first_high[0] - last_low[-1]) * BIN_PX) if last_low.size and first_high.size else float("nan")
