"""Pairs of shapes of the virtual bench, one with a planted fault: what the comparison of shapes is judged by."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from quadfringe import _core
from quadfringe.data import Calibration, Shape
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.compare import ShapeComparison, compare
from quadfringe.errors import DecodeError
from quadfringe.evaluation import world
from quadfringe.scanner import open_system

__all__ = ["CAUSES", "REPORT", "TUNE", "Case", "Fault", "Half", "compared", "faults_of"]

NOISE = 0.03
SOUND_SEED = 1000  # added to the seed of the noise of the shot without a fault


@dataclass(frozen=True)
class Fault:
    """A fault by its cause, "" for none, its strength in words, and the options of the exposure that plant it."""

    cause: str
    strength: str
    options: dict[str, Any]


@dataclass(frozen=True)
class Half:
    """Scenes and seeds."""

    scenes: tuple[str, ...]
    seeds: tuple[int, ...]


@dataclass(frozen=True)
class Case:
    """A pair with a fault in its first shape, and its comparison."""

    fault: Fault
    scene: str
    seed: int
    found: ShapeComparison

    @property
    def right(self) -> bool:
        """Whether the fault comes first, or nothing is named for a sound pair."""
        names = [one.name for one in self.found.causes]
        return names[:1] == [self.fault.cause] if self.fault.cause else not names

    @property
    def alone(self) -> bool:
        """Whether nothing else is named either."""
        return self.right and len(self.found.causes) <= 1


TUNE = Half(("plane", "face", "steps"), (1, 3))
REPORT = Half(("peaks", "sphere", "painted_face"), (2, 4))


def _stray(strength: str, *pairs: tuple[int, int], share: float = 0.1) -> Fault:
    """Give crosstalk of channels (captured, projected), with a gain that clips no crest."""
    matrix = np.eye(4)
    for to, of in pairs:
        matrix[to, of] = share
    gain = (float(1 / matrix.sum(axis=1).max()),) * 4
    return Fault("crosstalk", strength, {"crosstalk": matrix.tolist(), "gain": gain})


def faults_of(cause: str) -> tuple[Fault, ...]:
    """Give the faults of a cause, from weak to strong."""
    return CAUSES[cause]


CAUSES: dict[str, tuple[Fault, ...]] = {
    "": (Fault("", "sound", {}),),
    "gamma": (
        *(Fault("gamma", f"{g:g}", {"projector_exponent": (g,) * 4}) for g in (1.1, 1.2, 1.4)),
        Fault("gamma", "1.2, visible alone", {"projector_exponent": (1.2, 1.2, 1.2, 1.0)}),
        Fault("gamma", "camera, 1 / 1.3", {"camera_exponent": (1.3,) * 4}),
    ),
    "crosstalk": (
        _stray("5 % green in red", (0, 1), share=0.05),
        _stray("10 % blue in red", (0, 2)),
        _stray("10 % ir in green", (1, 3)),
        _stray("10 % red in ir", (3, 0)),
        _stray("10 % visible", (0, 1), (1, 0), (1, 2), (2, 1)),
    ),
    "defocus": tuple(Fault("defocus", f"{s:g} px", {"blur_px": s}) for s in (2.0, 3.0, 5.0)),
}


def compared(fault: Fault, half: Half) -> Iterator[Case]:
    """Compare shots with the fault with sound ones; a shot that the decoder refuses gives no case."""
    bench = _core.Bench()
    with open_system() as scanner:
        calibration = scanner.calibration
    for scene in half.scenes:
        for seed in half.seeds:
            drawn = world.SCENES[scene](bench, np.random.default_rng([seed, 77]))
            options = drawn.options or {}
            try:
                faulty = _shape(bench, replace(drawn, options=options | fault.options), seed, calibration)
                sound = _shape(bench, drawn, seed + SOUND_SEED, calibration)
                yield Case(fault, scene, seed, compare(faulty, sound))
            except DecodeError:
                continue


def _shape(bench: _core.Bench, drawn: world.World, seed: int, calibration: Calibration | None) -> Shape:
    shot = world.expose(bench, drawn, seed, NOISE).shot
    plan = Plan(bench.visible.width, drawn.fringe_numbers, calibration, response="linear")
    return Decoder(shot, plan).decode(shot)
