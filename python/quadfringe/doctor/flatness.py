"""How flat a flat plate is measured: bow, noise, waves of the fringes, and pixels of wrong fringe orders."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.surfaces import fit_plane
from quadfringe.data import Shape, xyz_mm_of
from quadfringe.doctor._params import (
    HARMONICS,
    NORMAL,
    ORDER_SHARE,
    PIXELS_MIN,
    ROUNDS,
    TILE_PIXELS_MIN,
    TILE_PX,
    TILES_MIN,
)
from quadfringe.errors import InputError

__all__ = ["Flatness", "flatness_of", "robust_fit"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Flatness:
    """A flat plate as it was measured.

    bow_mm, bow_sd_mm: range of the quadratic part of the distances from the best plane over the field, and its
    standard deviation, from the disagreement of 32 x 32 px tiles with the quadratic surface.
    noise_mm, stated_mm: robust standard deviation of the points from the surface around them, and the one that the
    shape states, NaN if it states none.
    wave_rad, wave_harmonic: largest amplitude of the waves that follow the fringes, as phase, and its harmonic.
    size_mm: diagonal of the field. displaced: pixels (H, W) a quarter of a fringe or more from the surface, whose order
    is wrong; displaced_share: their share. pixels: those on the surface.
    """

    bow_mm: float
    bow_sd_mm: float
    noise_mm: float
    stated_mm: float
    wave_rad: float
    wave_harmonic: int
    size_mm: float
    displaced: Mask
    displaced_share: float
    pixels: int


def flatness_of(shape: Shape, within: Mask | None = None) -> Flatness:
    """Measure a flat plate in the points of a shape, within a mask (H, W); by default it fills most of the image.

    Raises `InputError` without a calibration, and for fewer than 2000 points.
    """
    xyz_mm = xyz_mm_of(shape).astype(np.float64)
    known = _known(xyz_mm, within)
    if (count := int(known.sum())) < PIXELS_MIN:
        raise InputError(f"flat plate: {count} points; at least {PIXELS_MIN} are needed; show more of it, well lit")
    per_rad_mm = _per_rad_mm(shape, known)
    displaced = known & (np.abs(xyz_mm[:, :, 2] - _start(xyz_mm, known)) > ORDER_SHARE * 2 * np.pi * per_rad_mm)
    kept = known & ~displaced
    plane = fit_plane(xyz_mm[kept])
    across = np.linalg.svd(plane.normal[None])[2][1:]  # two directions in the plane
    places = xyz_mm[kept] @ across.T
    low, high = places.min(axis=0), places.max(axis=0)
    terms = _quadratic(2 * (places - low) / (high - low) - 1)
    distance = plane.distances_mm(xyz_mm[kept])
    tiles = _tiles(kept, terms, distance)
    rest = distance - terms @ _form(tiles)
    waves = _waves(rest, shape.phase_rad[kept].astype(np.float64))
    worst = int(np.argmax(waves.amplitude_mm))
    # A tile holds about a fringe, so that waves of the fringes beat with the tiles, which would look like a bow.
    bow = _bow(tiles.measuring(distance - waves.distance_mm), terms)
    return Flatness(
        bow_mm=bow.range_mm,
        bow_sd_mm=bow.sd_mm,
        noise_mm=NORMAL * float(np.median(np.abs(tiles.without_planes(terms, rest)))),
        stated_mm=_stated(shape, kept, plane.normal),
        wave_rad=float(waves.amplitude_mm[worst]) / per_rad_mm,
        wave_harmonic=worst + 1,
        size_mm=float(np.linalg.norm(high - low)),
        displaced=displaced,
        displaced_share=float(displaced.sum() / count),
        pixels=int(kept.sum()),
    )


def _known(xyz_mm: Array, within: Mask | None) -> Mask:
    known = np.asarray(np.isfinite(xyz_mm).all(axis=2))
    return known if within is None else known & within


def robust_fit(terms: Array, values: Array) -> Array:
    """Fit values (n,) by terms (n, k) with the least sum of absolute deviations, by repeated weighting."""
    found = _weighted_fit(terms, values, np.ones_like(values))
    for _ in range(ROUNDS):
        off = np.abs(values - terms @ found)
        found = _weighted_fit(terms, values, 1 / np.maximum(off, 1e-3 * max(float(np.median(off)), 1e-12)))
    return found


def _weighted_fit(terms: Array, values: Array, weight: Array) -> Array:
    """Fit by the normal equations, which suit few terms of similar size: the whole system takes more time."""
    weighted = terms * weight[:, None]
    return np.asarray(np.linalg.lstsq(weighted.T @ terms, weighted.T @ values, rcond=None)[0], np.float64)


def _start(xyz_mm: Array, known: Mask) -> Array:
    """Give the depth (H, W) of the plate, up to its bow: 1 / z of a plane is linear over the image."""
    rows, columns = (np.linspace(-1, 1, size) for size in known.shape)
    x, y = np.meshgrid(columns, rows)
    terms = np.stack([np.ones_like(x), x, y], axis=-1)
    step = max(1, int(known.sum()) // 20_000)
    found = robust_fit(terms[known][::step], 1 / xyz_mm[known][::step, 2])
    return np.asarray(1 / (terms @ found))


def _per_rad_mm(shape: Shape, known: Mask) -> float:
    """Give the change of depth with the phase along the ray of the middle of the plate, mm per rad."""
    assert shape.calibration is not None, "a shape with points has a calibration"
    projector = shape.calibration.projector
    points = xyz_mm_of(shape)[known]
    middle = np.asarray(np.median(points, axis=0), np.float64)
    rotation, origin = np.array(projector.rotation), np.array(projector.translation_mm)
    near, far = (rotation @ (middle * share) + origin for share in (1.0, 1.0 + 1e-4))
    columns = projector.focal_px[0] * (far[0] / far[2] - near[0] / near[2])
    per_column_rad = float(np.median(shape.phase_rad[known] / np.maximum(shape.column_px[known], 1.0)))
    return abs(float(1e-4 * middle[2] / (columns * per_column_rad)))


def _quadratic(places: Array) -> Array:
    u, v = places.T
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)


@dataclass(frozen=True)
class _Tiles:
    """The places of the points of each tile, means of the terms (T, 6), and medians of the distances (T,), mm."""

    points: list[NDArray[np.intp]]
    terms: Array
    distance_mm: Array

    def measuring(self, distance: Array) -> _Tiles:
        """Give the same tiles with the medians of other distances (n,), mm."""
        return replace(self, distance_mm=np.array([np.median(distance[group]) for group in self.points]))

    def without_planes(self, terms: Array, values: Array) -> Array:
        """Give the values (n,) in tiles, each without the plane that fits it."""
        flat = terms[:, :3]
        fits = [np.linalg.lstsq(flat[group], values[group], rcond=None)[0] for group in self.points]
        return np.concatenate([values[g] - flat[g] @ fit for g, fit in zip(self.points, fits, strict=True)])


def _tiles(kept: Mask, terms: Array, distance: Array) -> _Tiles:
    row, column = (places // TILE_PX for places in np.nonzero(kept))
    number = row * (kept.shape[1] // TILE_PX + 1) + column
    order = np.argsort(number, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(number[order])) + 1)
    full = [group for group in groups if len(group) >= TILE_PIXELS_MIN]
    if len(full) < TILES_MIN:
        raise InputError(f"flat plate: {len(full)} parts of it are filled, {TILES_MIN} are needed; show more of it")
    means = np.stack([terms[group].mean(axis=0) for group in full])
    return _Tiles(full, means, np.array([np.median(distance[group]) for group in full]))


@dataclass(frozen=True)
class _Bow:
    """Range of the quadratic part over the field, and its standard deviation, mm."""

    range_mm: float
    sd_mm: float


def _form(tiles: _Tiles) -> Array:
    """Give the coefficients of the quadratic surface through the tiles, mm."""
    return np.asarray(np.linalg.lstsq(tiles.terms, tiles.distance_mm, rcond=None)[0], np.float64)


def _bow(tiles: _Tiles, terms: Array) -> _Bow:
    """Take the best plane out of the quadratic surface; what is left has its range between two of the points."""
    form = _form(tiles)
    flat = np.linalg.lstsq(tiles.terms[:, :3], tiles.terms, rcond=None)[0]
    points = terms[:: max(1, len(terms) // 20_000)]
    bent = points - points[:, :3] @ flat
    part = bent @ form
    ends = bent[int(np.argmax(part))] - bent[int(np.argmin(part))]
    rest = tiles.distance_mm - tiles.terms @ form
    variance = float(rest @ rest) / max(len(rest) - len(form), 1)
    covariance = variance * np.linalg.pinv(tiles.terms.T @ tiles.terms)
    return _Bow(float(np.ptp(part)), float(np.sqrt(max(float(ends @ covariance @ ends), 0.0))))


@dataclass(frozen=True)
class _FringeWaves:
    """Amplitude of each harmonic of the fringes, (HARMONICS,), and their sum at every point, (n,), both in mm."""

    amplitude_mm: Array
    distance_mm: Array


def _waves(rest: Array, phase_rad: Array) -> _FringeWaves:
    """Fit waves that follow the fringes to the rest, mm."""
    step = max(1, len(rest) // 100_000)
    turns = np.arange(1, HARMONICS + 1) * phase_rad[:, None]
    waves = np.concatenate([np.cos(turns), np.sin(turns)], axis=1)
    found = np.linalg.lstsq(waves[::step], rest[::step], rcond=None)[0]
    return _FringeWaves(np.hypot(found[:HARMONICS], found[HARMONICS:]), waves @ found)


def _stated(shape: Shape, kept: Mask, normal: Array) -> float:
    """Give the median uncertainty along the normal, mm: an error of depth moves a point along its ray."""
    if shape.uncertainty_mm is None:
        return float("nan")
    points = xyz_mm_of(shape)[kept]
    slant = np.abs(points @ normal) / points[:, 2]
    return float(np.nanmedian(shape.uncertainty_mm[kept] * slant))
