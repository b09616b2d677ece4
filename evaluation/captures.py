"""Decode the real captures in forms that other benches could have made of them, and count refusals and right orders.

    python evaluation/captures.py [--data FOLDER] [--response known|auto|linear] [--json FILE]

Every capture gives shots at 12 offsets of the fringes, and at every fourth offset the variants of
quadfringe.evaluation._variants. The response is estimated from the 12 images of the first frequency (known), or from
the shot. A refused shot has no right pixel. Right order: |phase - truth| < pi.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import quadfringe as qf
from quadfringe.calibration.response import estimate_from_files
from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._variants import OFFSETS, VARIANTS, stepped
from quadfringe.files import figures_text

EVERY = 4  # offsets between the shots of which variants are made


def shots(data: Path, name: str) -> Iterator[tuple[str, scoring.Scene]]:
    for offset in OFFSETS:
        scene = stepped(data, name, offset)
        for label, variant in VARIANTS.items():
            if label == "as captured" or offset % EVERY == 0:
                yield f"{name}, {label}, step {offset}", variant(scene, offset)


def response_of(data: Path, name: str, choice: str) -> Any:
    if choice != "known":
        return choice
    return estimate_from_files(scenes.step_files(data, name), scenes.STEPS).calibration


def judged(scene: scoring.Scene, response: Any) -> tuple[str, scoring.Score]:
    """Give the reason of a refusal, which is empty for a shape, and the score."""
    try:
        return "", scoring.score(scene, scenes.shape_of(scene, response=response).phase_rad)
    except DecodeError as error:
        return str(error), scoring.score(scene, np.full(scene.red.shape, np.nan, np.float32))


def summary(name: str, scores: list[scoring.Score], refused: int) -> dict[str, float]:
    right = [score.right_percent for score in scores]
    returned = [score.right_of_returned_percent for score in scores if score.returned_percent > 0]
    found = {
        "refused_percent": 100 * refused / len(scores),
        "right_mean_percent": float(np.mean(right)),
        "right_worst_percent": min(right),
        "right_of_returned_mean_percent": float(np.mean(returned)),
        "right_of_returned_worst_percent": min(returned),
    }
    print(f"{name}: {len(scores)} shots, " + ", ".join(f"{key} {value:.2f}" for key, value in found.items()))
    return {f"{name}_{key}": value for key, value in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--data", type=Path, default=scenes.data_folder())
    parser.add_argument("--response", choices=["known", "auto", "linear"], default="known")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    figures: dict[str, float] = {}
    print(f"quadfringe {qf.__version__}\n{'':42}{'right %':>9}{'of returned %':>15}")
    for name in scenes.CAPTURES:
        response, scores, refused = response_of(options.data, name, options.response), [], 0
        for label, scene in shots(options.data, name):
            reason, score = judged(scene, response)
            scores.append(score)
            refused += bool(reason)
            print(f"{label:42}{score.right_percent:9.2f}{score.right_of_returned_percent:15.3f}  {reason}", flush=True)
        figures |= summary(name, scores, refused)
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
