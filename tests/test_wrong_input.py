"""What a person may type first: every call with a plausible wrong argument says what it expects."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import quadfringe as qf
from quadfringe import devices, stages

SHOT = qf.Shot(*np.zeros((4, 64, 64), np.uint8))
NUMBERS = (36, 35, 30)


@pytest.mark.parametrize(
    ("plan", "made"),
    [
        (912, "912"),
        (1920, "1920"),
        ("calibration.json", "912, calibration='calibration.json'"),
        (qf.DecodeConfig(threads=1), r"912, decode=DecodeConfig\(threads=1\)"),
        (qf.Fringes(), r"912, fringes=Fringes\(\)"),
        (None, "912"),
    ],
)
@pytest.mark.parametrize("call", [qf.decode, qf.Decoder, qf.estimate_response])
def test_anything_but_a_plan_says_how_to_make_one(call: Callable[..., object], plan: Any, made: str) -> None:
    with pytest.raises(qf.InputError, match=rf"plan: expected a Plan, such as qf.Plan\({made}\), got "):
        call(SHOT, plan)


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda: qf.open_projector("x"), r"config: expected a SystemConfig, .* got 'x'; .* qf.config.load_system"),
        (lambda: devices.open_devices(5), r"config: expected a SystemConfig, such as qf.SystemConfig\(\), got 5"),
        (lambda: qf.Scanner("x", None, None), "config: expected a SystemConfig"),
        (lambda: qf.Scanner(qf.SystemConfig(), None, None, 5), "calibration: expected a Calibration or the path"),
        (lambda: stages.linear_light("shot"), "expected a shot, got the path 'shot'; read it with qf.read_shot"),
        (lambda: stages.response_of_shot(None, None, NUMBERS, 912), "expected a shot, got None"),
        (lambda: stages.order(SHOT, NUMBERS, 912), r"wrapped: expected a Wrapped, .* got Shot\("),
        (lambda: stages.demodulate(None, NUMBERS), "light: expected red, green, blue, ir by name, .* got None"),
        (lambda: stages.demodulate({"red": SHOT.red}, NUMBERS), "light: expected .* got only red"),
        (lambda: stages.demodulate(dict.fromkeys(SHOT.channels, 1), NUMBERS), "red: expected an array .* got int"),
        (lambda: stages.wrapped_phases(SHOT, NUMBERS), "light: expected .* stages.linear_light"),
    ],
)
def test_a_call_says_what_it_expects(call: Callable[[], object], reason: str) -> None:
    with pytest.raises(qf.InputError, match=reason):
        call()
