"""A plane measured with a deviated pair of projectors, by the published unwrapping."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quadfringe.decoding.compare import rms
from quadfringe.evaluation.reproduce._deviated_pair import (
    DEVIATION_DEG,
    DEVIATION_MM,
    decoded,
    expose,
    ideal_pair,
    wrong_percent,
)
from quadfringe.evaluation.reproduction import Reproduction
from quadfringe.view.report import Panel, draw_panels

__all__ = ["pair_deviation"]


def pair_deviation(out: Path, shrink: int = 1) -> Reproduction:
    """Unwrap a plane with one projector, and with a pair that deviates by 1 degree and 0.5 mm on every axis.

    Writes `out`/pair-deviation.png. Figures: RMS of the 36-fringe phase against the exact one in rad, and the share of
    wrong orders in per cent.
    """
    pair = ideal_pair((DEVIATION_DEG,) * 3, (DEVIATION_MM,) * 3, shrink)
    single, apart = expose(pair.single), expose(pair)
    phases = {"single": decoded(single), "deviated": decoded(apart)}
    figures = {}
    for (name, phase_rad), exposure in zip(phases.items(), (single, apart), strict=True):
        figures[f"{name}_rms_rad"] = rms(phase_rad - exposure.phase_rad)
        figures[f"{name}_wrong_order_percent"] = wrong_percent(phase_rad, exposure.phase_rad)
    limits = (0.0, 2 * np.pi * single.fringes.numbers[0])
    wrong_turns = np.round((phases["deviated"] - single.phase_rad) / (2 * np.pi))
    panels = [
        Panel("one projector", phases["single"], "rad", "turbo", limits),
        Panel(
            f"a pair {DEVIATION_DEG:g} degree and {DEVIATION_MM:g} mm apart", phases["deviated"], "rad", "turbo", limits
        ),
        Panel(
            f"orders off by: {figures['deviated_wrong_order_percent']:.1f} % wrong", wrong_turns, "fringes", "coolwarm"
        ),
    ]
    draw_panels(out / "pair-deviation.png", "unwrapped phase of a plane, published unwrapping", [panels])
    return Reproduction(figures, out / "pair-deviation.png")
