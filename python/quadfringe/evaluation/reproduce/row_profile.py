"""Row 130 of a plane: one projector, and a deviated pair before and after its infrared image was pre-deformed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Calibration
from quadfringe.decoding.compare import rms
from quadfringe.evaluation.reproduce._pair_bench import (
    Exposure,
    ProjectorPair,
    decoded,
    expose,
    infrared_error_rad,
    real_pair,
    wrong_percent,
)
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, draw_panels

__all__ = ["CASES", "ROW", "Cases", "measured", "profile_figures", "row_profile"]

Map = NDArray[np.float32]
ROW = 130  # the row of the published profile
CASES = ("single", "before", "after")
WORDS = {"single": "one projector", "before": "before", "after": "after", "after_joint": "after, joint method"}
# The paper does not say of which phase; the infrared fringes are the harder of the two.
PUBLISHED_RAD = {"before": 0.277, "after": 0.031}


@dataclass(frozen=True)
class Cases:
    """Maps (H, W) by case: shots, error of the unwrapped phase, whole turns in it, and error of the infrared fringes.

    `off_single` is the phase less that of one projector, also by the joint method; all phases are in rad at 36 fringes.
    """

    shots: Mapping[str, Exposure]
    errors: Mapping[str, Map]
    off_single: Mapping[str, Map]
    infrared: Mapping[str, Map]
    wrong_percent: Mapping[str, float]
    words: Mapping[str, str]

    @property
    def turns(self) -> dict[str, Map]:
        """Fringe orders off by, (H, W)."""
        return {name: np.round(error / np.float32(2 * np.pi)) for name, error in self.errors.items()}


def row_profile(out: Path, shrink: int = 1) -> Reproduction:
    """Plot row 130 of a plane for three cases: one projector, a deviated pair, and the corrected pair.

    The bench has all defects of a real one; its camera has 1/`shrink` of the pixels in each direction. Writes
    `out`/row-profile.png. Figures: RMS along the row, rad at 36 fringes, of the infrared fringes against their expected
    phase and of the unwrapped phase against that of one projector.
    """
    pair = real_pair(shrink=shrink)
    cases = measured(pair, pair.calibration)
    records = tuple(profile_figures(cases, ROW // shrink))
    known = {one.name: one.value for one in records}
    before, after = (known[f"infrared_{name}_rms_rad_row{ROW}"] for name in CASES[1:])
    word = f"below the published {PUBLISHED_RAD['after']} rad" if after < PUBLISHED_RAD["after"] else "NOT as published"
    worse = "" if after < before else "; the correction makes it WORSE"
    path = out / "row-profile.png"
    _draw(path, cases, ROW // shrink)
    return Reproduction(
        records,
        (path,),
        f"after the correction the row errs by {after:.2g} rad RMS, {word}; before it by {before:.2g} rad, more than "
        f"published, as this pair is 1 degree and 0.5 mm apart on every axis at once{worse}",
    )


def measured(pair: ProjectorPair, known: Calibration) -> Cases:
    """Expose and decode the plane in all cases; `known` is the calibration that the image is pre-deformed by."""
    shots = {
        "single": expose(pair.single),
        "before": expose(pair),
        "after": expose(pair, known=known, predeformed=True),
    }
    phases = {name: decoded(shot) for name, shot in shots.items()}
    off = {name: phases[name] - phases["single"] for name in CASES[1:]}
    off["after_joint"] = decoded(shots["after"], "joint") - decoded(shots["single"], "joint")
    return Cases(
        shots=shots,
        errors={name: phase - shots[name].phase_rad for name, phase in phases.items()},
        off_single=off,
        infrared={
            name: shots[name].apart_rad if name == "before" else infrared_error_rad(shots[name]) for name in CASES
        },
        wrong_percent={name: wrong_percent(phase, shots[name].phase_rad) for name, phase in phases.items()},
        words=WORDS,
    )


def profile_figures(cases: Cases, row: int) -> list[Figure]:
    """Name the errors along a row of the image, which is row 130 of the full image."""
    infrared = [
        Figure(
            f"infrared_{name}_rms_rad_row{ROW}",
            f"{WORDS[name]}, row {ROW}: infrared fringes",
            rms(cases.infrared[name][row]),
            "rad RMS",
            PUBLISHED_RAD.get(name),
        )
        for name in CASES
    ]
    phase = [
        Figure(
            f"{name}_rms_rad_row{ROW}",
            f"{WORDS[name]}, row {ROW}: phase against one projector",
            rms(off[row]),
            "rad RMS",
        )
        for name, off in cases.off_single.items()
    ]
    return [*infrared, *phase]


def _draw(path: Path, cases: Cases, row: int) -> None:
    x = np.arange(cases.errors["single"].shape[1])

    def graph(title: str, maps: Mapping[str, Map], names: tuple[str, ...]) -> Graph:
        lines = {f"{WORDS[n]}: {rms(maps[n][row]):.3g} rad RMS": (x, maps[n][row]) for n in names}
        return Graph(title, "column, px", "rad at 36 fringes", lines)

    off = {f"after: {rms(cases.off_single['after'][row]):.2g} rad RMS": (x, cases.off_single["after"][row])}
    rows = [
        [
            graph(f"unwrapped phase: error along row {ROW}", cases.errors, ("before", "after")),
            Graph("unwrapped phase less that of one projector", "column, px", "rad at 36 fringes", off),
        ],
        [
            graph(f"infrared fringes: error along row {ROW}", cases.infrared, ("before", "after")),
            graph("infrared fringes: the same on a finer scale", cases.infrared, ("single", "after")),
        ],
    ]
    draw_panels(path, f"row {ROW} of a plane", rows)
