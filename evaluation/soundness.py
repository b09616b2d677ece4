"""Tell sound shots of small objects from broken ones: how many of either are refused, and what the others return.

    python evaluation/soundness.py [--texture NAME] [--seeds N ...] [--only FAULT ...] [--offsets]

Objects on black fill 2 and 6 % of the frame and are one to six fringes wide; those with a texture fill 4 to 12 %. A
shot is sound, is harmed by a wrong response, blur or crosstalk, or is broken: two channels are exchanged, or all of
them; the same image is given twice; infrared is moved by 4 to 20 px; the fringe numbers are others than it is decoded
with; noise is in place of fringes. A shot is returned wrong if more than 2 % of its returned pixels have a wrong order.
With --offsets the quartiles of the offsets of green and infrared from the phase, and of their scatter, are printed for
shots below the sure margin: for sound and harmed shots whose orders are right, and for broken ones whose orders are
wrong.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from statistics import fmean

import numpy as np

import quadfringe as qf
from quadfringe.decoding.agreement import Agreement
from quadfringe.decoding.verdict import order_margin
from quadfringe.decoding.verdict_params import SURE
from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._faults import BROKEN, HARMED, SOUND
from quadfringe.evaluation._isolated import isolated, printed
from quadfringe.evaluation.scoring import Scene

SURFACES = ("steps", "face", "sphere", "peaks")
# Fringe period in px, share of the frame.
OBJECTS = ((33, 0.02), (74, 0.02), (110, 0.02), (110, 0.06))
PRINTED = ((33, 0.04), (50, 0.08), (74, 0.12))  # the same with strong colours
RIGHT_MIN_PERCENT = 98.0
FAULTS = SOUND | HARMED | BROKEN
QUARTILES = (0, 0.25, 0.5, 0.75, 1)


def objects(seeds: list[int], texture: str | None) -> Iterator[Scene]:
    for surface in SURFACES:
        for period_px, share in PRINTED if texture else OBJECTS:
            for seed in seeds:
                if texture:
                    yield printed(period_px, share, seed, surface=surface, texture=texture)
                else:
                    yield isolated(period_px, share, seed, surface=surface)


def judged(scene: Scene) -> scoring.Score | None:
    """Score a shot; None if it is refused."""
    try:
        return scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad)
    except DecodeError:
        return None


def agreement_of(scene: Scene, *, broken: bool) -> Agreement | None:
    """Give the agreement of a shot below the sure margin whose orders are wrong, if it is broken, or else right."""
    shot, plan = scenes.plan_of(scene, response="linear")
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    right = scoring.score(scene, shape.phase_rad).right_of_returned_percent >= RIGHT_MIN_PERCENT
    if not shape.returned.any() or order_margin(shape) >= SURE or right == broken:
        return None
    return Agreement(shape, shot, plan)


def print_offsets(found: list[Agreement]) -> None:
    for name in ("offset_rad", "scatter_rad"):
        values = np.quantile([getattr(one, name) for one in found] or [np.nan], QUARTILES, method="nearest")
        print(f"    {name} of {len(found)}, least to largest: " + " ".join(f"{value:.3f}" for value in values))
    print(f"    agree beyond chance: {sum(one.beyond_chance for one in found)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seeds", nargs="+", type=int, metavar="N", default=[71, 72])
    parser.add_argument("--only", nargs="+", choices=list(FAULTS), default=list(FAULTS))
    parser.add_argument("--offsets", action="store_true", help="print the offsets that the limits of the verdict hold")
    parser.add_argument(
        "--texture", choices=("photographs", "patches"), help="print strong colours on the objects, larger ones"
    )
    options = parser.parse_args()
    print(f"{'':16}{'shots':>7}{'refused':>9}{'wrong':>7}{'right, %':>10}")
    for fault in options.only:
        shots = [FAULTS[fault](scene) for scene in objects(options.seeds, options.texture)]
        scores = [score for score in map(judged, shots) if score is not None]
        wrong = sum(score.right_of_returned_percent < RIGHT_MIN_PERCENT for score in scores)
        right = fmean(score.right_percent for score in scores) if scores else np.nan
        print(f"{fault:16}{len(shots):7}{len(shots) - len(scores):9}{wrong:7}{right:10.2f}", flush=True)
        if options.offsets:
            found = [agreement_of(scene, broken=fault in BROKEN) for scene in shots]
            print_offsets([one for one in found if one is not None])


if __name__ == "__main__":
    main()
