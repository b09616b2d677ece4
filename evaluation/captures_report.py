"""Scores on real captures and on independent renders, as one table.

    python evaluation/captures_report.py [--data FOLDER] [--json FILE] [--method joint]

Captures are decoded as linear light, with the response estimated from the shot (the default of `decode`), and with the
response estimated from the 12 images of their first frequency; renders at 16 bit without noise and at 8 bit with 3 %
noise, with their rig as calibration. Right order: |phase - truth| < pi; a missing pixel counts as wrong in `right`. The
figures marked `inside` leave out the first fringe from the border.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import quadfringe as qf
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.files import figures_text

NOISE = 0.03
HEAD = f"{'':28}{'right %':>9}{'of returned %':>15}{'returned %':>12}{'phase rad':>11}{'depth mm':>10}"


def line(name: str, score: scoring.Score) -> str:
    depth = "" if score.depth_rms_mm is None else f"{score.depth_rms_mm:10.4f}"
    return (
        f"{name:28}{score.right_percent:9.3f}{score.right_of_returned_percent:15.3f}"
        f"{score.returned_percent:12.3f}{score.right_phase_rms_rad:11.4f}{depth}"
    )


def capture_scores(data: Path, settings: dict[str, Any]) -> dict[str, scoring.Score]:
    scores = {}
    for name in scenes.CAPTURES:
        scene = scenes.capture(data, name)
        response = scenes.response_of(data, name)
        for label, known in (("as_linear", "linear"), ("auto_response", "auto"), ("with_response", response)):
            shape = scenes.shape_of(scene, response=known, **settings)
            scores[f"{name}_{label}"] = scoring.score(scene, shape.phase_rad)
    return scores


def render_scores(data: Path, settings: dict[str, Any]) -> dict[str, scoring.Score]:
    calibration: qf.Calibration = scenes.calibration_of(scenes.rig(data))
    scores = {}
    for name in scenes.RENDERS:
        for label, sigma in (("noise_free", None), ("noise_3_percent", NOISE)):
            scene = scenes.render(data, name, sigma)
            shape = scenes.shape_of(scene, calibration=calibration, **settings)
            inner = scoring.inside(scene.scored, scoring.fringe_px(scene))
            maps = (shape.phase_rad, shape.xyz_mm)
            scores[f"{name}_{label}"] = scoring.score(scene, *maps)
            scores[f"{name}_{label}_inside"] = scoring.score(scene, *maps, inner)
    return scores


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--data", type=Path, default=scenes.data_folder())
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--method", choices=["published", "joint"])
    options = parser.parse_args()
    settings = {} if options.method is None else {"method": options.method}
    scores = capture_scores(options.data, settings) | render_scores(options.data, settings)
    print(HEAD)
    for name, score in scores.items():
        print(line(name, score))
    if options.json:
        figures = {f"{n}_{k}": v for n, score in scores.items() for k, v in score.as_figures().items()}
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
