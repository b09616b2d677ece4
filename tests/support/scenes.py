"""Shots of the scenes of `quadfringe.evaluation.world`, decoded and judged."""

from __future__ import annotations

import quadfringe as qf
from quadfringe.evaluation import world

__all__ = ["figures_of"]


def figures_of(name: str, seed: int) -> world.Figures:
    """Decode one shot of a scene with the calibration of its bench and a known response; give its figures."""
    take = world.take(name, seed)
    with qf.open(qf.SystemConfig()) as scanner:
        calibration = scanner.calibration
    assert calibration is not None
    plan = qf.Plan(
        calibration.projector.width_px,
        fringes=qf.Fringes(numbers=take.fringe_numbers),
        calibration=calibration,
        response="linear",
    )
    return world.judge(qf.Decoder(take.shot, plan).decode(take.shot), take)
