"""How far the infrared projector may deviate from the visible one before the published unwrapping fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.projector_pair import AXES
from quadfringe.evaluation.reproduce._pair_bench import FRINGES, PLANE_MM, ProjectorPair, ideal_pair
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, draw_panels

__all__ = ["orders_are_right", "tolerance", "tolerances"]

LIMITS = (5.0, 5.0, 5.0, 100.0, 100.0, 100.0)  # deg and mm: beyond them the infrared light leaves the field of view
TIMES, POINTS = 4.0, 15  # curves reach this multiple of the allowable deviation
PRECISION = 1e-3  # relative precision of a tolerance


def tolerance(out: Path, shrink: int = 4) -> Reproduction:
    """Find the largest deviation of each of the six parameters for which every order of a plane is still right.

    Every `shrink`-th camera pixel is checked. Writes `out`/tolerance.png: the share of wrong orders against each
    deviation. The figures have the names of `quadfringe.calibration.projector_pair.AXES`, in deg and mm; one that
    equals its entry in `LIMITS`, where the search ends, is marked `at_least`: it does no harm within the field.
    """
    found = tolerances(shrink)
    records = tuple(
        Figure(axis, f"allowable deviation, {axis[:2]}", allowed, axis[3:], at_least=allowed >= limit)
        for (axis, allowed), limit in zip(found.items(), LIMITS, strict=True)
    )
    path = out / "tolerance.png"
    graphs = [_graph(kind, [one for one in records if one.unit == kind], shrink) for kind in ("deg", "mm")]
    draw_panels(path, "allowable deviations of the infrared projector", [graphs])
    allowed = ", ".join(f"{one.name[:2]} {one.shown} {one.unit}" for one in records)
    return Reproduction(records, (path,), f"every order of the plane is right up to: {allowed}")


def _graph(kind: str, records: list[Figure], shrink: int) -> Graph:
    """Draw the share of wrong orders against the deviation, as a multiple of the allowable one."""
    lines = {}
    for one in records:
        reach = LIMITS[AXES.index(one.name)] / one.value
        times = np.geomspace(0.1, max(1.0, min(TIMES, reach)), POINTS)
        wrong = np.array([_wrong_percent(_deviated(one.name, t * one.value, shrink)) for t in times])
        lines[f"{one.name[:2]}: {one.shown} {kind}"] = (times * one.value, wrong)
    return Graph(f"one parameter at a time, {kind}", f"deviation, {kind}", "wrong orders, %", lines, log_x=True)


def tolerances(shrink: int = 4) -> dict[str, float]:
    """Return the largest allowable deviation of each parameter, in either direction, by bisection on exact phases."""
    return {axis: min(_tolerance(axis, sign, shrink) for sign in (1.0, -1.0)) for axis in AXES}


def _tolerance(axis: str, sign: float, shrink: int) -> float:
    limit = LIMITS[AXES.index(axis)]
    right, wrong = 0.0, limit / 2**10
    while orders_are_right(_deviated(axis, sign * wrong, shrink)):
        if wrong >= limit:
            return limit
        right, wrong = wrong, min(2 * wrong, limit)
    while wrong - right > PRECISION * wrong:
        middle = (right + wrong) / 2
        if orders_are_right(_deviated(axis, sign * middle, shrink)):
            right = middle
        else:
            wrong = middle
    return right


def _deviated(axis: str, deviation: float, shrink: int) -> ProjectorPair:
    values = [0.0] * len(AXES)
    values[AXES.index(axis)] = deviation
    return ideal_pair((values[0], values[1], values[2]), (values[3], values[4], values[5]), shrink)


def orders_are_right(pair: ProjectorPair, z_mm: float = PLANE_MM) -> bool:
    """Return whether the published unwrapping finds every order of a plane from exact phases."""
    return not _misses(pair, z_mm).any()


def _wrong_percent(pair: ProjectorPair) -> float:
    return 100.0 * float(_misses(pair, PLANE_MM).mean())


def _misses(pair: ProjectorPair, z_mm: float) -> NDArray[np.bool_]:
    """Return which of the pixels that both projectors light have a wrong order, (n,)."""
    cast = pair.bench.cast_plane(point_mm=(0.0, 0.0, z_mm), normal=(0.0, 0.0, -1.0))
    columns = [cast.column_px(), cast.column_px(), cast.column_px(infrared=True)]
    width = pair.visible.width_px
    phases = [
        2 * np.pi * number / width * column.astype(np.float64)
        for number, column in zip(FRINGES.numbers, columns, strict=True)
    ]
    wrapped = [np.angle(np.exp(1j * phase)).astype(np.float32) for phase in phases]
    found, _ = _core.unwrap(wrapped[0], wrapped[1], wrapped[2], FRINGES.numbers, width)
    lit = np.isfinite(phases[0]) & np.isfinite(phases[2])
    return ~(np.abs(found[lit] - phases[0][lit]) < np.pi)
