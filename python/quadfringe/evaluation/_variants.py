"""Shots that other benches could have made of the captures: other steps, crops, backgrounds, resolution, light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation.scoring import Scene

__all__ = ["OFFSETS", "VARIANTS", "stepped"]

CROP = 0.2  # share of the frame
DARKER = 0.1
READ_NOISE = 0.004  # standard deviation, share of full scale: one level of 8 bit
ROTATION_DEG = 35.0
OFFSETS = range(scenes.STEPS)
Variant = Callable[[Scene, int], Scene]


def stepped(data: Path, name: str, offset: int) -> Scene:
    """Give the shot of a capture whose red image is this of the 12 steps of the first frequency.

    A projector that is shifted by n steps of R shows G and IR shifted by 14 n / 15 and 7 n / 8 steps, because the
    periods are 42, 45 and 48 columns. Of the shifts with this offset, the one that comes nearest to whole steps is
    taken; it is off by 0.13 rad at most.
    """
    scene = scenes.capture(data, name)
    shift = min(range(offset, 9 * scenes.STEPS, scenes.STEPS), key=lambda n: max(map(_off, _steps(n))))
    quarter = scenes.STEPS // 4
    steps = {"red": (0, offset), "blue": (0, offset + quarter)}
    steps |= {key: (f, round(step)) for key, f, step in zip(("green", "ir"), (1, 2), _steps(shift), strict=True)}
    images = {key: _image(data, name, *step) for key, step in steps.items()}
    changed: dict[str, Any] = images
    return replace(scene, **changed, phase_rad=scene.phase_rad + 2 * np.pi * shift / scenes.STEPS)


def _steps(shift: int) -> tuple[float, float]:
    return 14 * shift / 15, 7 * shift / 8


def _off(steps: float) -> float:
    return abs(steps - round(steps))


def _image(data: Path, name: str, frequency: int, step: int) -> NDArray[np.uint8]:
    file = scenes.step_files(data, name, frequency)[step % scenes.STEPS]
    image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    assert image is not None, file
    return np.asarray(image, np.uint8)


def _changed(scene: Scene, image: Callable[[Any], Any], truth: Callable[[Any], Any] | None = None) -> Scene:
    truth = truth or image
    changed: dict[str, Any] = {name: np.ascontiguousarray(image(channel)) for name, channel in scene.channels.items()}
    return replace(
        scene,
        **changed,
        phase_rad=truth(scene.phase_rad),
        scored=truth(scene.scored.astype(np.uint8)).astype(bool),
    )


def _cropped(scene: Scene, _seed: int) -> Scene:
    """Keep a fifth of the frame around the object."""
    size = np.round(np.sqrt(CROP) * np.array(scene.red.shape)).astype(int)
    middle = np.mean(np.nonzero(scene.scored), axis=1).astype(int)
    first = np.clip(middle - size // 2, 0, np.array(scene.red.shape) - size)
    part = np.s_[first[0] : first[0] + size[0], first[1] : first[1] + size[1]]
    return _changed(scene, lambda image: image[part])


def _cut_out(scene: Scene, seed: int) -> Scene:
    """Put the object onto black."""
    noise = np.random.default_rng(seed)

    def image(channel: Any) -> Any:
        lit = channel * scene.scored / 255 + READ_NOISE * noise.standard_normal(channel.shape)
        return np.round(255 * np.clip(lit, 0, 1)).astype(np.uint8)

    return _changed(scene, image, np.copy)


def _binned(scene: Scene, _seed: int) -> Scene:
    """Average 2 x 2 pixels; a pixel counts when all four do."""

    def means(image: Any) -> Any:
        rows, columns = image.shape
        return image.reshape(rows // 2, 2, columns // 2, 2).mean(axis=(1, 3))

    binned = _changed(scene, lambda image: np.round(means(image)).astype(np.uint8), means)
    return replace(binned, scored=means(scene.scored.astype(float)) == 1)


def _darkened(scene: Scene, seed: int) -> Scene:
    """Take a tenth of the light."""
    noise = np.random.default_rng(seed)

    def image(channel: Any) -> Any:
        dark = DARKER * channel / 255 + READ_NOISE * noise.standard_normal(channel.shape)
        return np.round(255 * np.clip(dark, 0, 1)).astype(np.uint8)

    return _changed(scene, image, np.copy)


def _inclined(scene: Scene, _seed: int) -> Scene:
    """Turn the camera about its axis."""
    rows, columns = scene.red.shape
    turn = cv2.getRotationMatrix2D((columns / 2, rows / 2), ROTATION_DEG, 1.0)

    def turned(how: int) -> Callable[[Any], Any]:
        return lambda image: cv2.warpAffine(image, turn, (columns, rows), flags=how)

    return _changed(scene, turned(cv2.INTER_CUBIC), turned(cv2.INTER_NEAREST))


VARIANTS: dict[str, Variant] = {
    "as captured": lambda scene, _seed: scene,
    "cropped": _cropped,
    "cut out": _cut_out,
    "binned": _binned,
    "darkened": _darkened,
    "inclined": _inclined,
    "cropped, cut out": lambda scene, seed: _cropped(_cut_out(scene, seed), seed),
    "binned, cut out": lambda scene, seed: _binned(_cut_out(scene, seed), seed),
    "inclined, cut out": lambda scene, seed: _inclined(_cut_out(scene, seed), seed),
}
