"""Error against depth: with the pre-deformed pattern, and with unwrapping by the calibrated pair."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

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
from quadfringe.evaluation.reproduction import Reproduction
from quadfringe.view.report import Graph, draw_panels

__all__ = ["DEPTHS_MM", "pair_depth"]

DEPTHS_MM = tuple(PLANE_MM + step for step in range(-100, 101, 25))
TRANSLATIONS_MM = (0.5, 5.0)  # on every axis, in addition to a rotation of 1 degree
# Name of each way: whether the infrared image is pre-deformed, and the unwrapping.
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


def pair_depth(out: Path, shrink: int = 1, depths_mm: Sequence[float] = DEPTHS_MM) -> Reproduction:
    """Move a plane through the measuring volume of a deviated pair, 1 degree and 0.5 or 5 mm apart on every axis.

    The bench has all defects of a real one. Writes `out`/pair-depth.png. Figures are the worst over all depths, for
    each translation and way: `infrared_rms_rad` is the error of the infrared fringes against the phase that the
    unwrapping expects (36 fringes), `rms_rad` the error of the unwrapped phase against a single projector; wrong orders
    are in per cent, and `returned_percent` is relative to the pixels that a single projector returns.
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
    return Reproduction(figures, out / "pair-depth.png")


class _Errors(NamedTuple):
    """The errors of one way at one depth."""

    infrared_rms_rad: float
    rms_rad: float
    wrong_order_percent: float
    returned_percent: float


def _measured(pair: ProjectorPair, way: str, z_mm: float, alone: Map) -> _Errors:
    """Return the errors of one way at one depth; `alone` is the phase that a single projector gives."""
    deformed, unwrapping = WAYS[way]
    shot = expose(pair, z_mm, predeformed=deformed)
    phase_rad = decoded(shot, unwrapping=unwrapping)
    both_lit = np.isfinite(alone) & np.isfinite(shot.phase_rad)
    returned = 100.0 * float(np.isfinite(phase_rad[both_lit]).mean())
    return _Errors(
        infrared_rms_rad=rms(infrared_error_rad(shot, unwrapping)),
        rms_rad=rms(phase_rad - alone),
        wrong_order_percent=wrong_percent(phase_rad, shot.phase_rad),
        returned_percent=returned,
    )


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
