"""Published results computed again: each function writes a picture and returns its figures.

The method: "Single-shot 3D shape measurement of discontinuous objects based on a coaxial fringe projection
system", Applied Optics (2019). Each result has a module; the results of the projector pair share
the virtual bench of `_deviated_pair`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from quadfringe.evaluation.moving_scene import hand
from quadfringe.evaluation.reproduce.pair_calibration import pair_calibration
from quadfringe.evaluation.reproduce.pair_correction import pair_correction
from quadfringe.evaluation.reproduce.pair_depth import pair_depth
from quadfringe.evaluation.reproduce.pair_deviation import pair_deviation
from quadfringe.evaluation.reproduce.pair_tolerance import pair_tolerance
from quadfringe.evaluation.reproduce.peaks import WIDTH_PX, inside, peaks, peaks_shot
from quadfringe.evaluation.reproduction import Reproduction

__all__ = [
    "REPRODUCTIONS",
    "WIDTH_PX",
    "Reproduction",
    "hand",
    "inside",
    "pair_calibration",
    "pair_correction",
    "pair_depth",
    "pair_deviation",
    "pair_tolerance",
    "peaks",
    "peaks_shot",
]

REPRODUCTIONS: dict[str, Callable[[Path], Reproduction]] = {
    "hand": hand,
    "peaks": peaks,
    "pair-deviation": pair_deviation,
    "pair-tolerance": pair_tolerance,
    "pair-calibration": pair_calibration,
    "pair-correction": pair_correction,
    "pair-depth": pair_depth,
}
