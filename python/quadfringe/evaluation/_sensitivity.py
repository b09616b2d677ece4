"""How the results of the joint method change with its tuned numbers: the shots, and the rows of the table."""

from __future__ import annotations

import os
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from statistics import fmean, geometric_mean
from typing import NamedTuple

import numpy as np

from quadfringe.config import Fringes, ResponseChoice, SystemConfig
from quadfringe.data import Shot
from quadfringe.decoding import Decoder, Plan
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring, world
from quadfringe.evaluation._isolated import isolated
from quadfringe.evaluation._saturated import overexposed
from quadfringe.evaluation._tunable import FIXED, PARAMS, Number
from quadfringe.evaluation._tunable import numbers as tuned_numbers
from quadfringe.evaluation._variants import stepped
from quadfringe.evaluation.world.pairs import PairBench
from quadfringe.scanner import open_system

__all__ = ["MOTION", "SCENES", "Figures", "Given", "changes", "figures_of", "listed", "rows", "shots"]

SEED = world.TUNE[0]
FACTORS = {"half": 0.5, "twice": 2.0}
CHANCES, CHANCE = 16, 1.001
# Least change that is listed: share of an RMS, and percentage points.
LEAST = {"RMS": 0.03, "returned": 0.1, "wrong": 0.02}
MOTION = "motion"  # params file without a shot
LISTED = 3  # changes of one number and factor
SCENES = {
    "white": ("face", "steps", "peaks"),
    "patches": ("face_patches_20", "peaks_patches_20"),
    "print": ("painted_face",),
    "photographs": ("photographs_peaks", "photographs_face"),
    "rods, clutter": ("rods", "clutter"),
    "cloth, coin": ("cloth", "coin"),
    "9 and 78 px": ("fringes_9px", "fringes_78px"),
}
# Surface, period in px, share of the frame, seed.
SMALL = (("face", 110, 0.02, 31), ("steps", 110, 0.02, 33), ("sphere", 74, 0.02, 31))
EXPOSURE = 1.6  # times as long
THREE = Fringes(encoding="rgb", numbers=(36, 35, 30))
TWO = Fringes(encoding="rgb", numbers=(16, 15))

Key = tuple[str, str]  # group, and figure as in LEAST
Figures = dict[Key, float]


class Judged(NamedTuple):
    """Figures of one shape: RMS phase error of right orders, and shares of pixels."""

    error_rad: float
    returned_percent: float
    wrong_percent: float  # of returned


@dataclass(frozen=True)
class Given:
    """A shot, how it is decoded, and its truth: phase in rad and counted pixels, (H, W)."""

    shot: Shot
    plan: Plan
    phase_rad: scoring.Map
    counted: scoring.Mask

    def judged(self) -> Judged:
        """Decode the shot and compare its phase with the truth."""
        shape = Decoder(self.shot, self.plan).decode_without_verdict(self.shot)
        off_rad = np.abs(shape.phase_rad - self.phase_rad)[shape.returned & self.counted]
        right = off_rad[off_rad < np.pi]
        returned, wrong = off_rad.size / int(self.counted.sum()), 1 - right.size / max(1, off_rad.size)
        return Judged(scoring.rms(right), 100 * returned, 100 * wrong)


def of_world(name: str, fringes: Fringes | None = None, exposure: float = 1.0) -> Given:
    """Draw a scene of the world."""
    taken = world.take(name, SEED, numbers=fringes.code if fringes else None)
    with open_system(SystemConfig()) as scanner:
        known = scanner.calibration
    assert known is not None
    shot = taken.shot if exposure == 1.0 else overexposed(taken.shot, exposure)
    plan = Plan(known.projector.width_px, fringes or taken.fringe_numbers, known, response="linear")
    return Given(shot, plan, taken.phase_rad, taken.counted)


