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
from quadfringe.decoding.given import saturated_from
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["Agreement", "small_by_chance"]

Flat = NDArray[np.intp]  # indices of pixels in a map that is read row by row
Map = NDArray[np.float32]
Square = tuple[slice, slice]  # rows and columns


class Tiles(NamedTuple):
    """Tiles of returned pixels, and the number of tiles that the lit pixels would fill."""

    pixels: list[Flat]
    lit: float = 0.0


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
        self._tiles = _fine_tiles(shape, self._known) if one_order else Tiles([])
        self._offsets_rad = self._offsets_of(self._tiles.pixels)

    @property
    def beyond_chance(self) -> bool:
        """Whether offsets are small in so many tiles of half a fringe that chance does not explain it."""
        chance = _chance(self._offsets_rad, self._tiles.lit, self._plan)
        return self.offset_rad <= limits.OFFSET_MAX_RAD and chance <= limits.AGREED_BY_CHANCE_MAX

    @property
    def offset_rad(self) -> float:
        """The offset that two thirds of the tiles of half a fringe do not exceed; infinite without any tile."""
        return _quantile(self._offsets_rad)

    @property
    def scatter_rad(self) -> float:
        """The same of the offsets less their medians, which a shift of all infrared light leaves as it is."""
        return _quantile(self._offsets_rad - np.median(self._offsets_rad, axis=0)) if self._tiles.pixels else np.inf

    @cached_property
    def in_the_mean(self) -> bool:
        """Whether offsets are small in tiles of several fringes; False where there are too few, as on small objects."""
        squares = _squares(self._known, limits.COARSE_TILE_PX)
        if len(squares) < limits.COARSE_TILES_MIN:
            return False
        return (
            _quantile(self._offsets_of([_pixels_of(self._known, square) for square in squares]))
            <= limits.OFFSET_MAX_RAD
        )

    @property
    def contradicted(self) -> bool:
        """Whether offsets differ from place to place by more than print or a wrong response explains."""
        if not self._tiles.pixels or self.scatter_rad <= limits.SCATTER_MAX_RAD:
            return False
        return not (self.beyond_chance or self.in_the_mean)

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
    for image in shot.images.values() if isinstance(shot, Shot) else ():
        known &= image < saturated_from(shot)
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
    """Give the probability that so many of the tiles have small offsets if G and IR know nothing of the phase."""
    from scipy.special import bdtrc

    small = np.count_nonzero(np.abs(offsets_rad).max(axis=1) <= limits.OFFSET_MAX_RAD)
    one = small_by_chance(limits.OFFSET_MAX_RAD, plan.fringes.numbers[0], offsets_rad.shape[1])
    count = max(round(tiles), len(offsets_rad))
    return 1.0 if one >= 1 or small == 0 else float(bdtrc(small - 1, count, one))


def small_by_chance(offset_rad: float, orders: float, channels: int) -> float:
    """Give the probability that the offsets of a tile, which may be any, are small with the best of all orders.

    Every order leaves them small in one square of all the angles that two channels may have.
    """
    return orders * (offset_rad / np.pi) ** channels


def _fine_tiles(shape: Shape, known: NDArray[np.bool_]) -> Tiles:
    """Take evenly spread squares with half a fringe, and of each the surfaces that fill enough of it."""
    import cv2

    side_px = _half_fringe_px(shape.phase_rad)
    squares = [] if side_px is None else _squares(known, side_px)
    if side_px is None or not squares:
        return Tiles([])
    taken = squares[:: -(-len(squares) // limits.FINE_TILES_MAX)]
    tiles = []
    for square in taken:
        count, surfaces = cv2.connectedComponents(known[square].astype(np.uint8), connectivity=4)
        tiles += [_pixels_of(known, square, surfaces == surface) for surface in range(1, count)]
    lit = np.count_nonzero(np.isfinite(shape.quality)) / side_px**2
    enough = [tile for tile in tiles if tile.size >= limits.TILE_SHARE * side_px**2]
    return Tiles(enough, lit * len(taken) / len(squares))


def _half_fringe_px(phase_rad: Map) -> int | None:
    """Give half of the median period of the fringes; None without any."""
    rows = phase_rad[:: limits.PERIOD_STEP]
    slopes = np.abs(np.diff(rows, axis=1)), np.abs(np.diff(phase_rad[:, :: limits.PERIOD_STEP], axis=0))
    seen = [slope[np.isfinite(slope)] for slope in slopes]
    if not all(slope.size for slope in seen):
        return None
    slope = float(np.hypot(*(np.median(slope) for slope in seen)))
    return max(round(np.pi / slope), limits.FINE_TILE_MIN_PX) if slope > 0 else None


def _squares(known: NDArray[np.bool_], side_px: int) -> list[Square]:
    """Cut an image into squares, and give those with enough known pixels."""
    rows, columns = (size // side_px for size in known.shape)
    blocks = known[: rows * side_px, : columns * side_px].reshape(rows, side_px, columns, side_px)
    full = blocks.sum(axis=(1, 3)) >= limits.TILE_SHARE * side_px**2
    places = np.argwhere(full) * side_px
    return [np.s_[y : y + side_px, x : x + side_px] for y, x in places]


def _pixels_of(known: NDArray[np.bool_], square: Square, part: NDArray[np.bool_] | None = None) -> Flat:
    """Give the known pixels of a square, or a part of them."""
    y, x = np.nonzero(known[square] if part is None else part)
    pixels: Flat = (y + square[0].start) * known.shape[1] + x + square[1].start
    return pixels


def _padded(tiles: list[Flat]) -> Flat:
    """Put tiles into rows, (tiles, pixels), with -1 at their ends."""
    rows = np.full((len(tiles), max(tile.size for tile in tiles)), -1)
    for row, tile in zip(rows, tiles, strict=True):
        row[: tile.size] = tile
    return rows


def _taken(values: Map, at: Flat) -> Map:
    """Take the values at these places, and NaN at -1."""
    return np.where(at >= 0, values.ravel()[at], np.nan).astype(np.float32)
