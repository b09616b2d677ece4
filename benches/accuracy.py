"""Accuracy of both methods as one table: noise, texture, edges, depth, real captures, and the bound that noise sets.

    python benches/accuracy.py [--json FILE] [--data FOLDER]

- peaks: the shot of `quadfringe reproduce peaks`, 3 % noise (sigma 0.03 of full scale), rounded to 8 bit; phase RMS in
  rad over the field without a border of one fringe.
- peaks_patches: the same, printed with coloured squares of 20 mm, an option of the bench.
- peaks_shades: the same with smooth shades, waves of 150 to 500 pixels that differ from channel to channel.
- peaks_printed: the shades times patches with sharp borders and random colours, inks nearly clear in the infrared.
- plane, steps, sphere, face: shots of the virtual bench at about 800 mm, 3 % noise, 8 bit; lit pixels returned, wrong
  orders among returned, and depth RMS a fringe away from edges, borders and shadows, wrong orders included.
- captures: real shots as benches/captures_report.py scores them; left out without the test data.
- efficiency: phase variance over the Cramer-Rao bound at the same spatial resolution; benches/efficiency.py defines it.

All seeds are fixed. Each figure of a bench shot is over the seeds 1, 2 and 3 together.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from bench_decode import scene_from
from captures_report import capture_scores
from efficiency import Images, efficiency
from numpy.typing import NDArray
from scipy import spatial

import quadfringe as qf
from quadfringe import _core
from quadfringe.evaluation.machine import described
from quadfringe.evaluation.reproduce import WIDTH_PX, inside, peaks_shot

import scoring  # isort: skip  (bench_decode makes it known)

METHODS = ("published", "best")
NOISE = 0.03
SEEDS = (1, 2, 3)
FRINGE_PX = 28
SURFACES = ("plane", "steps", "sphere", "face")
EFFICIENCY_SURFACES = ("plane", "peaks")
FRINGES = qf.Fringes().numbers
RATIOS = (1.0, FRINGES[1] / FRINGES[0], 1.0, FRINGES[2] / FRINGES[0])
CELLS, PRINT_SEED = 400, 5

Figures = dict[str, float]
Albedo = NDArray[np.float64]  # (H, W, 4)


def white(seed: int) -> tuple[qf.Shot, NDArray[Any]]:
    return peaks_shot(noise=NOISE, seed=seed)


def patches(seed: int) -> tuple[qf.Shot, NDArray[Any]]:
    return peaks_shot(noise=NOISE, seed=seed, patch_mm=20.0)


def shades(seed: int) -> tuple[qf.Shot, NDArray[Any]]:
    return printed_with(shades_of, seed)


def printed(seed: int) -> tuple[qf.Shot, NDArray[Any]]:
    return printed_with(lambda shape: shades_of(shape) * patches_of(shape), seed)


def printed_with(albedo_of: Callable[[tuple[int, ...]], Albedo], seed: int) -> tuple[qf.Shot, NDArray[Any]]:
    """Print an albedo on the clean shot, then add noise and round to 8 bit."""
    clean, truth_rad = peaks_shot(noise=0.0, bit_depth=16)
    albedo = albedo_of(clean.red.shape)
    channels = [
        scoring.noisy_8bit(np.round(image * albedo[..., c]).astype(np.uint16), NOISE, 10 * seed + c)
        for c, image in enumerate(clean.channels.values())
    ]
    return qf.Shot(*channels), truth_rad


def shades_of(shape: tuple[int, ...]) -> Albedo:
    """Give waves of 150 to 500 pixels in each channel, 0.6 to 1, (H, W, 4)."""
    random = np.random.default_rng(PRINT_SEED)
    y, x = np.mgrid[: shape[0], : shape[1]]
    found = np.empty((*shape, 4))
    for channel in range(4):
        along, across = random.uniform(2 * np.pi / 500, 2 * np.pi / 150, 2)
        found[..., channel] = 0.8 + 0.2 * np.cos(along * x + channel) * np.cos(across * y)
    return found


def patches_of(shape: tuple[int, ...]) -> Albedo:
    """Give cells of some 50 pixels around random points, each of its own colour, (H, W, 4)."""
    random = np.random.default_rng(PRINT_SEED)
    centres = random.uniform((0, 0), shape, (CELLS, 2))
    y, x = np.mgrid[: shape[0], : shape[1]]
    _, cell = spatial.KDTree(centres).query(np.stack([y, x], axis=-1))
    colours = random.uniform((0.3, 0.3, 0.3, 0.8), 1.0, (CELLS, 4))
    return np.asarray(colours[cell])


def peaks_figures(method: str) -> Iterator[tuple[str, Figures]]:
    """Give phase errors of the returned pixels (RMS of right orders and of all, median of all), returned and wrong."""
    plan = qf.Plan(projector_width_px=WIDTH_PX, settings=qf.DecodeConfig.model_validate({"method": method}))
    prints: dict[str, Callable[[int], tuple[qf.Shot, NDArray[Any]]]] = {
        "peaks": white,
        "peaks_patches": patches,
        "peaks_shades": shades,
        "peaks_printed": printed,
    }
    for name, take in prints.items():
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
            name,
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
        scene = scene_from(shot, config, scanner.calibration.projector.width_px)
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
    decoder = qf.Decoder(column_px.shape, FRINGES, bench.visible.width, full_scale=1.0, method=method)

    def estimate(images: Images) -> NDArray[np.float32]:
        return decoder.decode(*images)["phase_rad"]

    inner = scoring.inside(np.isfinite(phase_rad), FRINGE_PX)
    return efficiency(estimate, phase_rad, inner, RATIOS).as_figures()


def all_figures(data: Path) -> Iterator[tuple[str, str, Figures]]:
    """Give what was measured, the method, and the figures, one after the other."""
    has_captures = all((data / name / "single_shot.npz").is_file() for name in scoring.CAPTURES)
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
    parser.add_argument("--data", type=Path, default=scoring.data_folder())
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
