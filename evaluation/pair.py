"""Measure pairs of projectors that are not coaxial with the joint method, against one projector for all channels.

    python evaluation/pair.py [--half tune|report] [--method joint] [--only WORD ...] [--json FILE]

The infrared projector is turned and moved against the visible one, or stands beside it, 50 mm away and aimed at the
same place. Planes from 700 to 900 mm and scenes of quadfringe.evaluation.world are rendered at 1024 x 768 with 3 %
noise and 8 bit. Figures count pixels that both projectors light, at least 2 px from an edge. Of the pixels that one
projector alone lights, at least 2 px from an edge, the script counts those that are returned, and those of them whose
order is wrong. Tune on the half `tune`, and report the figures of the half `report`.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe import _core
from quadfringe.calibration.projector_pair import deviated
from quadfringe.data import core_device, device_from_core
from quadfringe.evaluation import world
from quadfringe.files import figures_text

HALVES = {"tune": world.TUNE, "report": world.REPORT}
DEPTHS_MM = (700.0, 750.0, 800.0, 850.0, 900.0)
SCENES = ("peaks", "steps", "face", "painted_face", "rods", "clutter")
TOE_DEG = float(np.degrees(np.arctan2(50.0, 800.0)))


@dataclass(frozen=True)
class Pose:
    """How the infrared projector stands in the frame of the visible one, and how many fringes it shows."""

    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    translation_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    number: float = 30.0


# Beside the visible projector, the infrared fringe number is that with 30 fringes along a camera ray, as coaxial.
PAIRS = {
    "coaxial": Pose(),
    "1 degree, 5 mm": Pose((1.0, 1.0, 1.0), (5.0, 5.0, 5.0)),
    "50 mm nearer": Pose((0.0, -TOE_DEG, 0.0), (50.0, 0.0, 0.0), 40.0),
    "50 mm farther": Pose((0.0, TOE_DEG, 0.0), (-50.0, 0.0, 0.0), 24.0),
    "50 mm above": Pose((TOE_DEG, 0.0, 0.0), (0.0, 50.0, 0.0)),
}
EDGE_PX = 2.0  # nearer pixels mix two sides of an edge
REPEATS = 7  # timed decodes

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Setup:
    """A bench, its calibration, and how its shots are decoded."""

    bench: _core.Bench
    calibration: qf.Calibration
    numbers: tuple[float, float, float]
    unwrapping: str

    @classmethod
    def named(cls, name: str) -> Setup:
        """Give the setup with this name of `PAIRS`."""
        reference = _core.Bench()
        camera, visible = device_from_core(reference.camera), device_from_core(reference.visible)
        pose = PAIRS[name]
        infrared = deviated(visible, pose.rotation_deg, pose.translation_mm)
        bench = _core.Bench(infrared=core_device(infrared))
        calibration = qf.Calibration(camera=camera, projector=visible, infrared=infrared)
        return cls(bench, calibration, (36.0, 35.0, pose.number), "coaxial" if name == "coaxial" else "pair")

    def decoder(self, shot: qf.Shot, method: str) -> qf.Decoder:
        """Give a decoder of linear light for shots like this one."""
        decode = qf.DecodeConfig.model_validate({"method": method, "unwrapping": self.unwrapping})
        width = self.calibration.projector.width_px
        return qf.Decoder(shot, qf.Plan(width, self.numbers, self.calibration, response="linear", decode=decode))

    def drawn(self, scene: str | float, seed: int) -> world.World:
        """Draw a scene of the world, or a plane at a depth in mm."""
        if isinstance(scene, str):
            drawn = world.SCENES[scene](self.bench, np.random.default_rng([seed, 77]))
            return replace(drawn, fringe_numbers=self.numbers)
        plane = self.bench.cast_plane(point_mm=(0.0, 0.0, scene), normal=(0.0, 0.0, -1.0))
        return world.World(plane, fringe_numbers=self.numbers)


def lit_by_one(cast: _core.Cast) -> dict[str, Mask]:
    """Give the pixels (H, W) that the visible projector alone lights, and those of the infrared one."""
    visible, infrared = (np.isfinite(cast.column_px(infrared=infrared)) for infrared in (False, True))
    inside = cast.edge_distance_px() >= EDGE_PX
    return {"visible": visible & ~infrared & inside, "infrared": infrared & ~visible & inside}


@dataclass(frozen=True)
class Figures:
    """Figures of one shape."""

    rms_mm: float
    p99_mm: float
    returned_percent: float  # of the pixels that both projectors light
    wrong_percent: float  # of these: order
    inside_2_percent: float
    alone_px: int  # pixels that one projector alone lights
    alone_returned_px: int
    alone_wrong_px: int  # returned and more than half an order off, or where the visible projector lights nothing


def judged(shape: qf.Shape, taken: world.Take, alone: dict[str, Mask]) -> Figures:
    """Compare a shape with the truth."""
    found = world.judge(shape, taken)
    returned = {name: shape.returned & mask for name, mask in alone.items()}
    off = np.abs(shape.phase_rad - taken.phase_rad) >= np.pi
    wrong = int((returned["visible"] & off).sum()) + int(returned["infrared"].sum())
    counts = [sum(int(mask.sum()) for mask in masks.values()) for masks in (alone, returned)]
    return Figures(
        found.rms_mm, found.p99_mm, found.returned_percent, found.wrong_percent, found.inside_2_percent, *counts, wrong
    )


def measured(
    name: str, scenes: tuple[str | float, ...], seeds: tuple[int, ...], method: str
) -> dict[str, list[Figures]]:
    """Decode the scenes of all seeds with one setup."""
    setup = Setup.named(name)
    found: dict[str, list[Figures]] = {}
    for scene in scenes:
        key = scene if isinstance(scene, str) else f"plane_{scene:.0f}mm"
        for seed in seeds:
            drawn = setup.drawn(scene, seed)
            taken = world.expose(setup.bench, drawn, seed)
            shape = setup.decoder(taken.shot, method).decode_without_verdict(taken.shot)
            found.setdefault(key, []).append(judged(shape, taken, lit_by_one(drawn.cast)))
    return found


def decode_ms(name: str, method: str) -> float:
    """Give the median time of a decode over all threads, ms: other work on the machine hardly changes it."""
    setup = Setup.named(name)
    shot = world.expose(setup.bench, setup.drawn("peaks", 2), 2).shot
    decoder = setup.decoder(shot, method)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        decoder.decode_without_verdict(shot)
        times.append(1e3 * (time.process_time() - start))
    return median(times[1:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--half", choices=HALVES, default="report")
    parser.add_argument("--method", default="joint")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="scenes whose name contains one of these words")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    every: tuple[str | float, ...] = (*DEPTHS_MM, *SCENES)
    named = {scene if isinstance(scene, str) else f"plane_{scene:.0f}mm": scene for scene in every}
    scenes = tuple(s for n, s in named.items() if options.only is None or any(word in n for word in options.only))
    figures: dict[str, float] = {}
    first: dict[str, float] = {}
    heads = f"{'RMS mm':>8}{'ratio':>7}{'99 %':>8}{'back %':>8}{'wrong %':>9}{'in 2 %':>8}"
    print(f"{'':32}{heads}  lit by one: px back wrong")
    for name in PAIRS:
        for scene, found in measured(name, scenes, HALVES[options.half], options.method).items():
            mean = {key: fmean(getattr(one, key) for one in found) for key in found[0].__dict__}
            ratio = mean["rms_mm"] / first.setdefault(scene, mean["rms_mm"])
            figures |= {f"{name}_{scene}_{key}": value for key, value in (mean | {"rms_ratio": ratio}).items()}
            print(
                f"{name:16}{scene:16}{mean['rms_mm']:8.4f}{ratio:7.3f}{mean['p99_mm']:8.3f}"
                f"{mean['returned_percent']:8.2f}{mean['wrong_percent']:9.4f}{mean['inside_2_percent']:8.2f}  "
                f"{mean['alone_px']:.0f} {mean['alone_returned_px']:.0f} {mean['alone_wrong_px']:.0f}",
                flush=True,
            )
        figures[f"{name}_ms"] = decode_ms(name, options.method)
        print(f"{name:16}decode of the peaks, all threads: {figures[f'{name}_ms']:.0f} ms", flush=True)
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
