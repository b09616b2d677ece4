"""Dark surfaces are measured where the noise allows it."""

from __future__ import annotations

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.evaluation._dark import dark
from quadfringe.evaluation.world import Take, judge


@pytest.fixture(scope="module")
def calibration() -> qf.Calibration:
    with qf.open(qf.SystemConfig()) as scanner:
        return scanner.calibration


def shape_of(take: Take, calibration: qf.Calibration, **decode: float) -> qf.Shape:
    plan = qf.Plan(
        calibration.projector.width_px,
        calibration=calibration,
        response="linear",
        decode=qf.DecodeConfig(**decode),
    )
    return qf.Decoder(take.shot, plan).decode_without_verdict(take.shot)


@pytest.mark.parametrize(("name", "share"), [("steps", 0.04), ("face", 0.02)])
def test_a_dark_surface_comes_back_from_a_quiet_camera(name: str, share: float, calibration: qf.Calibration) -> None:
    take = dark(name, share, 0.0005, 4)
    found = judge(shape_of(take, calibration), take)
    hold("dark.returned_percent", found.returned_percent)
    hold("dark.wrong_percent", found.wrong_percent)


def test_the_least_modulation_can_be_set(calibration: qf.Calibration) -> None:
    take = dark("face", 0.02, 0.0005, 4)
    assert not np.isfinite(shape_of(take, calibration, modulation_min=0.02).phase_rad).any()


def test_noise_in_a_shadow_is_no_light(calibration: qf.Calibration) -> None:
    take = dark("steps", 0.04, 0.002, 4)
    returned = np.isfinite(shape_of(take, calibration).phase_rad)
    hold("dark.unlit_percent", 100 * returned[~take.lit].mean())
