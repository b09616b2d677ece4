"""Error against depth: the pre-deformed pattern, and unwrapping that knows both projectors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare import rms
from quadfringe.evaluation.reproduce._deviated_pair import (
    PLANE_MM,
    ProjectorPair,
    Unwrapping,
    decoded,
    expose,
    infrared_error_rad,
    real_pair,
    wrong_percent,
)
from quadfringe.view.report import Graph, draw_panels

__all__ = ["DEPTHS_MM", "pair_depth"]

DEPTHS_MM = tuple(PLANE_MM + step for step in range(-100, 101, 25))
TRANSLATIONS_MM = (0.5, 5.0)  # on every axis, beside 1 degree
# Name of a way: whether the infrared image is pre-deformed, and what the unwrapping takes it for.
WAYS: dict[str, tuple[bool, Unwrapping]] = {
    "plain": (False, "coaxial"),
    "corrected": (True, "coaxial"),
    "searched": (False, "pair"),
}
Map = NDArray[np.float32]
WORDS = {
    "plain": "plain image, published unwrapping",
    "corrected": "pre-deformed image, published unwrapping",
    "searched": "plain image, search along the ray",
}


def pair_depth(out: Path, shrink: int = 1, depths_mm: Sequence[float] = DEPTHS_MM) -> tuple[dict[str, float], Path]:
    """Move a plane through the measuring volume of a deviated pair, 1 degree and 0.5 or 5 mm apart on every axis.

    The bench has all defects of a real one. Writes `out`/pair-depth.png. Figures are the worst over all depths, for
    each translation and way: `infrared_rms_rad` of the infrared fringes against what the unwrapping takes them for (36
    fringes), `rms_rad` of the unwrapped phase against that of a single projector, wrong orders in per cent, and the
    least share of pixels returned of those that a single projector has returned.
    """
    figures: dict[str, float] = {}
    graphs: list[list[Graph]] = []
    depths = np.array(depths_mm)
    alone = {z: decoded(expose(real_pair(shrink=shrink).single, z)) for z in depths_mm}
    for translation_mm in TRANSLATIONS_MM:
        pair = real_pair(translation_mm=(translation_mm,) * 3, shrink=shrink)
        curves = {way: np.array([_measured(pair, way, z, alone[z]) for z in depths_mm]) for way in WAYS}
        for way, found in curves.items():
            name = f"{way}_{translation_mm:g}mm"
            figures[f"{name}_infrared_rms_rad"], figures[f"{name}_rms_rad"] = found[:, :2].max(axis=0).tolist()
            figures[f"{name}_wrong_order_percent"] = float(found[:, 2].max())
            figures[f"{name}_returned_percent"] = float(found[:, 3].min())
        graphs.append(_graphs(f"1 degree and {translation_mm:g} mm on every axis", depths, curves))
    draw_panels(out / "pair-depth.png", "a deviated pair: error against depth", graphs)
    return figures, out / "pair-depth.png"


def _measured(pair: ProjectorPair, way: str, z_mm: float, alone: Map) -> tuple[float, float, float, float]:
    """Give the four figures of one way at one depth, where one projector alone finds the phase `alone`."""
    deformed, unwrapping = WAYS[way]
    shot = expose(pair, z_mm, predeformed=deformed)
    phase_rad = decoded(shot, unwrapping=unwrapping)
    both_lit = np.isfinite(alone) & np.isfinite(shot.phase_rad)
    returned = 100.0 * float(np.isfinite(phase_rad[both_lit]).mean())
    off = rms(phase_rad - alone)
    return rms(infrared_error_rad(shot, unwrapping)), off, wrong_percent(phase_rad, shot.phase_rad), returned


def _graphs(title: str, depths: NDArray[np.float64], curves: dict[str, NDArray[np.float64]]) -> list[Graph]:
    quantities = (
        ("infrared fringes against expectation", "rad RMS at 36 fringes", True),
        ("unwrapped phase against one projector", "rad RMS", True),
        ("wrong orders", "%", False),
    )
    return [
        Graph(
            f"{title}:\n{words}",
            "depth of the plane, mm",
            unit,
            {WORDS[way]: (depths, found[:, i]) for way, found in curves.items()},
            log=log,
        )
        for i, (words, unit, log) in enumerate(quantities)
    ]
