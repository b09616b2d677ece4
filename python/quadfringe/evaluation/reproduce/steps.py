"""A set of steps: isolated surfaces at known heights, in one shot."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quadfringe.calibration.acceptance import STEP_HEIGHTS_MM
from quadfringe.calibration.surfaces import measure_steps
from quadfringe.config import Device
from quadfringe.data import xyz_mm_of
from quadfringe.evaluation.reproduce._scene import METHODS, draw, figures_of, measured, wrong_words
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph

__all__ = ["steps"]


def steps(out: Path, camera: Device | None = None) -> Reproduction:
    """Measure steps of 5 to 50 mm in one shot of the virtual bench, 3 % noise, 8 bit.

    `camera` replaces the camera of the published bench. Writes `out`/steps.png. Figures, for the published and the
    joint method: depth RMS in mm over the right orders away from edges, wrong orders and returned pixels in per cent,
    and the greatest error of the height of a step in mm.
    """
    seen = measured("steps", camera)
    found = {m: measure_steps(xyz_mm_of(seen.shapes[m]), STEP_HEIGHTS_MM) for m in METHODS}
    errors = {m: np.array(one.errors_mm) for m, one in found.items()}
    records = [
        *figures_of("steps", seen),
        *(
            Figure(f"steps_{m}_height_error_mm", f"{METHODS[m]}: height of a step, worst", float(np.abs(e).max()), "mm")
            for m, e in errors.items()
        ),
    ]
    path = out / "steps.png"
    heights = np.array(STEP_HEIGHTS_MM)
    lines = {METHODS[m]: (heights, e) for m, e in errors.items()}
    last = Graph("error of the height of each step", "height of the step, mm", "mm", lines, limit=("no error", 0.0))
    draw(path, "steps in one shot, 3 % noise, 8 bit", seen, last, painted=True)
    joint, published = (f"{np.abs(errors[m]).max():.2g} mm" for m in ("joint", "published"))
    verdict = (
        f"steps of 5 to 50 mm are right within {joint} by the joint method; by the published one within {published}, "
        f"and {wrong_words(seen)}"
    )
    return Reproduction(tuple(records), (path,), verdict)
