"""A shot that was exposed too long is measured with what its fringes still show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.evaluation import world
from quadfringe.evaluation._saturated import Highlight, overexposed, saturated_share


@pytest.fixture(scope="module")
def calibration() -> qf.Calibration:
    with qf.open(qf.SystemConfig()) as scanner:
        return scanner.calibration


@pytest.mark.parametrize("name", ["steps", "painted_face"])
def test_fringes_that_are_cut_off_are_measured(name: str, calibration: qf.Calibration) -> None:
    taken = world.take(name, world.REPORT[0])
    shot = overexposed(taken.shot, 1.3)
    hold("saturated.share", saturated_share(shot)[0])
    plan = qf.Plan(calibration.projector.width_px, calibration=calibration, response="linear")
    with pytest.warns(qf.DecodeWarning, match=r"too much light: .*% of red"):
        shape = qf.Decoder(shot, plan).decode(shot)
    found = world.judge(shape, taken)
    hold(f"saturated.{name}_rms_mm", found.rms_mm)
    hold(f"saturated.{name}_returned_percent", found.returned_percent)
    hold("saturated.wrong_percent", found.wrong_percent)
    hold("saturated.inside_2_percent", found.inside_2_percent)


@pytest.mark.parametrize("name", ["face", "steps"])
def test_a_highlight_is_measured_by_the_channels_that_it_leaves(name: str, calibration: qf.Calibration) -> None:
    taken = world.take(name, world.REPORT[0])
    spot = Highlight((500.0, 384.0), radius_px=45.0, gain=2.0)
    shot = spot.on(taken.shot)
    hold("highlight.share", saturated_share(shot)[0])
    plan = qf.Plan(calibration.projector.width_px, calibration=calibration, response="linear")
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    inside = spot.inside(taken.lit.shape)
    found = world.judge(shape, replace(taken, lit=taken.lit & inside))
    hold("highlight.rms_mm", found.rms_mm)
    hold("highlight.returned_percent", found.returned_percent)
    hold("highlight.inside_2_percent", found.inside_2_percent)
    outside = world.judge(shape, replace(taken, lit=taken.lit & ~inside))
    hold("highlight.outside_rms_mm", outside.rms_mm)


def test_a_spot_that_is_saturated_in_all_channels_has_its_reason(calibration: qf.Calibration) -> None:
    taken = world.take("steps", world.REPORT[0])
    planes = {name: image.copy() for name, image in taken.shot.channels.items()}
    for image in planes.values():
        image[300:420, 400:560] = 255
    shot = qf.Shot(**planes)
    plan = qf.Plan(calibration.projector.width_px, calibration=calibration, response="linear")
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    inside = shape.reason[320:400, 420:540]
    assert not np.isfinite(shape.phase_rad[320:400, 420:540]).any()
    assert (inside == qf.Reason.SATURATED).all()
