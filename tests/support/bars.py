"""Hold measured figures against the bars of `evaluation/bars.toml`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from quadfringe.evaluation._ledger import Bar, bars


def bar(key: str) -> Bar:
    """Give a bar of the ledger, for tolerances."""
    known = bars()
    assert key in known, f"evaluation/bars.toml has no bar {key!r}"
    return known[key]


def tolerance(key: str) -> float:
    """Give the upper limit of a deviation."""
    limit = bar(key).upper
    assert limit is not None, f"{key} has no upper limit"
    return limit


def hold(key: str, values: ArrayLike) -> None:
    """Print the values (`pytest -rP` shows them) and fail unless every value keeps the bar."""
    limits = bar(key)
    measured = np.ravel(np.asarray(values, dtype=np.float64)).tolist()
    unit = "" if limits.unit == "1" else f" {limits.unit}"
    print(f"{key}: {', '.join(f'{value:.4g}' for value in measured[:5])}{unit}, bar {limits.text}")
    missed = [value for value in measured if not limits.holds(value)]
    assert not missed, f"{key}: {limits.figure}: {missed[:5]} {limits.unit}, bar {limits.text}"
