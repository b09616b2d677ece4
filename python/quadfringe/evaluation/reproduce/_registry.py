"""The experiments by name: title, function, expected time, and what `reproduce all` makes smaller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from quadfringe.evaluation.moving_scene import hand_system
from quadfringe.evaluation.reproduce._names import NAMES, name_of
from quadfringe.evaluation.reproduce._pair_bench import PLANE_MM, published_camera
from quadfringe.evaluation.reproduce.correction import correction
from quadfringe.evaluation.reproduce.crosstalk import crosstalk
from quadfringe.evaluation.reproduce.depth import depth
from quadfringe.evaluation.reproduce.deviated_pair import deviated_pair
from quadfringe.evaluation.reproduce.geometry import geometry
from quadfringe.evaluation.reproduce.hand import hand
from quadfringe.evaluation.reproduce.identity import identity
from quadfringe.evaluation.reproduce.mask import mask
from quadfringe.evaluation.reproduce.peaks import peaks
from quadfringe.evaluation.reproduce.projector_calibration import projector_calibration
from quadfringe.evaluation.reproduce.row_profile import row_profile
from quadfringe.evaluation.reproduce.slope_range import slope_range
from quadfringe.evaluation.reproduce.steps import steps
from quadfringe.evaluation.reproduce.tolerance import tolerance
from quadfringe.evaluation.reproduction import Reproduction

__all__ = ["EXPERIMENTS", "Experiment", "named"]

HALF = "camera with half the pixels along each side"


@dataclass(frozen=True)
class Experiment:
    """An experiment: its name, what it shows, its function, and its expected time in s on two cores.

    `smaller` are the arguments with which `reproduce all` runs it, in words `smaller_words`, in `smaller_s`.
    """

    name: str
    title: str
    run: Callable[..., Reproduction]
    expected_s: float
    smaller: Mapping[str, Any] = field(default_factory=dict)
    smaller_words: str = ""
    smaller_s: float | None = None

    @property
    def in_all_s(self) -> float:
        """Expected time in `reproduce all`, s."""
        return self.expected_s if self.smaller_s is None else self.smaller_s

    def small(self, out: Path) -> Reproduction:
        """Run it as `reproduce all` does."""
        return self.run(out, **self.smaller)


_DEPTHS_MM = tuple(PLANE_MM + step for step in (-100.0, -50.0, 0.0, 50.0, 100.0))
EXPERIMENTS: dict[str, Experiment] = {
    one.name: one
    for one in (
        Experiment("identity", "the virtual bench captures exactly what is projected", identity, 3),
        Experiment("deviated-pair", "phase of a plane by a pair of projectors that deviates", deviated_pair, 3),
        Experiment("tolerance", "allowable deviation of each parameter of the infrared projector", tolerance, 6),
        Experiment(
            "projector-calibration", "both projectors calibrated as inverse cameras", projector_calibration, 130,
            {"shrink": 2}, HALF, 40,
        ),
        Experiment("correction", "a deviated pair before and after its infrared image was pre-deformed", correction, 7),
        Experiment("row-profile", "row 130 of a plane: one projector, before and after the correction", row_profile, 5),
        Experiment("peaks", "the peaks surface under 3 % noise, by three ways of demodulation", peaks, 6),
        Experiment("mask", "a mask: wrapped phases, unwrapped phase and shape of one shot", mask, 8),
        Experiment("steps", "a set of steps in one shot", steps, 8),
        Experiment(
            "hand", "a moving hand as a film", hand, 110,
            {"system": hand_system().model_copy(update={"camera": published_camera(2)})}, HALF, 35,
        ),
        Experiment("range", "slopes that traditional and improved Fourier profilometry follow", slope_range, 2),
        Experiment("geometry", "height by closed form, polynomial and triangulation, on the same shots", geometry, 6),
        Experiment("crosstalk", "crosstalk between the channels, calibrated and undone", crosstalk, 6),
        Experiment(
            "depth", "error of a deviated pair against depth, by two cures", depth, 60,
            {"shrink": 2, "depths_mm": _DEPTHS_MM}, f"{HALF}, five depths of nine", 12,
        ),
    )
}  # fmt: skip
assert tuple(EXPERIMENTS) == NAMES, "one experiment for each name"


def named(word: str) -> Experiment:
    """Return an experiment by its name or an earlier one; raises `InputError` listing the names."""
    return EXPERIMENTS[name_of(word)]
