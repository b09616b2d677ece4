"""Whether green and infrared show their fringes where the phase of a shape puts them.

Where channels are exchanged or fringe numbers are others, the decoder still takes the orders that fit G and IR best.
They leave offsets that differ from place to place. In a sound shot there are none, but print and a wrong response move
single fringes. Offsets are measured in tiles of one surface with half a fringe, of which even small objects have
several, and on larger objects in tiles of several fringes, in which print averages out. The published method chooses
the order of every pixel by these offsets, so that its offsets in half a fringe tell nothing.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.data import AnyShot, Shape, Shot
from quadfringe.decoding import verdict_params as limits
from quadfringe.decoding.fringe_fit import infrared_column
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["Agreement"]

SATURATED = 0.998  # of full scale, as in `symptoms.saturation`

Flat = NDArray[np.intp]  # indices of pixels in a map that is read row by row
Map = NDArray[np.float32]


class Tiles(NamedTuple):
    """Tiles of returned pixels, and how many such tiles the lit pixels would fill."""

    pixels: list[Flat]
    lit: float


class Agreement:
    """The phase of a shape compared with the light of G and IR.

    B takes the place of IR if it has another fringe number than R.
    """

    def __init__(self, shape: Shape, shot: AnyShot, plan: Plan) -> None:
        self._phase_rad, self._plan = shape.phase_rad, plan
        self._light = linear_light_of(shot, plan)
        self._waves = _waves(shape, plan)
        self._known = _known(shape, shot, self._light)
        one_order = shape.config["decode"]["method"] == "joint"  # for all pixels of a tile
        self._tiles = _fine_tiles(shape, self._known) if one_order else Tiles([], 0.0)
        self._offsets_rad = self._offsets_of(self._tiles.pixels)

    @property
    def beyond_chance(self) -> bool:
        """Whether offsets are small in so many tiles of half a fringe that chance does not explain it."""
        chance = _chance(self._offsets_rad, self._tiles.lit, self._plan)
        return _quantile(self._offsets_rad) <= limits.OFFSET_MAX_RAD and chance <= limits.AGREED_BY_CHANCE_MAX

    @cached_property
    def in_the_mean(self) -> bool:
        """Whether offsets are small in tiles of several fringes; False where there are too few, as on small objects."""
        tiles = _coarse_tiles(self._known)
        if len(tiles) < limits.COARSE_TILES_MIN:
            return False
        return _quantile(self._offsets_of(tiles)) <= limits.OFFSET_MAX_RAD

    @property
    def contradicted(self) -> bool:
        """Whether offsets differ from place to place by more than print or a wrong response explains."""
        if not len(self._offsets_rad) or self.beyond_chance or self.in_the_mean:
            return False
        scatter_rad = self._offsets_rad - np.median(self._offsets_rad, axis=0)
        return _quantile(scatter_rad) > limits.SCATTER_MAX_RAD

    def _offsets_of(self, tiles: list[Flat]) -> NDArray[np.float64]:
        """Give the offsets in rad, (tiles, channels)."""
        if not tiles:
            return np.zeros((0, len(self._waves)))
        at = _padded(tiles)
        red, blue, phase_rad = (_taken(m, at) for m in (self._light["red"], self._light["blue"], self._phase_rad))
        brightness = _core.shared_brightness(red, blue, phase_rad) if self._plan.fringes.quadrature else None
        channels = [(_taken(self._light[name], at), _taken(wave_rad, at)) for name, wave_rad in self._waves]
        return np.stack([_core.fringe_offsets(light, wave_rad, brightness) for light, wave_rad in channels], axis=1)


def _known(shape: Shape, shot: AnyShot, light: dict[str, Map]) -> NDArray[np.bool_]:
    """Find the returned pixels whose light is known: no channel is saturated."""
    known = np.isfinite(shape.phase_rad)
    for image in light.values():
        known &= np.isfinite(image)
    if isinstance(shot, Shot):
        for image in shot.images.values():
            known &= image < SATURATED * shot.full_scale_value
    return known


def _waves(shape: Shape, plan: Plan) -> list[tuple[str, Map]]:
    """Give the channels other than R and B, and the phase that each should have by the phase of the shape."""
    first, second, *third = plan.fringes.numbers
    waves = [("green", second / first * shape.phase_rad)]
    if third and not plan.fringes.quadrature:
        waves.append(("blue", third[0] / first * shape.phase_rad))
    for number in third if plan.fringes.infrared else ():
        per_px = 2 * np.pi * number / plan.projector_width_px
        waves.append(("ir", (per_px * infrared_column(shape, plan)).astype(np.float32)))
    return waves


def _quantile(offsets_rad: NDArray[np.float64]) -> float:
    """Give the size that two thirds of the tiles do not exceed, in the worst channel; infinity without any tile."""
    if not len(offsets_rad):
        return np.inf
    return float(np.quantile(np.abs(offsets_rad), limits.OFFSET_QUANTILE, axis=0).max())


def _chance(offsets_rad: NDArray[np.float64], tiles: float, plan: Plan) -> float:
    """Give the probability that so many of the tiles have small offsets if G and IR know nothing of the phase.

    Each tile then has the best of all orders. Its offsets are anywhere, and small with the probability of as many
    small squares in the square of both angles.
    """
    from scipy.special import bdtrc

    small = np.count_nonzero(np.abs(offsets_rad).max(axis=1) <= limits.OFFSET_MAX_RAD)
    one = plan.fringes.numbers[0] * (limits.OFFSET_MAX_RAD / np.pi) ** offsets_rad.shape[1]
    count = max(round(tiles), len(offsets_rad))
    return 1.0 if one >= 1 or small == 0 else float(bdtrc(small - 1, count, one))


def _fine_tiles(shape: Shape, known: NDArray[np.bool_]) -> Tiles:
    """Cut connected surfaces into squares with half a fringe, of which evenly spread ones are taken."""
    import cv2

    side_px = _half_fringe_px(shape.phase_rad)
    if side_px is None:
        return Tiles([], 0.0)
    _, surfaces = cv2.connectedComponents(known.astype(np.uint8), connectivity=4)
    pixels = np.flatnonzero(known)
    y, x = np.divmod(pixels, known.shape[1])
    tiles_across, tiles_down = (size // side_px + 1 for size in known.shape[::-1])
    tile_of = (surfaces.ravel()[pixels].astype(np.int64) * tiles_down + y // side_px) * tiles_across + x // side_px
    order = np.argsort(tile_of, kind="stable")
    cuts = np.flatnonzero(np.diff(tile_of[order])) + 1
    tiles = [tile for tile in np.split(pixels[order], cuts) if tile.size >= limits.TILE_SHARE * side_px**2]
    lit = np.count_nonzero(np.isfinite(shape.quality)) / side_px**2
    taken = tiles[:: -(-len(tiles) // limits.FINE_TILES_MAX) or 1]
    return Tiles(taken, lit * len(taken) / max(len(tiles), 1))


def _half_fringe_px(phase_rad: Map) -> int | None:
    """Give half of the median period of the fringes; None without any."""
    slopes = [np.abs(np.diff(phase_rad, axis=axis)) for axis in (0, 1)]
    seen = [slope[np.isfinite(slope)] for slope in slopes]
    if not all(slope.size for slope in seen):
        return None
    slope = float(np.hypot(*(np.median(slope) for slope in seen)))
    return max(round(np.pi / slope), limits.FINE_TILE_MIN_PX) if slope > 0 else None


def _coarse_tiles(known: NDArray[np.bool_]) -> list[Flat]:
    """Give the tiles with enough known pixels, of several fringes."""
    side_px = limits.COARSE_TILE_PX
    rows, columns = (range(0, size - side_px + 1, side_px) for size in known.shape)
    at = np.arange(known.size).reshape(known.shape)
    tiles = [np.s_[y : y + side_px, x : x + side_px] for y in rows for x in columns]
    return [at[tile][known[tile]] for tile in tiles if known[tile].mean() >= limits.TILE_SHARE]


def _padded(tiles: list[Flat]) -> Flat:
    """Put tiles into rows, (tiles, pixels), with -1 at their ends."""
    rows = np.full((len(tiles), max(tile.size for tile in tiles)), -1)
    for row, tile in zip(rows, tiles, strict=True):
        row[: tile.size] = tile
    return rows


def _taken(values: Map, at: Flat) -> Map:
    """Take the values at these places, and NaN at -1."""
    return np.where(at >= 0, values.ravel()[at], np.nan).astype(np.float32)
