"""The phases of one shot before unwrapping, by two steps and by Fourier filters; `stages.demodulate` chooses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe._core import (
    background,
    block_means,
    block_size,
    carrier,
    fill_gaps,
    fourier_pair,
    modulation_ratio,
    row_period,
    two_step,
)
from quadfringe.errors import DecodeError

__all__ = ["Wrapped", "each_alone", "with_quadrature", "wrap"]

Map = NDArray[np.float32]
FringeNumbers = tuple[float, ...]  # as `Fringes.code`: of red and blue, of green, of infrared if there is any


class Wrapped(NamedTuple):
    """Phases of one shot before unwrapping, float32.

    Orders are found on means over blocks of a few rows, (B, W) with one row for each block; the phase of the result is
    that of single pixels, (H, W).
    """

    phase_rad: Map
    """Wrapped phase of R and B at every pixel, (H, W), rad (S2); of blocks of R if each colour has a number."""
    modulation: Map
    """Least modulation of all channels, (H, W), fraction of full scale; NaN where IR has no data."""
    red_blue_rad: Map
    """Wrapped phase of the block means of R and B, (B, W), rad; of R, up to whole turns, if each has a number."""
    green_rad: Map
    """Phase of the block means of G, (B, W), rad, up to whole turns (S3)."""
    infrared_rad: Map
    """Phase of the block means of IR, or of B with a number for itself, (B, W), rad, up to whole turns (S3); else 0."""
    rows: int
    """Rows of a block."""

    def __repr__(self) -> str:
        height, width = self.phase_rad.shape
        return f"Wrapped({width} x {height}, blocks of {self.rows} rows)"

    def repeated(self, blocks: Map) -> Map:
        """Give a map of blocks, (B, W), at every pixel, (H, W)."""
        return np.repeat(blocks, self.rows, axis=0)[: len(self.phase_rad)]


def with_quadrature(light: dict[str, Map], numbers: FringeNumbers) -> Wrapped:
    """Give the phase of red and blue in quadrature (S2), and the Fourier phases of green and infrared (S3)."""
    first, second, *third = numbers
    red, blue = light["red"], light["blue"]
    ir = light["ir"] if third else np.zeros_like(red)
    period_px, green_px, infrared_px = _periods_px(red, (first, second, *(third or [second])))
    rows, columns = block_size(green_px, infrared_px, red.shape[1])
    red_means, red_level = _fringes(red, rows, 1, period_px)
    blue_means, blue_level = _fringes(blue, rows, 1, period_px)
    ratio = modulation_ratio(red_means, blue_means)[:, np.newaxis]
    green_means, _ = _fringes(light["green"], rows, columns, green_px)
    infrared_means, _ = _fringes(fill_gaps(ir), rows, columns, infrared_px)
    periods = (green_px / columns, infrared_px / columns)
    found = fourier_pair(green_means, infrared_means, periods, columns, red.shape[1])
    (green, green_modulation), (infrared, infrared_modulation) = found

    def pixels(blocks: Map) -> Map:
        return np.repeat(blocks, rows, axis=0)[: len(red)]

    red_fringes = red - pixels(red_level)
    blue_fringes = (blue - pixels(blue_level)) * pixels(ratio)
    modulation = np.sqrt(red_fringes * red_fringes + blue_fringes * blue_fringes)
    least = np.fmin(modulation, pixels(green_modulation))
    least = np.fmin(least, pixels(infrared_modulation)) if third else least
    least[np.isnan(ir)] = np.nan
    return Wrapped(
        phase_rad=two_step(red_fringes, blue_fringes),
        modulation=least,
        red_blue_rad=two_step(red_means, blue_means * ratio, coarse=True),
        green_rad=green,
        infrared_rad=infrared if third else np.zeros_like(infrared),
        rows=rows,
    )


def each_alone(light: dict[str, Map], numbers: FringeNumbers) -> Wrapped:
    """Give the Fourier phases of red, green and blue."""
    red, width = light["red"], light["red"].shape[1]
    period_px, green_px, blue_px = _periods_px(red, numbers)
    rows, columns = block_size(green_px, blue_px, width)
    red_means = block_means(_fringes(red, rows, 1, period_px)[0], 1, columns)
    green_means, blue_means = (
        _fringes(light[name], rows, columns, px)[0] for name, px in (("green", green_px), ("blue", blue_px))
    )
    (red_rad, modulation), _ = fourier_pair(red_means, red_means, (period_px / columns,) * 2, columns, width)
    found = fourier_pair(green_means, blue_means, (green_px / columns, blue_px / columns), columns, width)
    (green, green_modulation), (blue, blue_modulation) = found
    least = np.fmin(np.fmin(green_modulation, blue_modulation), modulation)
    phase_rad, modulation = (np.repeat(blocks, rows, axis=0)[: len(red)] for blocks in (wrap(red_rad), least))
    return Wrapped(phase_rad, modulation, red_rad, green, blue, rows)


def _periods_px(red: Map, numbers: FringeNumbers) -> list[float]:
    """Give the fringe periods of these numbers along the rows; raise `DecodeError` when no fringes cross them."""
    period_px = row_period(red)
    others_px = [period_px * numbers[0] / number for number in numbers[1:]]
    if not np.isfinite(carrier(red)[0]) or max(others_px) > red.shape[1]:
        raise DecodeError("no fringes cross the rows of the red image; the published stages need them")
    return [period_px, *others_px]


def wrap(phase_rad: Map) -> Map:
    """Give the phase in the half-open turn about 0, rad."""
    turn = np.float32(2 * np.pi)
    return (phase_rad - turn * np.round(phase_rad / turn)).astype(np.float32)


def _fringes(image: Map, rows: int, columns: int, period_px: float) -> tuple[Map, Map]:
    """Give block means minus their background, and the background by the mean envelope."""
    means = block_means(image, rows, columns)
    level = background(means, period_px / columns, kind="mean_envelope")
    return means - level, level
