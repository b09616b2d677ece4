"""Error against depth: with the pre-deformed pattern, and with unwrapping by the calibrated pair."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare import rms
from quadfringe.evaluation.reproduce._pair_bench import (
    PLANE_MM,
    ProjectorPair,
    Unwrapping,
    decoded,
    expose,
    infrared_error_rad,
    real_pair,
    wrong_percent,
)
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, draw_panels

__all__ = ["DEPTHS_MM", "depth"]

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


def depth(out: Path, shrink: int = 1, depths_mm: Sequence[float] = DEPTHS_MM) -> Reproduction:
    """Move a plane through the measuring volume of a deviated pair, 1 degree and 0.5 or 5 mm apart on every axis.

    The bench has all defects of a real one. Writes `out`/depth.png. Figures are the worst over all depths, for
    each translation and way: `infrared_rms_rad` is the error of the infrared fringes against the phase that the
    unwrapping expects (36 fringes), `rms_rad` the error of the unwrapped phase against a single projector; wrong orders
    are in per cent, and `returned_percent` is relative to the pixels that a single projector returns.
    """
    records: list[Figure] = []
    graphs: list[list[Graph]] = []
    depths = np.array(depths_mm)
    alone = {z: decoded(expose(real_pair(shrink=shrink).single, z)) for z in depths_mm}
    for translation_mm in TRANSLATIONS_MM:
        pair = real_pair(translation_mm=(translation_mm,) * 3, shrink=shrink)
        curves = {way: np.array([_measured(pair, way, z, alone[z]) for z in depths_mm]) for way in WAYS}
        for way, found in curves.items():
            records += _records(f"{way}_{translation_mm:g}mm", f"{WORDS[way]}, {translation_mm:g} mm", found)
        graphs.append(_graphs(f"{translation_mm:g} mm apart", depths, curves))
    path = out / "depth.png"
    draw_panels(path, "a pair 1 degree and 0.5 or 5 mm apart on every axis: error against depth", graphs)
    known = {one.name: one.value for one in records}
    drift = " and ".join(f"{known[f'corrected_{t:g}mm_infrared_rms_rad']:.3g} rad at {t:g} mm" for t in TRANSLATIONS_MM)
    kept = max(known[f"searched_{t:g}mm_infrared_rms_rad"] for t in TRANSLATIONS_MM)
    verdict = f"the pre-deformed image is off by up to {drift}; the search along the ray by {kept:.2g} rad at any depth"
    return Reproduction(tuple(records), (path,), verdict)


def _records(name: str, words: str, found: NDArray[np.float64]) -> list[Figure]:
    """Name the worst of the errors over all depths, (depths, 4)."""
    worst = [*found[:, :3].max(axis=0).tolist(), float(found[:, 3].min())]
    kinds = (
        ("infrared_rms_rad", "infrared fringes against expectation", "rad RMS"),
        ("rms_rad", "unwrapped phase against one projector", "rad RMS"),
        ("wrong_order_percent", "wrong orders", "%"),
        ("returned_percent", "returned", "%"),
    )
    return [
        Figure(f"{name}_{key}", f"{words}: {what}", value, unit)
        for (key, what, unit), value in zip(kinds, worst, strict=True)
    ]


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
        ("infrared fringes, error", "rad RMS at 36 fringes", True),
        ("unwrapped phase, error", "rad RMS", True),
        ("wrong orders", "% of the returned pixels", False),
    )
    return [
        Graph(
            f"{words}, {title}",
            "depth of the plane, mm",
            unit,
            {WORDS[way]: (depths, found[:, i]) for way, found in curves.items()},
            log=log,
        )
        for i, (words, unit, log) in enumerate(quantities)
    ]
