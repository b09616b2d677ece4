"""Shots that other benches could have made of the captures: other steps, crops, backgrounds, resolution, light.

Any number that a variant draws follows from the offset of its shot, so that every run makes the same shots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation.scoring import Map, Scene

__all__ = ["OFFSETS", "VARIANTS", "stepped", "turned"]

CROP = 0.2  # share of the frame
CROP_ASIDE = 0.25  # of its sides, by which the middle of a crop is moved from that of the object
DARKER = 0.1
# Electrons of a pixel at full scale, and standard deviation of its noise in the dark, electrons, as EMVA 1288 defines
# them. Industrial cameras have 10,000 to 20,000, and 2 to 7 (CMOS) or 10 to 20 (CCD): this one is a poor one.
SATURATION_E, DARK_NOISE_E = 10_000, 10
# Standard deviation of the noise on black around an object that is cut out, share of full scale: one level of 8 bit, as
# of a camera with gain. Less noise is rounded to black.
BLACK_NOISE = 0.004
ROTATION_DEG = 35.0
# Range of the truth among 3 x 3 pixels up to which it is interpolated, rad, and the share of its standard
# deviation that is left then: the mean of the squares of two linear weights, along both directions.
SMOOTH_RAD = np.pi / 2
INTERPOLATED = 2 / 3
HARMONICS = 3  # of the fringes that the response makes
SD_WINDOW_PX = 5  # side of the window in which the noise of the images is averaged
OFFSETS = range(scenes.STEPS)
SEEN_STEPS = 9 * scenes.STEPS  # shifts beyond leave the columns of the projector
Variant = Callable[[Scene, int], Scene]
Change = Callable[[Any], Any]  # of an image, of the truth, or of a mask


def stepped(data: Path, name: str, offset: int, other: int = 0) -> Scene:
    """Give the shot of a capture whose red image is this of the 12 steps of the first frequency.

    A projector that is shifted by n steps of R shows G and IR shifted by 14 n / 15 and 7 n / 8 steps, because the
    periods are 42, 45 and 48 columns. Of the shifts with this offset, the one that comes nearest to whole steps is
    taken, which is off by 0.13 rad at most. `other` 1 takes the next one, off by 0.14 rad at most: R and B stay, G and
    IR have other steps.
    """
    scene = scenes.capture(data, name)
    shifts = sorted(range(offset, SEEN_STEPS, scenes.STEPS), key=lambda n: max(map(_off, _steps(n))))
    shift = shifts[other]
    quarter = scenes.STEPS // 4
    steps = {"red": (0, offset), "blue": (0, offset + quarter)}
    steps |= {key: (f, round(step)) for key, f, step in zip(("green", "ir"), (1, 2), _steps(shift), strict=True)}
    images = {key: _image(data, name, *step) for key, step in steps.items()}
    changed: dict[str, Any] = images
    phase_rad = scene.phase_rad + 2 * np.pi * shift / scenes.STEPS
    return replace(scene, **changed, phase_rad=phase_rad, phase_sd_rad=_truth_sd_rad(data, name))


@cache
def _truth_sd_rad(data: Path, name: str) -> Map:
    """Estimate the noise of the true phase from what a sine and its harmonics leave of the 12 steps."""
    steps = np.stack([_image(data, name, 0, step) for step in range(scenes.STEPS)]).astype(np.float64)
    terms = np.fft.rfft(steps, axis=0)
    modulation = 2 * np.abs(terms[1]) / scenes.STEPS
    freedom = scenes.STEPS - 1 - 2 * HARMONICS
    terms[: HARMONICS + 1] = 0
    squares = np.sum(np.fft.irfft(terms, scenes.STEPS, axis=0) ** 2, axis=0) / freedom
    noise = np.sqrt(cv2.blur(squares, (SD_WINDOW_PX, SD_WINDOW_PX)))
    return np.asarray(np.sqrt(2 / scenes.STEPS) * noise / np.maximum(modulation, 1), np.float32)


def _steps(shift: int) -> tuple[float, float]:
    return 14 * shift / 15, 7 * shift / 8


def _off(steps: float) -> float:
    return abs(steps - round(steps))


def _image(data: Path, name: str, frequency: int, step: int) -> NDArray[np.uint8]:
    file = scenes.step_files(data, name, frequency)[step % scenes.STEPS]
    image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    assert image is not None, file
    return np.asarray(image, np.uint8)


def _changed(
    scene: Scene,
    image: Change,
    truth: Change | None = None,
    mask: Change | None = None,
    noise_left: float = 1.0,
) -> Scene:
    """Change images, truth and masks, by default alike; the share `noise_left` of the noise of the truth remains."""
    truth = truth or image
    of_mask = mask or truth
    changed: dict[str, Any] = {name: np.ascontiguousarray(image(channel)) for name, channel in scene.channels.items()}
    sd_rad, sure = scene.phase_sd_rad, scene.sure
    return replace(
        scene,
        **changed,
        phase_rad=truth(scene.phase_rad),
        phase_sd_rad=None if sd_rad is None else noise_left * truth(sd_rad),
        scored=of_mask(scene.scored.astype(np.uint8)).astype(bool),
        sure=None if sure is None else of_mask(sure.astype(np.uint8)).astype(bool),
    )


def _cropped(scene: Scene, offset: int) -> Scene:
    """Keep a fifth of the frame, at another place of the object for every offset."""
    frame = np.array(scene.red.shape)
    size = np.round(np.sqrt(CROP) * frame).astype(int)
    angle = 2 * np.pi * offset / len(OFFSETS)
    aside = CROP_ASIDE * size * (np.sin(angle), np.cos(angle))
    middle = np.mean(np.nonzero(scene.scored), axis=1) + aside
    first = np.clip(middle.astype(int) - size // 2, 0, frame - size)
    part = np.s_[first[0] : first[0] + size[0], first[1] : first[1] + size[1]]
    return _changed(scene, lambda image: image[part])


def _cut_out(scene: Scene, offset: int, black_noise: float = BLACK_NOISE) -> Scene:
    """Put the object onto black."""
    noise = np.random.default_rng(offset)

    def image(channel: Any) -> Any:
        return _levels(channel * scene.scored / 255 + black_noise * noise.standard_normal(channel.shape))

    return _changed(scene, image, np.copy)


def _levels(light: Any) -> Any:
    return np.round(255 * np.clip(light, 0, 1)).astype(np.uint8)


def _binned(scene: Scene, _offset: int) -> Scene:
    """Average 2 x 2 pixels; a pixel counts when all four do."""

    def means(image: Any) -> Any:
        rows, columns = image.shape
        return image.reshape(rows // 2, 2, columns // 2, 2).mean(axis=(1, 3))

    def levels(image: Any) -> Any:
        return np.round(means(image)).astype(np.uint8)

    return _changed(scene, levels, means, lambda mask: means(mask) == 1, noise_left=0.5)


def _darkened(scene: Scene, offset: int) -> Scene:
    """Take a tenth of the light, with the noise of photons and of the sensor."""
    noise = np.random.default_rng(offset)

    def image(channel: Any) -> Any:
        electrons = noise.poisson(DARKER * SATURATION_E * channel / 255)
        return _levels((electrons + DARK_NOISE_E * noise.standard_normal(channel.shape)) / SATURATION_E)

    return _changed(scene, image, np.copy)


def _inclined(scene: Scene, _offset: int) -> Scene:
    """Turn the camera about its axis."""
    rows, columns = scene.red.shape
    turn = cv2.getRotationMatrix2D((columns / 2, rows / 2), ROTATION_DEG, 1.0)

    def rotated(image: Any, how: int = cv2.INTER_CUBIC, border: int = cv2.BORDER_CONSTANT) -> Any:
        return cv2.warpAffine(image, turn, (columns, rows), flags=how, borderMode=border)

    def nearest(values: Any) -> Any:
        return rotated(values, cv2.INTER_NEAREST)

    def truth(values: Any) -> Any:
        window = np.ones((3, 3), np.uint8)
        ranges = nearest(cv2.dilate(values, window) - cv2.erode(values, window))
        between = rotated(values, cv2.INTER_LINEAR, cv2.BORDER_REPLICATE)
        return np.where(ranges < SMOOTH_RAD, between, nearest(values))

    return _changed(scene, rotated, truth, nearest, INTERPOLATED)


def turned(scene: Scene, offset: int) -> Scene:
    """Turn the camera by 90 degrees, to the left or to the right: fringes run along the rows."""
    return _changed(scene, lambda image: np.rot90(image, 1 if offset % 2 else -1))


VARIANTS: dict[str, Variant] = {
    "as captured": lambda scene, _offset: scene,
    "cropped": _cropped,
    "cut out": _cut_out,
    "cut out, no noise": lambda scene, offset: _cut_out(scene, offset, black_noise=0.0),
    "binned": _binned,
    "darkened": _darkened,
    "inclined": _inclined,
    "cropped, cut out": lambda scene, offset: _cropped(_cut_out(scene, offset), offset),
    "binned, cut out": lambda scene, offset: _binned(_cut_out(scene, offset), offset),
    "inclined, cut out": lambda scene, offset: _inclined(_cut_out(scene, offset), offset),
}
