"""Bright objects before a ground whose fringes are as weak as the noise: the ground decides about the period."""

from __future__ import annotations

import pytest
from support.bars import hold
from support.scenes import figures_of


@pytest.mark.parametrize("seed", [5, 11])
def test_bright_rods_do_not_set_the_period_of_a_dark_wall(seed: int) -> None:
    found = figures_of("rods", seed)
    hold("dim_ground.returned_percent", found.returned_percent)
    hold("dim_ground.wrong_order_percent", found.wrong_percent)
