"""Small objects whose shots are sound, harmed a little, or broken: for the test of the verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.evaluation.broken import Change, exchanged, shifted
from quadfringe.evaluation.scoring import Scene

__all__ = ["BROKEN", "HARMED", "SOUND"]

CHANNELS = ("red", "green", "blue", "ir")
CROSSTALK = 0.1  # of the light of a channel, in equal parts to the others
BLUR_PX = 3.0
EXPONENT = 0.7

Fault = Callable[[Scene], Scene]


def _images(change: Change) -> Fault:
    def fault(scene: Scene) -> Scene:
        changed: dict[str, Any] = {**change(scene.channels)}
        return replace(scene, **changed)

    return fault


def _numbered(*numbers: float) -> Fault:
    return lambda scene: replace(scene, fringe_numbers=numbers)


def _each(function: Callable[[NDArray[Any]], NDArray[Any]]) -> Fault:
    return _images(lambda images: {name: np.round(function(image)).astype(np.uint8) for name, image in images.items()})


def _crossed(images: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    light = {name: image.astype(float) for name, image in images.items()}
    others = {name: sum(light[other] for other in light if other != name) for name in light}
    mixed = {name: (1 - CROSSTALK) * light[name] + CROSSTALK / (len(light) - 1) * others[name] for name in light}
    return {name: np.round(image).astype(np.uint8) for name, image in mixed.items()}


def _noise(images: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    random, bright = np.random.default_rng(1), images["red"] > 60
    return {name: np.where(bright, random.integers(60, 200, bright.shape), 3).astype(np.uint8) for name in images}


SOUND: dict[str, Fault] = {"sound": lambda scene: scene}
# Sound shots of a bench that is not well known, decoded as if it were.
HARMED: dict[str, Fault] = {
    f"exponent {EXPONENT}": _each(lambda image: 255 * (image / 255.0) ** EXPONENT),
    f"blur of {BLUR_PX:g} px": _each(lambda image: cv2.GaussianBlur(image.astype(float), (0, 0), BLUR_PX)),
    f"crosstalk {CROSSTALK}": _images(_crossed),
}
BROKEN: dict[str, Fault] = {
    **{f"{first} and {second}": _images(exchanged(first, second)) for first, second in combinations(CHANNELS, 2)},
    "all exchanged": _images(lambda i: {"red": i["green"], "green": i["blue"], "blue": i["ir"], "ir": i["red"]}),
    "red twice": _images(lambda images: {**images, "green": images["red"]}),
    **{f"ir by {columns} px": _images(shifted(columns, 0)) for columns in (4, 8, -12, 20)},
    "25, 24, 20": _numbered(25.0, 24.0, 20.0),
    "37, 36, 31": _numbered(37.0, 36.0, 31.0),
    "49, 48, 42": _numbered(49.0, 48.0, 42.0),
    "64, 63, 56": _numbered(64.0, 63.0, 56.0),
    "noise": _images(_noise),
}
