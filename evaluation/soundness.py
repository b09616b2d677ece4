"""Tell sound shots of small objects from broken ones: how many of either are refused, and what the others return.

    python evaluation/soundness.py [--seeds N ...] [--only FAULT ...]

Objects on black fill 2 and 6 % of the frame and are one to six fringes wide. A shot is sound, or has two channels
exchanged, another order of all channels, the same image twice, infrared moved by 4 to 20 px, other fringe numbers than
it is decoded with, or noise in place of fringes. A broken shot is returned wrong if more than 2 % of its returned
pixels have a wrong order.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from statistics import fmean

import numpy as np

from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._isolated import isolated
from quadfringe.evaluation.scoring import Scene

CHANNELS = ("red", "green", "blue", "ir")
SURFACES = ("steps", "face", "sphere", "peaks")
# Fringe period in px, share of the frame.
OBJECTS = ((33, 0.02), (74, 0.02), (110, 0.02), (110, 0.06))
RIGHT_MIN_PERCENT = 98.0


def noise(scene: Scene) -> Scene:
    random, bright = np.random.default_rng(1), scene.red > 60
    light = {name: random.integers(60, 200, bright.shape) for name in CHANNELS}
    return replace(scene, **{name: np.where(bright, image, 3).astype(np.uint8) for name, image in light.items()})


def exchanged(first: str, second: str) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, **{first: getattr(scene, second), second: getattr(scene, first)})


def moved(shift_px: int) -> Callable[[Scene], Scene]:
    def fault(scene: Scene) -> Scene:
        assert scene.ir is not None
        return replace(scene, ir=np.roll(scene.ir, shift_px, axis=1))

    return fault


def all_exchanged(scene: Scene) -> Scene:
    assert scene.ir is not None
    return replace(scene, red=scene.green, green=scene.blue, blue=scene.ir, ir=scene.red)


def numbered(*numbers: float) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, fringe_numbers=numbers)


FAULTS: dict[str, Callable[[Scene], Scene]] = {
    "sound": lambda scene: scene,
    **{f"{first} and {second}": exchanged(first, second) for first, second in combinations(CHANNELS, 2)},
    "all exchanged": all_exchanged,
    "red twice": lambda scene: replace(scene, green=scene.red),
    **{f"ir by {shift_px} px": moved(shift_px) for shift_px in (4, 8, -12, 20)},
    "25, 24, 20": numbered(25.0, 24.0, 20.0),
    "37, 36, 31": numbered(37.0, 36.0, 31.0),
    "49, 48, 42": numbered(49.0, 48.0, 42.0),
    "64, 63, 56": numbered(64.0, 63.0, 56.0),
    "noise": noise,
}


def judged(scene: Scene) -> scoring.Score | None:
    try:
        return scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    except DecodeError:
        return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seeds", nargs="+", type=int, metavar="N", default=[61, 62])
    parser.add_argument("--only", nargs="+", choices=list(FAULTS), default=list(FAULTS))
    options = parser.parse_args()
    print(f"{'':16}{'shots':>7}{'refused':>9}{'wrong':>7}{'right, %':>10}")
    for fault in options.only:
        objects = [(surface, *kind, seed) for surface in SURFACES for kind in OBJECTS for seed in options.seeds]
        found = [
            judged(FAULTS[fault](isolated(period, share, seed, surface=name))) for name, period, share, seed in objects
        ]
        scores = [score for score in found if score is not None]
        wrong = sum(score.right_of_returned_percent < RIGHT_MIN_PERCENT for score in scores)
        right = fmean(score.right_percent for score in scores) if scores else np.nan
        print(f"{fault:16}{len(found):7}{len(found) - len(scores):9}{wrong:7}{right:10.2f}", flush=True)


if __name__ == "__main__":
    main()
