"""Published results computed again: each experiment writes a picture and returns its figures.

The method: "Single-shot 3D shape measurement of discontinuous objects based on a coaxial fringe projection
system", Applied Optics (2019). Each experiment has a module; those of the projector pair share the virtual bench of
`_pair_bench`. `EXPERIMENTS` lists them by name, and `run_all` runs them all.

>>> from quadfringe.evaluation.reproduce import named
>>> named("pair-tolerance").name
'tolerance'
"""

from __future__ import annotations

from quadfringe.evaluation.reproduce._names import ALIASES, ALL, NAMES
from quadfringe.evaluation.reproduce._registry import EXPERIMENTS, Experiment, named
from quadfringe.evaluation.reproduce._together import Outcome, record_of, run_all
from quadfringe.evaluation.reproduce.correction import correction
from quadfringe.evaluation.reproduce.crosstalk import crosstalk
from quadfringe.evaluation.reproduce.depth import depth
from quadfringe.evaluation.reproduce.deviated_pair import deviated_pair
from quadfringe.evaluation.reproduce.geometry import geometry
from quadfringe.evaluation.reproduce.hand import hand
from quadfringe.evaluation.reproduce.identity import identity
from quadfringe.evaluation.reproduce.mask import mask
from quadfringe.evaluation.reproduce.peaks import WIDTH_PX, inside, peaks, peaks_shot
from quadfringe.evaluation.reproduce.projector_calibration import projector_calibration
from quadfringe.evaluation.reproduce.row_profile import row_profile
from quadfringe.evaluation.reproduce.slope_range import slope_range
from quadfringe.evaluation.reproduce.steps import steps
from quadfringe.evaluation.reproduce.tolerance import tolerance
from quadfringe.evaluation.reproduction import Figure, Reproduction

__all__ = [
    "ALIASES",
    "ALL",
    "EXPERIMENTS",
    "NAMES",
    "WIDTH_PX",
    "Experiment",
    "Figure",
    "Outcome",
    "Reproduction",
    "correction",
    "crosstalk",
    "depth",
    "deviated_pair",
    "geometry",
    "hand",
    "identity",
    "inside",
    "mask",
    "named",
    "peaks",
    "peaks_shot",
    "projector_calibration",
    "record_of",
    "row_profile",
    "run_all",
    "slope_range",
    "steps",
    "tolerance",
]
