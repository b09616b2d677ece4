"""Profiles: how the difference of two shapes depends on something that may be its reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare.params import BIN_PIXELS_MIN, BINS, NORMAL

__all__ = ["Profile", "profiles_of"]

Map = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, repr=False)
class Profile:
    """The difference over a quantity, in bins: its median (`bias`) and the robust spread around it (`spread`).

    `at` holds the middles of the bins, in `unit`, and `pixels` their counts; each is (N,) float64. Bins with too few
    pixels are left out.
    """

    name: str
    unit: str
    at: Map
    bias: Map
    spread: Map
    pixels: Map

    def __repr__(self) -> str:
        if not self.at.size:
            return f"Profile({self.name}, no bins)"
        low, high = self.bias.min(), self.bias.max()
        return f"Profile({self.name}, {self.at.size} bins, bias {low:.3g} to {high:.3g})"


def profiles_of(difference: Map, counted: Mask, quantities: Mapping[str, tuple[str, Map]]) -> dict[str, Profile]:
    """Give the profile of a difference (H, W) over each quantity, (unit, map), by name."""
    return {name: _profile(name, unit, difference, counted, q) for name, (unit, q) in quantities.items()}


def _profile(name: str, unit: str, difference: Map, counted: Mask, quantity: Map) -> Profile:
    known = counted & np.isfinite(quantity)
    x, d = quantity[known], difference[known]
    empty = np.empty(0)
    if x.size < BIN_PIXELS_MIN:
        return Profile(name, unit, empty, empty, empty, empty)
    low, high = (float(v) for v in np.quantile(x, (0.001, 0.999)))
    if not high > low:
        low, high = low - 0.5, low + 0.5
    edges = np.linspace(low, high, BINS + 1)
    at = (edges[1:] + edges[:-1]) / 2
    order = np.argsort(x, kind="stable")
    bounds = np.searchsorted(x[order], edges)
    parts = [d[order[first:last]] for first, last in pairwise(bounds)]
    kept = [i for i, part in enumerate(parts) if part.size >= BIN_PIXELS_MIN]
    bias = np.array([np.median(parts[i]) for i in kept])
    spread = np.array([NORMAL * np.median(np.abs(parts[i] - b)) for i, b in zip(kept, bias, strict=True)])
    return Profile(name, unit, at[kept], bias, spread, np.array([float(parts[i].size) for i in kept]))
