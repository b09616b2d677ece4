"""What three colours lose against four channels: the scenes of `world`, and shots made of the real captures.

Three colours have three fringe numbers, or two with red and blue in quadrature. The comparison is at the same fringe
period: 36, 35 and 30 fringes with infrared and without, and 16, 15 and 12 with infrared against 16 and 15 without.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from quadfringe.config import Fringes
from quadfringe.data import Calibration, Shape, Shot
from quadfringe.decoding import Decoder, Plan
from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import world
from quadfringe.evaluation.scoring import Scene, rms

__all__ = ["CODES", "SAME_PERIOD", "Captured", "capture_shot", "captures", "captures_of_three", "figures_of"]

# The fringes that are compared: those of the paper and as many in three colours; 16 with infrared, and 16 without.
CODES: dict[str, Fringes] = {
    "paper": Fringes(),
    "four": Fringes(numbers=(16, 15, 12)),
    "three": Fringes(encoding="rgb", numbers=(36, 35, 30)),
    "two": Fringes(encoding="rgb", numbers=(16, 15)),
}
# The encodings with and without infrared at the same fringe period.
SAME_PERIOD = {"three": "paper", "two": "four"}
# Ranges of columns that light the objects of the captures. R and B with G repeat after 15 fringes of 42 columns.
RANGES = {"plate": ((249, 879), (782, 1412)), "bottle": ((0, 630), (455, 1085), (910, 1540))}


def figures_of(
    name: str, fringes: Fringes, calibration: Calibration, seeds: tuple[int, ...], method: str = "joint"
) -> dict[str, float]:
    """Give the figures of `world.judge`, and the phase error of the right orders in rad, as means over the seeds."""
    found = [_figures(world.take(name, seed, numbers=fringes.code), fringes, calibration, method) for seed in seeds]
    return {key: fmean(one[key] for one in found) for key in found[0]}


def _figures(taken: world.Take, fringes: Fringes, calibration: Calibration, method: str) -> dict[str, float]:
    shape = _decoded(taken, fringes, calibration, method)
    error = (shape.phase_rad - taken.phase_rad)[shape.returned & taken.counted]
    return asdict(world.judge(shape, taken)) | {"phase_rms_rad": rms(error[np.abs(error) < np.pi])}


def _decoded(taken: world.Take, fringes: Fringes, calibration: Calibration, method: str) -> Shape:
    """Decode without a verdict, because a refused shot would have no figures."""
    decode = {"method": method}
    plan = Plan(calibration.projector.width_px, fringes, calibration, response="linear", decode=decode)
    return Decoder(taken.shot, plan).decode_without_verdict(taken.shot)


@dataclass(frozen=True)
class Captured:
    """Pixels of the object of a capture within the known columns: all, returned, and with the right order."""

    pixels: int
    returned: int
    right: int

    @property
    def right_percent(self) -> float:
        """Right orders; a missing pixel counts as wrong."""
        return 100 * self.right / self.pixels

    @property
    def right_of_returned_percent(self) -> float:
        """Right orders of the returned pixels."""
        return 100 * self.right / max(1, self.returned)


def captures(data: Path, **settings: Any) -> Iterator[tuple[str, Captured]]:
    """Decode the red, green and blue images of each capture, one range of known columns after the other."""
    for name, ranges in RANGES.items():
        scene = scenes.capture(data, name)
        parts = [_captured(scene, columns_px, settings) for columns_px in ranges]
        yield name, Captured(*(sum(getattr(part, key) for part in parts) for key in ("pixels", "returned", "right")))


def captures_of_three(data: Path, **settings: Any) -> Iterator[tuple[str, Captured]]:
    """Decode each capture as three colours of different fringe numbers; its infrared image stands for blue."""
    for name in RANGES:
        scene = scenes.capture(data, name)
        fringes = Fringes(encoding="rgb", numbers=scene.fringe_numbers)
        assert scene.ir is not None, "captures have infrared"
        yield name, _scored(scene, Shot(scene.red, scene.green, scene.ir), fringes, scene.scored, settings)


def capture_shot(scene: Scene, columns_px: tuple[float, float]) -> Shot:
    """Give the colours of a capture as if the projector lit with these columns only."""
    lit = _lit(scene, columns_px)
    red, green, blue = (np.where(lit, image, 0).astype(image.dtype) for image in (scene.red, scene.green, scene.blue))
    return Shot(red, green, blue)


def _lit(scene: Scene, columns_px: tuple[float, float]) -> Any:
    column_px = scene.phase_rad * scene.projector_width / (2 * np.pi * scene.fringe_numbers[0])
    return (column_px >= columns_px[0]) & (column_px < columns_px[1])


def _captured(scene: Scene, columns_px: tuple[float, float], settings: dict[str, Any]) -> Captured:
    fringes = Fringes(encoding="rgb", numbers=scene.fringe_numbers[:2], columns_px=columns_px)
    return _scored(scene, capture_shot(scene, columns_px), fringes, scene.scored & _lit(scene, columns_px), settings)


def _scored(scene: Scene, shot: Shot, fringes: Fringes, scored: Any, settings: dict[str, Any]) -> Captured:
    try:
        phase_rad = Decoder(shot, Plan(scene.projector_width, fringes, decode=settings)).decode(shot).phase_rad
    except DecodeError:
        return Captured(int(scored.sum()), 0, 0)
    returned = np.isfinite(phase_rad) & scored
    right = returned & (np.abs(phase_rad - scene.phase_rad) < np.pi)
    return Captured(*(int(np.count_nonzero(mask)) for mask in (scored, returned, right)))
