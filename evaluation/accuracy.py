"""Accuracy of both methods as one table: noise, texture, edges, depth, real captures, and the bound that noise sets.

    python evaluation/accuracy.py [--json FILE] [--data FOLDER]

- peaks: the shot of `quadfringe reproduce peaks`, 3 % noise (sigma 0.03 of full scale), rounded to 8 bit; phase RMS in
  rad over the field without a border of one fringe.
- peaks_patches: the same with coloured squares of 20 mm.
- peaks_shades: the same with smooth shades, waves of 150 to 500 pixels that differ from channel to channel.
- peaks_printed: the shades times patches with sharp borders and random colours, nearly clear in the infrared.
- plane, steps, sphere, face: shots of the virtual bench at about 800 mm, 3 % noise, 8 bit; lit pixels returned, wrong
  orders among returned, and depth RMS a fringe away from edges, borders and shadows, wrong orders included.
- captures: real shots, scored as in evaluation/captures_report.py; left out without the test data.
- efficiency: phase variance over the Cramer-Rao bound at the same spatial resolution, defined in
  quadfringe.evaluation.efficiency.

All seeds are fixed. Each figure of a bench shot is over the seeds 1, 2 and 3 together.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from captures_report import capture_scores
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe import _core
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._textures import TEXTURES
from quadfringe.evaluation.efficiency import Images, efficiency
from quadfringe.evaluation.machine import described
from quadfringe.evaluation.reproduce import WIDTH_PX, inside

METHODS = ("published", "joint")
NOISE = 0.03
SEEDS = (1, 2, 3)
FRINGE_PX = 28
SURFACES = ("plane", "steps", "sphere", "face")
EFFICIENCY_SURFACES = ("plane", "peaks")
FRINGES = qf.Fringes().numbers
RATIOS = (1.0, FRINGES[1] / FRINGES[0], 1.0, FRINGES[2] / FRINGES[0])

Figures = dict[str, float]


def peaks_figures(method: str) -> Iterator[tuple[str, Figures]]:
    """Give phase errors of the returned pixels (RMS of right orders and of all, median of all), returned and wrong."""
    plan = qf.Plan(projector_width_px=WIDTH_PX, decode=qf.DecodeConfig.model_validate({"method": method}))
    for name, take in TEXTURES.items():
        errors = []
        for seed in SEEDS:
            shot, truth_rad = take(seed)
            error = inside(qf.decode(shot, plan).phase_rad - truth_rad, WIDTH_PX / FRINGES[0])
            border = int(np.ceil(WIDTH_PX / FRINGES[0]))
            errors.append(error[border:-border, border:-border])
        error = np.stack(errors).astype(np.float64)
        returned = error[np.isfinite(error)]
        right = np.abs(returned) < np.pi
        yield (
            "peaks" if name == "white" else f"peaks_{name}",
            {
                "phase_rms_rad": scoring.rms(returned[right]),
                "phase_rms_all_rad": scoring.rms(returned),
                "phase_median_rad": float(np.median(np.abs(returned))),
                "returned_percent": 100 * returned.size / error.size,
                "wrong_of_returned_percent": 100 * float(1 - right.mean()),
            },
        )


def surface_figures(surface: str, method: str) -> Figures:
    """Give returned and wrong of the lit pixels, and depth RMS of the smooth parts, over all seeds."""
    lit_pixels = returned_pixels = wrong_pixels = 0
    depth_errors = []
    for seed in SEEDS:
        scene_config = qf.SceneConfig(surface=surface, noise=NOISE, seed=seed)
        decode = qf.DecodeConfig.model_validate({"method": method})
        config = qf.SystemConfig(scene=scene_config, decode=decode)
        with qf.open(config) as scanner:
            shot = scanner.grab()
            shape = scanner.decode(shot)
        assert shot.truth is not None
        scene = scenes.scene_from(shot, config, scanner.calibration.projector.width_px)
        lit = np.isfinite(scene.phase_rad) & ~shot.truth.shadow
        found = scoring.score(scene, shape.phase_rad, mask=lit)
        lit_pixels += int(lit.sum())
        returned_pixels += int((shape.returned & lit).sum())
        wrong_pixels += found.wrong_pixels
        smooth = scoring.inside(scene.scored, FRINGE_PX) & shape.returned
        depth_errors.append((shape.depth_mm - shot.truth.depth_mm)[smooth])
    return {
        "returned_percent": 100 * returned_pixels / lit_pixels,
        "wrong_of_returned_percent": 100 * wrong_pixels / max(1, returned_pixels),
        "depth_rms_mm": scoring.rms(np.concatenate(depth_errors)),
    }


def capture_figures(data: Path, method: str) -> Iterator[tuple[str, Figures]]:
    for name, score in capture_scores(data, {"method": method}).items():
        yield (
            f"capture_{name}",
            {
                "right_of_object_percent": score.right_percent,
                "right_of_returned_percent": score.right_of_returned_percent,
                "returned_percent": score.returned_percent,
            },
        )


def efficiency_figures(surface: str, method: str) -> Figures:
    bench = _core.Bench()
    column_px = bench.cast(surface).column_px().astype(np.float64)
    phase_rad = 2 * np.pi * FRINGES[0] / bench.visible.width * column_px
    decoder = _core.Decoder(column_px.shape, FRINGES, bench.visible.width, full_scale=1.0, method=method)

    def estimate(images: Images) -> NDArray[np.float32]:
        return decoder.decode(*images)["phase_rad"]

    inner = scoring.inside(np.isfinite(phase_rad), FRINGE_PX)
    return efficiency(estimate, phase_rad, inner, RATIOS).as_figures()


def all_figures(data: Path) -> Iterator[tuple[str, str, Figures]]:
    """Give what was measured, the method, and the figures, one after the other."""
    has_captures = all((data / name / "single_shot.npz").is_file() for name in scenes.CAPTURES)
    for method in METHODS:
        for name, found in peaks_figures(method):
            yield name, method, found
        for surface in SURFACES:
            yield surface, method, surface_figures(surface, method)
        if has_captures:
            for name, found in capture_figures(data, method):
                yield name, method, found
        for surface in EFFICIENCY_SURFACES:
            yield f"efficiency_{surface}", method, efficiency_figures(surface, method)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--data", type=Path, default=scenes.data_folder())
    options = parser.parse_args()
    figures: Figures = {}
    for name, method, found in all_figures(options.data):
        print(f"{name:30}{method:11}" + ", ".join(f"{key} {value:.4g}" for key, value in found.items()), flush=True)
        figures |= {f"{method}_{name}_{key}": value for key, value in found.items()}
    if options.json:
        record = {"machine": described(), "seeds": SEEDS, "figures": figures}
        options.json.write_text(json.dumps(record, indent=2) + "\n")


if __name__ == "__main__":
    main()
