"""Shots of the scenes of the virtual bench by a camera of half the size, with changed images or on dark ground."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import quadfringe as qf
from quadfringe import _core
from quadfringe.data import core_device
from quadfringe.evaluation import broken, world
from quadfringe.evaluation._isolated import outline

PLAIN = (36.0, 35.0, 30.0)


@cache
def half_plan(*, whole: bool = False) -> qf.Plan:
    """Give the plan of the virtual bench for a camera of half the size, or for that of the bench."""
    with qf.open(qf.SystemConfig()) as scanner:
        assert scanner.calibration is not None
        known = scanner.calibration
        return qf.Plan(912, calibration=known if whole else known.model_copy(update={"camera": broken.HALF}))


def half_shot(
    scene: str, seed: int, numbers: tuple[float, ...] = PLAIN, *, whole: bool = False, **options: Any
) -> qf.Shot:
    """Draw a scene with 2 % noise, `whole` at the size of the camera of the bench.

    `options` are those of the drawing, as the exponent of the projector.
    """
    bench = _core.Bench() if whole else _core.Bench(camera=core_device(broken.HALF))
    drawn = world.SCENES[scene](bench, np.random.default_rng([seed, 77]))
    drawn = replace(drawn, options=(drawn.options or {}) | options, fringe_numbers=numbers)
    return world.expose(bench, drawn, seed, broken.NOISE).shot


def changed(shot: qf.Shot, change: broken.Change) -> qf.Shot:
    """Change the images of a shot by name."""
    images = change(dict(shot.channels))
    return qf.Shot(*(np.ascontiguousarray(images[name]) for name in ("red", "green", "blue", "ir")))


def cut_out(shot: qf.Shot, share: float, seed: int) -> qf.Shot:
    """Keep an object that fills this share of the image, on dark ground with noise."""
    inside, noise = outline(shot.first.shape, share, seed), np.random.default_rng(seed)

    def cut(images: broken.Images) -> broken.Images:
        dark = {name: np.clip(np.round(noise.normal(1, 2, inside.shape)), 0, 255) for name in images}
        return {name: np.where(inside, image, dark[name]).astype(np.uint8) for name, image in images.items()}

    return changed(shot, cut)
