"""A plane measured with a deviated pair of projectors, by the published unwrapping."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quadfringe.decoding.compare import rms
from quadfringe.evaluation.reproduce._pair_bench import (
    DEVIATION_DEG,
    DEVIATION_MM,
    decoded,
    expose,
    ideal_pair,
    wrong_percent,
)
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Panel, draw_panels
from quadfringe.view.style import DIVERGING

__all__ = ["deviated_pair"]

WORDS = {"single": "one projector", "deviated": "deviated pair"}
APART = f"{DEVIATION_DEG:g} degree and {DEVIATION_MM:g} mm"


def deviated_pair(out: Path, shrink: int = 1) -> Reproduction:
    """Unwrap a plane with one projector, and with a pair that deviates by 1 degree and 0.5 mm on every axis.

    Writes `out`/deviated-pair.png. Figures: RMS of the 36-fringe phase against the exact one in rad, and the share of
    wrong orders in per cent.
    """
    pair = ideal_pair((DEVIATION_DEG,) * 3, (DEVIATION_MM,) * 3, shrink)
    single, apart = expose(pair.single), expose(pair)
    phases = {"single": decoded(single), "deviated": decoded(apart)}
    records = []
    for (name, phase_rad), exposure in zip(phases.items(), (single, apart), strict=True):
        error_rad, wrong = rms(phase_rad - exposure.phase_rad), wrong_percent(phase_rad, exposure.phase_rad)
        records.append(Figure(f"{name}_rms_rad", f"{WORDS[name]}: phase error", error_rad, "rad RMS"))
        records.append(Figure(f"{name}_wrong_order_percent", f"{WORDS[name]}: wrong orders", wrong, "%"))
    wrong = records[-1].value
    limits = (0.0, 2 * np.pi * single.fringes.numbers[0])
    wrong_turns = np.round((phases["deviated"] - single.phase_rad) / (2 * np.pi))
    panels = [
        Panel("one projector", phases["single"], "rad", "turbo", limits),
        Panel(f"pair, {APART} apart", phases["deviated"], "rad", "turbo", limits),
        Panel(f"fringe orders off by: {wrong:.1f} % wrong", wrong_turns, "fringes", DIVERGING),
    ]
    path = out / "deviated-pair.png"
    draw_panels(path, "unwrapped phase of a plane, published unwrapping", [panels])
    return Reproduction(tuple(records), (path,), f"with a pair {APART} apart, {wrong:.0f} % of the orders are wrong")
