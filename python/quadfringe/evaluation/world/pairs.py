"""Benches whose infrared projector is turned and moved against the visible one, or stands 50 mm away.

A `PairBench` has the name of one of `PAIRS`. It draws scenes of the world, or planes, and decodes their shots.
`judge_pair` compares a shape with the truth, on the pixels that both projectors light and on those that one alone does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.projector_pair import deviated
from quadfringe.config import DecodeConfig
from quadfringe.data import Calibration, Shape, Shot, core_device, device_from_core
from quadfringe.decoding import Decoder, Plan
from quadfringe.evaluation.world.judging import judge
from quadfringe.evaluation.world.scenes import EDGE_PX, SCENES, Take, World, expose

__all__ = ["PAIRS", "PairBench", "PairFigures", "PairTake", "Pose", "judge_pair"]

Mask = NDArray[np.bool_]
APART_MM, PLANE_MM = 50.0, 800.0
TOE_DEG = float(np.degrees(np.arctan2(APART_MM, PLANE_MM)))  # aims both projectors at one place of the plane


@dataclass(frozen=True)
class Pose:
    """How the infrared projector stands in the frame of the visible one, and how many fringes it shows."""

    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    translation_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    infrared_number: float = 30.0


# Nearer to the camera than the visible projector, or farther, the infrared projector shows about 30 fringes along a
# camera ray, as a coaxial one does.
PAIRS = {
    "coaxial": Pose(),
    "1 degree, 5 mm": Pose((1.0, 1.0, 1.0), (5.0, 5.0, 5.0)),
    "50 mm nearer": Pose((0.0, -TOE_DEG, 0.0), (APART_MM, 0.0, 0.0), 40.0),
    "50 mm farther": Pose((0.0, TOE_DEG, 0.0), (-APART_MM, 0.0, 0.0), 24.0),
    "50 mm above": Pose((TOE_DEG, 0.0, 0.0), (0.0, APART_MM, 0.0)),
}


@dataclass(frozen=True)
class PairTake:
    """A shot and its truth, and the pixels (H, W) that one projector alone lights, away from edges."""

    take: Take
    by_visible: Mask
    by_infrared: Mask


@dataclass(frozen=True)
class PairFigures:
    """Figures of one shape: of pixels that both projectors light, and numbers of pixels that one alone lights."""

    rms_mm: float
    p99_mm: float
    returned_percent: float
    wrong_percent: float
    inside_2_percent: float
    alone_px: int
    alone_returned_px: int
    alone_wrong_px: int  # returned with a wrong order, or where the visible projector lights nothing


@dataclass(frozen=True)
class PairBench:
    """A bench, its calibration, and how its shots are decoded."""

    bench: _core.Bench
    calibration: Calibration
    numbers: tuple[float, float, float]
    unwrapping: str

    @classmethod
    def named(cls, name: str, infrared_number: float | None = None) -> PairBench:
        """Give the bench with this name of `PAIRS`; another infrared fringe number replaces that of its pose."""
        reference, pose = _core.Bench(), PAIRS[name]
        camera, visible = device_from_core(reference.camera), device_from_core(reference.visible)
        infrared = deviated(visible, pose.rotation_deg, pose.translation_mm)
        return cls(
            bench=_core.Bench(infrared=core_device(infrared)),
            calibration=Calibration(camera=camera, projector=visible, infrared=infrared),
            numbers=(36.0, 35.0, infrared_number or pose.infrared_number),
            unwrapping="coaxial" if name == "coaxial" else "pair",
        )

    def take(self, scene: str | float, seed: int) -> PairTake:
        """Expose a scene of the world, or a plane at this depth in mm."""
        world = self._world(scene, seed)
        taken = expose(self.bench, world, seed)
        visible, infrared = (np.isfinite(world.cast.column_px(infrared=infrared)) for infrared in (False, True))
        inside = taken.edge_distance_px >= EDGE_PX
        return PairTake(taken, visible & ~infrared & inside, infrared & ~visible & inside)

    def decoder(self, shot: Shot, **settings: object) -> Decoder:
        """Give a decoder of linear light for shots like this one."""
        decode = DecodeConfig.model_validate({"unwrapping": self.unwrapping, **settings})
        width = self.calibration.projector.width_px
        return Decoder(shot, Plan(width, self.numbers, self.calibration, response="linear", decode=decode))

    def _world(self, scene: str | float, seed: int) -> World:
        if isinstance(scene, str):
            drawn = SCENES[scene](self.bench, np.random.default_rng([seed, 77]))
            return replace(drawn, fringe_numbers=self.numbers)
        plane = self.bench.cast_plane(point_mm=(0.0, 0.0, scene), normal=(0.0, 0.0, -1.0))
        return World(plane, fringe_numbers=self.numbers)


def judge_pair(shape: Shape, taken: PairTake) -> PairFigures:
    """Compare a calibrated shape with the truth; raises ValueError for a shape without millimetres."""
    found = judge(shape, taken.take)
    off = np.abs(shape.phase_rad - taken.take.phase_rad) >= np.pi
    visible, infrared = (shape.returned & alone for alone in (taken.by_visible, taken.by_infrared))
    return PairFigures(
        rms_mm=found.rms_mm,
        p99_mm=found.p99_mm,
        returned_percent=found.returned_percent,
        wrong_percent=found.wrong_percent,
        inside_2_percent=found.inside_2_percent,
        alone_px=int(taken.by_visible.sum() + taken.by_infrared.sum()),
        alone_returned_px=int(visible.sum() + infrared.sum()),
        alone_wrong_px=int((visible & off).sum() + infrared.sum()),
    )
