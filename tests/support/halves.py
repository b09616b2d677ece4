"""Shots of the scenes of the virtual bench by a camera of half the size, with changed images."""

from __future__ import annotations

from functools import cache

import numpy as np

import quadfringe as qf
from quadfringe.evaluation import broken


@cache
def half_plan(*, whole: bool = False) -> qf.Plan:
    """Give the plan of the virtual bench for a camera of half the size, or for that of the bench."""
    with qf.open(qf.SystemConfig()) as scanner:
        assert scanner.calibration is not None
        known = scanner.calibration
        return qf.Plan(912, calibration=known if whole else known.model_copy(update={"camera": broken.HALF}))


def half_shot(scene: str, seed: int, numbers: tuple[float, ...] | None = None, *, whole: bool = False) -> qf.Shot:
    """Draw a scene with 2 % noise, `whole` at the size of the camera of the bench."""
    return broken.exposed(scene, seed, broken.Fault("", numbers=numbers), half=not whole)


def changed(shot: qf.Shot, change: broken.Change) -> qf.Shot:
    """Change the images of a shot by name."""
    images = change(dict(shot.channels))
    return qf.Shot(*(np.ascontiguousarray(images[name]) for name in ("red", "green", "blue", "ir")))
