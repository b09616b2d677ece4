"""Bright objects before a ground whose fringes are as weak as the noise: the ground decides about the period."""

from __future__ import annotations

import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.evaluation import world


@pytest.mark.parametrize("seed", [5, 11])
def test_bright_rods_do_not_set_the_period_of_a_dark_wall(seed: int) -> None:
    take = world.take("rods", seed)
    with qf.open(qf.SystemConfig()) as scanner:
        calibration = scanner.calibration
    assert calibration is not None
    plan = qf.Plan(
        calibration.projector.width_px,
        fringes=qf.Fringes(numbers=take.fringe_numbers),
        calibration=calibration,
        response="linear",
    )
    found = world.judge(qf.Decoder(take.shot, plan).decode(take.shot), take)
    hold("dim_ground.returned_percent", found.returned_percent)
    hold("dim_ground.wrong_order_percent", found.wrong_percent)
