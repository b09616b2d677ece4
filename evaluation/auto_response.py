"""Accuracy of the response (gamma) that is estimated from one shot, and the gain of correcting it, as one table.

    python evaluation/auto_response.py [--json FILE]

Scenes of the virtual bench, 8 bit, seed 1, decoded as linear light and with the estimated response. Phase: RMS over
lit pixels with the right order. Wrong: share of the returned pixels that have another order or lie in shadow. `settled`
is the exponent of red times the projector's gamma, 1 when they cancel. Shots that the verdict would refuse are scored
too. Last come the exponents of red that five shots of one scene give each, 3 % noise and gamma 1.8: their scatter is
what a decoder loses by holding the response of a single shot.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

import quadfringe as qf
from quadfringe.files import figures_text

WIDTH_PX = 912
SCENES: tuple[tuple[str, dict[str, object]], ...] = (
    ("face", {"surface": "face", "noise": 0.01}),
    ("steps", {"surface": "steps", "noise": 0.01}),
    ("printed plane", {"surface": "plane", "noise": 0.01, "patch_mm": 20.0}),
    ("noisy steps", {"surface": "steps", "noise": 0.03}),
    ("mosaic", {"surface": "face", "noise": 0.01, "bayer": "rggb"}),
)
GAMMAS = (1.0, 1.2, 1.5, 2.2)
SEEDS = range(5)
HEAD = f"{'':24}{'phase rad':>18}{'returned %':>18}{'wrong %':>18}{'settled':>10}"


class Found(NamedTuple):
    """Figures of one decoded shot."""

    phase_rms_rad: float
    returned_percent: float
    wrong_percent: float


def scored(shot: qf.Shot, response: qf.Response | Literal["linear"]) -> Found:
    """Decode with `response`, without a verdict, and compare with the truth of the bench."""
    assert shot.truth is not None
    plan = qf.Plan(WIDTH_PX, response=response)
    phase_rad = qf.Decoder(shot, plan).decode_without_verdict(shot).phase_rad
    truth_rad = 2 * np.pi * qf.Fringes().numbers[0] * shot.truth.column_px / WIDTH_PX
    lit = np.isfinite(truth_rad) & ~shot.truth.shadow
    error = np.abs(phase_rad - truth_rad)
    right = lit & (error < np.pi)
    returned = np.isfinite(phase_rad)
    return Found(
        float(np.sqrt(np.mean(np.square(error[right], dtype=np.float64)))),
        100 * float(np.count_nonzero(returned & lit) / np.count_nonzero(lit)),
        100 * float(np.count_nonzero(returned & ~right) / np.count_nonzero(returned)),
    )


def shot_of(scene: dict[str, object]) -> qf.Shot:
    """Take a shot of a scene of the virtual bench."""
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig.model_validate(scene))) as scanner:
        return scanner.grab()


def scatter(surface: str) -> list[float]:
    """Give the exponents of red that shots with different noise show."""
    shots = (shot_of({"surface": surface, "noise": 0.03, "projector_exponent": 1.8, "seed": seed}) for seed in SEEDS)
    found = (qf.estimate_response(shot, qf.Plan(WIDTH_PX)) for shot in shots)
    return [1.0 if response == "linear" else response.red.exponent for response in found]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    figures: dict[str, float] = {}
    print(HEAD)
    for name, scene in SCENES:
        for gamma in GAMMAS:
            shot = shot_of({**scene, "projector_exponent": gamma, "seed": 1})
            response = qf.estimate_response(shot, qf.Plan(WIDTH_PX))
            linear, auto = scored(shot, "linear"), scored(shot, response)
            settled = gamma * (1.0 if response == "linear" else response.red.exponent)
            pairs = "".join(f"{a:10.4f}{b:8.4f}" for a, b in zip(linear, auto, strict=True))
            print(f"{name + f', gamma {gamma:g}':24}{pairs}{settled:10.3f}")
            key = f"{name.replace(' ', '_')}_gamma_{gamma:g}"
            for label, found in (("linear", linear), ("auto", auto)):
                figures |= {f"{key}_{label}_{k}": v for k, v in found._asdict().items()}
            figures[f"{key}_settled"] = settled
    for surface in ("face", "steps"):
        exponents = scatter(surface)
        figures[f"{surface}_scatter_percent"] = 100 * float(np.std(exponents) / np.mean(exponents))
        listed = " ".join(f"{exponent:.4f}" for exponent in exponents)
        print(f"{surface}, five shots: {listed}, scatter {figures[f'{surface}_scatter_percent']:.2f} %")
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
