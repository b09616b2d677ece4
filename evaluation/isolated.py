"""Objects on black ground, narrower than a few fringes: refused, right, and right of returned, one line for each kind.

    python evaluation/isolated.py [--surface face] [--seeds 8] [--first-seed 11] [--textured]

The objects are parts of a surface, 2 and 15 % of the frame. Contrast 0.3, fringes of 74 and 110 px, 1 % noise.
With --textured they fill 15 and 40 %, have fringes of 20 to 74 px, and squares of two fringes with an albedo of 0.2
to 1, in which the channels differ by 10 % at most.
"""

from __future__ import annotations

import argparse
from statistics import fmean

from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._isolated import isolated, tinted

# Fringe period in px, share of the frame.
OBJECTS = ((74, 0.02), (110, 0.02), (74, 0.15))
TEXTURED = ((20, 0.15), (33, 0.4), (50, 0.15), (50, 0.4), (74, 0.4))
TINT = 0.1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--surface", choices=("face", "steps", "sphere", "peaks"), default="face")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--first-seed", type=int, default=11)
    parser.add_argument("--textured", action="store_true")
    options = parser.parse_args()
    print("period  share  refused  right: mean  worst  of returned, worst, %")
    for period_px, share in TEXTURED if options.textured else OBJECTS:
        scores = []
        for seed in range(options.first_seed, options.first_seed + options.seeds):
            albedo = tinted(2 * period_px, seed, TINT) if options.textured else None
            scene = isolated(period_px, share, seed, surface=options.surface, albedo=albedo)
            try:
                scores.append(scoring.score(scene, scenes.shape_of(scene, response="linear").phase_rad))
            except DecodeError:
                continue
        right = [score.right_percent for score in scores]
        worst = min((score.right_of_returned_percent for score in scores), default=float("nan"))
        mean, least = (fmean(right), min(right)) if right else (float("nan"),) * 2
        print(
            f"{period_px:4} px  {share:5.0%}  {options.seeds - len(scores):7}"
            f"  {mean:11.2f}  {least:5.2f}  {worst:21.2f}"
        )


if __name__ == "__main__":
    main()
