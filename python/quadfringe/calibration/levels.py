"""Evenly lit captures: the levels to project, the mean intensities of shots, and the dark level of a camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import DARK_LEVEL_MAX, HOT, LEVEL_STEPS, SHORTER_EXPOSURES
from quadfringe.config import Row4
from quadfringe.data import AnyShot
from quadfringe.errors import InputError

__all__ = ["CHANNELS", "DarkLevel", "LevelPlan", "dark_level", "level_plan", "mean_levels", "row4", "stacked"]

Array = NDArray[np.float64]
CHANNELS = ("red", "green", "blue", "ir")


@dataclass(frozen=True)
class LevelPlan:
    """The captures to take: `levels` (K, 4) of R, G, B, IR from 0 to 1, and the relative `exposure` (K,).

    Without infrared `levels` are (K, 3).
    """

    levels: Array
    exposure: Array

    @property
    def channels(self) -> int:
        """Number of channels: 4, or 3 without infrared."""
        return int(self.levels.shape[1])

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each capture, as in r100_g000_b000_ir050_e100; the numbers are per cent."""
        words = (*("r", "g", "b", "ir")[: self.channels], "e")
        rows = np.column_stack([self.levels, self.exposure])
        return tuple("_".join(f"{w}{round(100 * v):03d}" for w, v in zip(words, row, strict=True)) for row in rows)


def level_plan(
    steps: int = LEVEL_STEPS, channels: int = 4, exposures: Sequence[float] = SHORTER_EXPOSURES
) -> LevelPlan:
    """Return the captures that `fit_channels` needs: black, a ramp of each channel, and a ramp of all of them together.

    There are 4 `channels`, or 3 without infrared.

    The last captures repeat the brightest level at these shorter `exposures`, shares of the full one, which separates
    the camera response from the projector response. Without any, the camera is taken as linear.

    >>> from quadfringe.calibration.levels import level_plan
    >>> level_plan(4).names[:2]
    ('r000_g000_b000_ir000_e100', 'r025_g000_b000_ir000_e100')
    """
    ramp = np.round(np.arange(1, steps + 1) / steps, 2)
    single = [level * np.eye(channels)[channel] for channel in range(channels) for level in ramp]
    together = [np.full(channels, level) for level in ramp]
    bright = [np.full(channels, ramp[-1])] * len(exposures)
    levels = np.array([np.zeros(channels), *single, *together, *bright])
    exposure = np.ones(len(levels))
    exposure[len(levels) - len(exposures) :] = exposures
    return LevelPlan(levels, exposure)


@dataclass(frozen=True)
class DarkLevel:
    """Dark intensities by channel, shares of full scale: median, spread between pixels, and temporal noise."""

    level: Row4
    fixed_pattern: Row4
    noise: Row4
    hot_pixels: int


def dark_level(shots: Sequence[AnyShot]) -> DarkLevel:
    """Measure the dark level of each channel from two or more shots with the lens covered.

    A hot pixel exceeds the level by more than 2 % of full scale in the mean of the shots. Raises `InputError` for a
    single shot, for shots of different sizes, and for shots that are not dark.
    """
    if len(shots) < 2:
        raise InputError(f"dark level: expected two shots or more with the lens covered, got {len(shots)}")
    stacks = [stacked(shots, name) for name in shots[0].channels]
    levels = [float(np.median(stack.mean(axis=0))) for stack in stacks]
    if max(levels) > DARK_LEVEL_MAX:
        worst = CHANNELS[int(np.argmax(levels))]
        raise InputError(
            f"dark level: {worst} has {max(levels):.0%} of full scale with the lens covered, at most "
            f"{DARK_LEVEL_MAX:.0%} are accepted; put the cap on and switch the projectors off, or lower the black level"
        )
    means = [stack.mean(axis=0) - level for stack, level in zip(stacks, levels, strict=True)]
    return DarkLevel(
        level=row4(levels),
        fixed_pattern=row4([float(np.std(np.clip(mean, -HOT, HOT))) for mean in means]),
        noise=row4([float(np.sqrt(np.mean(np.var(stack, axis=0, ddof=1)))) for stack in stacks]),
        hot_pixels=int(np.count_nonzero(np.any([mean > HOT for mean in means], axis=0))),
    )


def mean_levels(shot: AnyShot, share: float = 0.25) -> Array:
    """Return the mean intensity of each channel, (4,), share of full scale, over the middle `share` of each axis.

    Without infrared it is (3,). A channel is NaN when more than one pixel in a thousand is saturated there, because its
    mean is then biased.
    """
    found = []
    for image in shot.channels.values():
        rows, columns = (slice(round(n * (1 - share) / 2), round(n * (1 + share) / 2)) for n in image.shape)
        patch = image[rows, columns] / shot.full_scale_value
        found.append(float(patch.mean()) if np.mean(patch >= 0.998) < 1e-3 else np.nan)
    return np.array(found)


def row4(values: Sequence[float] | Array, absent: float = 0.0) -> Row4:
    """Convert four numbers to a tuple of R, G, B, IR; without infrared there are three, and it is `absent`."""
    red, green, blue, ir = (*(float(v) for v in values), absent)[:4]
    return red, green, blue, ir


def stacked(shots: Sequence[AnyShot], name: str) -> Array:
    """Stack one channel of shots, (N, H, W), share of full scale; raises `InputError` for different sizes."""
    images = [shot.channels[name] for shot in shots]
    if len({image.shape for image in images}) > 1:
        sizes = ", ".join(sorted({f"{i.shape[1]} x {i.shape[0]}" for i in images}))
        raise InputError(f"{name}: shots of {sizes} pixels; all captures of a calibration must be of one size")
    return np.stack([i / shot.full_scale_value for i, shot in zip(images, shots, strict=True)]).astype(float)
