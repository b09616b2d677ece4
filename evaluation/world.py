"""Measure depth errors and resolution on scenes that resemble real objects.

    python evaluation/world.py [--half tune|report] [--seeds N ...] [--method joint] [--only WORD ...] [--detail FACTOR]
                               [--json FILE]

The scenes of quadfringe.evaluation.world are rendered at 1024 x 768 with 3 % noise and 8 bit; their response is linear.
Tune a method on the half `tune`, and report its figures on the half `report`. Every figure is the mean over the two
seeds of a half. With --seeds it is the mean over these, and a second line has the worst of them. Depth errors count
returned pixels with the right order that are at least 2 px from an edge. The photographs need scikit-image, which the
extra `test` installs.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from statistics import fmean

import quadfringe as qf
from quadfringe.evaluation import world
from quadfringe.files import figures_text

HALVES = {"tune": world.TUNE, "report": world.REPORT}
NOISES = (0.03, 0.0)
# Figures of which the least is the worst; of the others it is the greatest.
LEAST_IS_WORST = ("returned_percent", "inside_1_percent", "inside_2_percent", "inside_3_percent")

Decode = Callable[[world.Take], qf.Shape]


def decoded(taken: world.Take, *, settings: dict[str, object], calibration: qf.Calibration) -> qf.Shape:
    """Decode without a verdict, because a refused shot would have no figures."""
    plan = qf.Plan(
        calibration.projector.width_px,
        fringes=qf.Fringes(numbers=taken.fringe_numbers),
        calibration=calibration,
        response="linear",
        decode=qf.DecodeConfig.model_validate(settings),
    )
    return qf.Decoder(taken.shot, plan).decode_without_verdict(taken.shot)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--half", choices=HALVES, default="report")
    parser.add_argument("--seeds", nargs="+", type=int, metavar="N", help="seeds in place of those of a half")
    parser.add_argument("--method", default="joint")
    parser.add_argument("--detail", type=float, help="detail against noise, from 0.25 to 4")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="scenes whose name contains one of these words")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    with qf.open(qf.SystemConfig()) as scanner:
        assert scanner.calibration is not None
        settings = {"method": options.method, "detail": options.detail}
        decode = partial(decoded, settings=settings, calibration=scanner.calibration)
    figures: dict[str, float] = {}
    seeds = options.seeds or HALVES[options.half]
    names = [n for n in world.SCENES if options.only is None or any(word in n for word in options.only)]
    print(
        f"{'mm':20}{'RMS':>8}{'median':>8}{'95 %':>8}{'99 %':>8}{'rims':>8}{'back %':>8}{'wrong %':>8}  inside 1 2 3 %"
    )
    doubts = world.Doubts()
    for name in names:
        judged = [judged_of(decode, world.take(name, seed), doubts) for seed in seeds]
        found = {key: fmean(one[key] for one in judged) for key in judged[0]}
        figures |= {f"{name}_{key}": value for key, value in found.items()}
        print(line(name, found), flush=True)
        if options.seeds:
            worst = worst_of(judged)
            figures |= {f"{name}_worst_{key}": value for key, value in worst.items()}
            print(line("  worst", worst), flush=True)
    for words, pixels, stated, true in doubts.rows():
        figures |= {f"doubt_{words}_stated": stated, f"doubt_{words}_true": true}
        print(f"order wrong with probability {words}: {pixels} pixels, stated {stated:.2g}, true {true:.2g}")
    if options.only is None or "resolution" in options.only:
        figures |= resolution(decode, seeds[0])
    if options.json:
        options.json.write_text(figures_text(figures))


def worst_of(judged: list[dict[str, float]]) -> dict[str, float]:
    def worst(key: str) -> float:
        values = [one[key] for one in judged]
        return min(values) if key in LEAST_IS_WORST else max(values)

    return {key: worst(key) for key in judged[0]}


def judged_of(decode: Decode, taken: world.Take, doubts: world.Doubts) -> dict[str, float]:
    shape = decode(taken)
    doubts.add(shape, taken)
    return asdict(world.judge(shape, taken))


def line(name: str, found: dict[str, float]) -> str:
    errors = "".join(f"{found[f'{key}_mm']:8.3f}" for key in ("rms", "median", "p95", "p99", "rim_rms"))
    shares = f"{found['returned_percent']:8.2f}{found['wrong_percent']:8.3f}  "
    return f"{name:20}{errors}{shares}" + " ".join(f"{found[f'inside_{n}_percent']:.1f}" for n in (1, 2, 3))


def resolution(decode: Decode, seed: int) -> dict[str, float]:
    """Print and give the share of the height that is left by period, the period of half of it, and edge widths."""
    figures: dict[str, float] = {}
    for noise in NOISES:
        for along in ("x", "y"):
            ratios = world.height_ratios(decode, along, seed, noise)
            half = world.half_height_period_px(ratios)
            key = f"waves_{along}_noise_{100 * noise:g}"
            figures |= {f"{key}_{period}px": ratio for period, ratio in ratios.items()} | {f"{key}_half_px": half}
            listed = "  ".join(f"{period}: {ratio:.2f}" for period, ratio in ratios.items())
            print(f"waves along {along}, noise {noise}: half at {half:.1f} px; {listed}", flush=True)
        width = world.edge_width_px(decode, seed, noise)
        figures[f"edge_noise_{100 * noise:g}_px"] = width
        print(f"edge of 5 mm, noise {noise}: 10 to 90 % in {width:.2f} px", flush=True)
    return figures


if __name__ == "__main__":
    main()