def of_pair() -> Given:
    """Draw steps in front of an infrared projector that stands 50 mm above the visible one."""
    bench = PairBench.named("50 mm above")
    taken = bench.take("steps", SEED).take
    return Given(taken.shot, bench.decoder(taken.shot).plan, taken.phase_rad, taken.counted)


def of_scene(scene: scoring.Scene, response: ResponseChoice = "linear") -> Given:
    """Take an object on black, or a capture."""
    shot, plan = scenes.plan_of(scene, response=response)
    return Given(shot, plan, scene.phase_rad, scene.scored)


def shots() -> Iterator[tuple[str, Given]]:
    """Give each shot with the name of its group."""
    for group, names in SCENES.items():
        for name in names:
            yield group, of_world(name)
    for surface, period_px, share, seed in SMALL:
        yield "small", of_scene(isolated(period_px, share, seed, surface=surface))
    yield "saturated", of_world("face", exposure=EXPOSURE)
    yield "pair", of_pair()
    yield "three colours", of_world("face", THREE)
    yield "two numbers", of_world("face", TWO)
    for name in scenes.CAPTURES:
        data = scenes.data_folder()
        yield name, of_scene(stepped(data, name, SEED), scenes.response_of(data, name))


def figures_of(given: Iterable[tuple[str, Given]]) -> Figures:
    """Decode shots with their groups, and give the means of each group."""
    found: dict[str, list[Judged]] = defaultdict(list)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for group, one in given:
            found[group].append(one.judged())
    figures: Figures = {}
    for group, judged in found.items():
        # A geometric mean, so that each shot counts by its relative change.
        figures[group, "RMS"] = geometric_mean(one.error_rad for one in judged)
        figures[group, "returned"] = fmean(one.returned_percent for one in judged)
        figures[group, "wrong"] = fmean(one.wrong_percent for one in judged)
    return figures


def changes(figures: Figures, base: Figures) -> Figures:
    """Give the changes: relative ones of an RMS, others as differences."""
    return {key: figures[key] / base[key] - 1 if key[1] == "RMS" else figures[key] - base[key] for key in base}


def listed(figures: Figures | None, base: Figures, chance: Figures) -> str:
    """Give the words for the changes that count."""
    if figures is None:
        return "fails"
    found = {key: change for key, change in changes(figures, base).items() if abs(change) > chance[key]}
    greatest = sorted(found, key=lambda key: -abs(found[key]) / LEAST[key[1]])[:LISTED]
    return "; ".join(worded(key, found[key]) for key in greatest) or "none"


def worded(key: Key, change: float) -> str:
    """Give the words for one change."""
    group, figure = key
    return f"{group} {100 * change:+.0f} %" if figure == "RMS" else f"{group} {change:+.2f} {figure}"


def rows(numbers: Iterable[Number], measured: Callable[[str], Figures | None]) -> Iterator[tuple[str, ...]]:
    """Give the row of each number; `measured` gives the figures with a change such as `energy::SIDE*2`."""
    numbers = list(numbers)
    varied = [number.key for number in numbers if number.key not in FIXED]
    every = [number.key for number in tuned_numbers(PARAMS) if number.key not in FIXED]
    tries = [f"{key}*{CHANCE}" for key in every[:: max(1, len(every) // CHANCES)]]
    specs = [f"{key}*{factor}" for key in varied for factor in FACTORS.values()]
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        base, *found = threads.map(measured, ["", *tries, *specs])
    assert base is not None
    by_chance = [changes(one, base) for one in found[: len(tries)] if one is not None]
    chance = {key: max(LEAST[key[1]], *(abs(one[key]) for one in by_chance)) for key in base}
    of = dict(zip(specs, found[len(tries) :], strict=True))
    for number in numbers:
        cells = (
            "not varied" if number.key not in varied else listed(of[f"{number.key}*{factor}"], base, chance)
            for factor in FACTORS.values()
        )
        yield number.key.replace("::", " "), number.value, number.meaning, *cells
