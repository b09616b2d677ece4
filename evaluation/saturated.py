"""Accuracy of shots that were exposed too long, and in highlights, as one table.

    python evaluation/saturated.py [--half tune|report] [--only SCENE ...]

The intensities of scenes of quadfringe.evaluation.world, and of the real captures, are multiplied by a factor and cut
off at full scale. `sat 1` and `sat 2` are the shares of the pixels with at least one and two saturated channels, `tile`
the greatest share of a tile of 32 px with a saturated channel and two that are not, over all seeds. Errors
of scenes are those of returned pixels with the right order, in mm; those of captures are phases in rad. Highlights
have a radius in px and a gain: their light is up to 1 + gain times that of the scene; figures are those inside.
Returned and
wrong are shares of the lit pixels; of captures, right of object and wrong among returned. Each row is the mean of
the seeds of a half; the numbers of the method were chosen on the half `tune`.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, replace
from pathlib import Path
from statistics import fmean

import numpy as np

import quadfringe as qf
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import world
from quadfringe.evaluation._saturated import Highlight, fullest_tile, overexposed, saturated_share
from quadfringe.evaluation._variants import stepped

HALVES = {"tune": world.TUNE, "report": world.REPORT}
OFFSETS = {"tune": (4, 10), "report": (1, 7)}  # steps of the captures
SCENES = ("face", "steps", "painted_face", "glossy_face", "peaks_patches_20", "clutter")
FACTORS = (1.0, 1.15, 1.3, 1.6)
SHINY = ("face", "steps", "painted_face")
HIGHLIGHTS = tuple(Highlight((500.0, 384.0), *spot) for spot in ((25.0, 2.0), (45.0, 2.0), (45.0, 4.0), (90.0, 3.0)))
COLUMNS = (
    f"{'':18}{'times':>6}{'sat 1 %':>9}{'sat 2 %':>9}{'tile %':>8}"
    f"{'RMS':>9}{'median':>9}{'99 %':>8}{'back %':>8}{'wrong %':>9}"
)


def row(name: str, times: str, shots: list[qf.Shot], figures: list[dict[str, float]]) -> str:
    """Give one line of the table, the mean of some shots."""
    one, two, _ = 100 * np.mean([saturated_share(shot) for shot in shots], axis=0)
    tile = 100 * max(fullest_tile(shot) for shot in shots)
    mean = {key: fmean(figure[key] for figure in figures) for key in figures[0]}
    return (
        f"{name:18}{times:>6}{one:9.1f}{two:9.1f}{tile:8.1f}{mean['rms']:9.4f}{mean['median']:9.4f}{mean['p99']:8.3f}"
        f"{mean['returned']:8.2f}{mean['wrong']:9.4f}"
    )


def of_world(name: str, factor: float, seeds: tuple[int, ...], calibration: qf.Calibration) -> str:
    """Measure a scene of the virtual bench."""
    takes = [world.take(name, seed) for seed in seeds]
    shots = [overexposed(taken.shot, factor) for taken in takes]
    return of_takes(name, f"{factor:.2f}", takes, shots, calibration)


def of_highlight(name: str, spot: Highlight, seeds: tuple[int, ...], calibration: qf.Calibration) -> str:
    """Measure a scene of the virtual bench inside a highlight."""
    takes = [world.take(name, seed) for seed in seeds]
    shots = [spot.on(taken.shot) for taken in takes]
    takes = [replace(taken, lit=taken.lit & spot.inside(taken.lit.shape)) for taken in takes]
    return of_takes(name, f"{spot.radius_px:.0f}/{spot.gain:.0f}", takes, shots, calibration)


def of_takes(name: str, times: str, takes: list[world.Take], shots: list[qf.Shot], calibration: qf.Calibration) -> str:
    """Measure shots of the virtual bench where their takes are lit."""
    plan = qf.Plan(calibration.projector.width_px, calibration=calibration, response="linear")
    figures = []
    for taken, shot in zip(takes, shots, strict=True):
        judged = asdict(world.judge(qf.Decoder(shot, plan).decode_without_verdict(shot), taken))
        figures.append({key.removesuffix("_mm").removesuffix("_percent"): value for key, value in judged.items()})
    return row(name, times, shots, figures)


def of_capture(data: Path, name: str, factor: float, offsets: tuple[int, ...]) -> str:
    """Measure a real capture, whose response is left as it is."""
    shots, figures = [], []
    for offset in offsets:
        scene = stepped(data, name, offset)
        shot = overexposed(qf.Shot(scene.red, scene.green, scene.blue, scene.ir), factor)
        shape = scenes.shape_of(replace(scene, **shot.channels), response="linear")
        error = np.where(scene.scored, shape.phase_rad - scene.phase_rad, np.nan)
        returned, right = np.isfinite(error), np.abs(error) < np.pi
        errors = np.abs(error[right])
        shots.append(shot)
        figures.append(
            {
                "rms": float(np.sqrt(np.mean(errors**2))),
                "median": float(np.median(errors)),
                "p99": float(np.percentile(errors, 99)),
                "returned": float(100 * right.sum() / scene.scored.sum()),
                "wrong": float(100 * (1 - right.sum() / returned.sum())),
            }
        )
    return row(name, f"{factor:.2f}", shots, figures)


def main() -> None:
    """Print errors, returned and wrong pixels of scenes and captures over the exposure, and in highlights."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--half", choices=HALVES, default="report")
    parser.add_argument("--only", nargs="+", metavar="SCENE", default=[*SCENES, *scenes.CAPTURES])
    options = parser.parse_args()
    with qf.open(qf.SystemConfig()) as scanner:
        calibration = scanner.calibration
    print(COLUMNS)
    for name in options.only:
        for factor in FACTORS:
            if name in scenes.CAPTURES:
                print(of_capture(scenes.data_folder(), name, factor, OFFSETS[options.half]), flush=True)
            else:
                print(of_world(name, factor, HALVES[options.half], calibration), flush=True)
    for name in (name for name in options.only if name in SHINY):
        for spot in HIGHLIGHTS:
            print(of_highlight(name, spot, HALVES[options.half], calibration), flush=True)


if __name__ == "__main__":
    main()
