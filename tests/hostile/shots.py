"""Decode shots that hold no measurement, or another one: each is refused with its cause, or its orders are right.

The scenes are those of the virtual bench with a small part of its camera; the truth tells which orders are wrong.
"""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe.config import Device
from quadfringe.data import Calibration
from quadfringe.errors import DecodeError, DecodeWarning

__all__ = ["CASES", "METHODS", "ShotOutcome", "hostile_shots"]

METHODS = ("joint", "published")
CAMERA = Device(width_px=192, height_px=144, focal_px=(1290.0, 1290.0), centre_px=(95.5, 71.5))
SURFACES = ("plane", "peaks", "face", "steps", "sphere")
NUMBERS = (36.0, 35.0, 30.0)
OTHER_NUMBERS = ((49.0, 48.0, 42.0), (64.0, 63.0, 56.0), (25.0, 24.0, 20.0), (81.0, 80.0, 72.0))
CHANNELS = ("red", "green", "blue", "ir")
WRONG_SHARE = 1e-3  # of all pixels of a shape that is returned

Images = dict[str, NDArray[Any]]
Map = NDArray[np.float32]


@dataclass(frozen=True)
class Case:
    """How a sound shot is spoilt, and the causes that name it; `measures` when the orders of the truth stay right."""

    spoil: Callable[[Images, np.random.Generator], Images]
    causes: tuple[str, ...]
    measures: bool = False
    full_scale: float = 255.0


@dataclass(frozen=True)
class ShotOutcome:
    """What a decoder made of a shot: the reason of a refusal, or the share of the pixels with a wrong order."""

    case: str
    method: str
    seed: int
    reason: str
    wrong: float = 0.0
    words: str = ""

    @property
    def named(self) -> bool:
        return self.reason in CASES[self.case].causes

    @property
    def fault(self) -> bool:
        """Whether it failed, returned wrong orders, or was refused for a cause that it does not have."""
        misnamed = self.reason != "returned" and not self.named
        return misnamed or self.wrong > WRONG_SHARE


def _dark(images: Images, random: np.random.Generator) -> Images:
    level = float(random.uniform(0.0, 0.02))
    return {
        name: np.clip(random.normal(255 * level, 1.0, i.shape), 0, 255).astype(np.uint8) for name, i in images.items()
    }


def _saturated(images: Images, random: np.random.Generator) -> Images:
    gain = float(random.uniform(6.0, 60.0))
    return {name: np.clip(i * gain, 0, 255).astype(np.uint8) for name, i in images.items()}


def _nan(images: Images, random: np.random.Generator) -> Images:
    """Make some or all pixels of one or more channels no number."""
    light = {name: (i / 255).astype(np.float32) for name, i in images.items()}
    share = float(random.choice([0.01, 0.3, 1.0]))
    for name in random.choice(CHANNELS, int(random.integers(1, 5)), replace=False):
        light[name][random.random(light[name].shape) < share] = random.choice([np.nan, np.inf, -np.inf])
    return light


def _noise(images: Images, random: np.random.Generator) -> Images:
    low, high = sorted(random.integers(0, 256, 2))
    return {name: random.integers(low, high + 1, i.shape).astype(np.uint8) for name, i in images.items()}


def _missing(images: Images, random: np.random.Generator) -> Images:
    """Leave out the light of one channel: black, white, even, or noise."""
    name = str(random.choice(CHANNELS))
    level = int(random.choice([0, 255, int(random.integers(6, 250))]))
    even = np.clip(random.normal(level, float(random.choice([0, 3])), images[name].shape), 0, 255)
    return {**images, name: even.astype(np.uint8)}


def _mirrored(images: Images, random: np.random.Generator) -> Images:
    turn = bool(random.integers(2))
    return {n: np.ascontiguousarray(i[::-1, ::-1] if turn else i[:, ::-1]) for n, i in images.items()}


def _as_given(images: Images, _: np.random.Generator) -> Images:
    return images


CASES = {
    "all dark": Case(_dark, ("blind channel", "brightness")),
    "saturated": Case(_saturated, ("saturation", "blind channel"), measures=True),
    "no number": Case(_nan, ("not finite",), full_scale=1.0),
    "noise only": Case(_noise, ("no fringes", "fringe orders", "blind channel", "brightness")),
    "channel missing": Case(_missing, ("blind channel", "no fringes", "fringe orders")),
    "mirrored": Case(_mirrored, ("mirrored or rotated",)),
    "wrong code": Case(_as_given, ("fringe numbers", "fringe orders")),
}


def hostile_shots(case: str, method: str, seeds: range) -> Iterator[ShotOutcome]:
    """Decode spoilt shots of a case, one for each seed, with the calibration of the bench."""
    for seed in seeds:
        random = np.random.default_rng(seed)
        images, truth, calibration = _sound(random, seed)
        spoilt = CASES[case].spoil(images, random)
        numbers = OTHER_NUMBERS[int(random.integers(len(OTHER_NUMBERS)))] if case == "wrong code" else NUMBERS
        shot = qf.Shot(*(spoilt[name] for name in CHANNELS), CASES[case].full_scale)
        yield _decoded(case, method, seed, shot, qf.Plan(912, numbers, calibration, decode={"method": method}), truth)


def _sound(random: np.random.Generator, seed: int) -> tuple[Images, Map, Calibration]:
    noise = float(random.uniform(0.002, 0.03))
    scene = {"surface": str(random.choice(SURFACES)), "noise": noise, "seed": seed}
    if random.random() < 0.3:
        scene["patch_mm"] = float(random.uniform(8, 30))
    with qf.open(qf.SystemConfig(camera=CAMERA, scene=qf.SceneConfig.model_validate(scene))) as scanner:
        shot = scanner.grab()
        assert isinstance(shot, qf.Shot)
        assert shot.truth is not None
        return shot.channels, shot.truth.column_px, scanner.calibration


def _decoded(case: str, method: str, seed: int, shot: qf.Shot, plan: qf.Plan, truth: Map) -> ShotOutcome:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DecodeWarning)
            shape = qf.decode(shot, plan)
    except DecodeError as error:
        return ShotOutcome(case, method, seed, error.reason, words=str(error))
    except ValueError as error:
        reason = "not finite" if "values that are not finite" in str(error) else "traceback"
        return ShotOutcome(case, method, seed, reason, words=str(error))
    except Exception:  # noqa: BLE001 - to find any is what the attack is for
        return ShotOutcome(case, method, seed, "traceback", words=traceback.format_exc())
    right = np.abs(shape.column_px - truth) < 0.5 * 912 / NUMBERS[0]
    wrong = shape.returned & ~(right & CASES[case].measures)
    return ShotOutcome(case, method, seed, "returned", float(wrong.mean()), "; ".join(shape.warnings))
