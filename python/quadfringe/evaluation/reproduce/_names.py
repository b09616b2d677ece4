"""The names of the experiments, for commands that must not load the experiments themselves."""

from __future__ import annotations

__all__ = ["ALIASES", "ALL", "NAMES", "name_of"]

from quadfringe.errors import InputError

ALL = "all"
# In the order of the paper, then what it derives or mentions without an experiment.
NAMES = (
    "identity",
    "deviated-pair",
    "tolerance",
    "projector-calibration",
    "correction",
    "row-profile",
    "peaks",
    "mask",
    "steps",
    "hand",
    "range",
    "geometry",
    "crosstalk",
    "depth",
)
# Earlier names.
ALIASES = {
    "pair-deviation": "deviated-pair",
    "pair-tolerance": "tolerance",
    "pair-calibration": "projector-calibration",
    "pair-correction": "correction",
    "pair-depth": "depth",
}


def name_of(word: str) -> str:
    """Return the name of an experiment, also by an earlier name, or "all"; raises `InputError` listing the names.

    >>> name_of("pair-depth")
    'depth'
    """
    found = ALIASES.get(word, word)
    if found != ALL and found not in NAMES:
        raise InputError(f"expected one of {', '.join((*NAMES, ALL))}; got {word!r}")
    return found
