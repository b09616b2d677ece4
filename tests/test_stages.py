"""The stages, composed by hand in Python, give the bits of the published decoder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold

import quadfringe as qf
from quadfringe import _core
from quadfringe.data import core_device
from quadfringe.decoding import stages

NUMBERS = (36.0, 35.0, 30.0)
WIDTH_PX = 912
LIMITS = {"modulation_min": 0.02, "quality_min": 0.15}
PUBLISHED = qf.DecodeConfig(method="published")
LINEAR = qf.Response()
Map = NDArray[np.float32]


def grab(surface: str, seed: int) -> tuple[qf.Shot | qf.BayerShot, qf.Calibration]:
    scene = qf.SceneConfig(surface=surface, noise=0.03, seed=seed)
    with qf.open(qf.SystemConfig(scene=scene)) as scanner:
        calibration = scanner.calibration
        assert calibration is not None, "the virtual bench is calibrated"
        return scanner.grab(), calibration


def by_hand(
    shot: qf.Shot | qf.BayerShot, calibration: qf.Calibration | None, rays: _core.PairTable | None = None
) -> dict[str, Map]:
    """Follow the recipe of `quadfringe.decoding.stages`."""
    light = stages.linear_light(shot, calibration, LINEAR)
    wrapped = stages.demodulate(light, NUMBERS)
    phase_rad, margin = stages.order(wrapped, NUMBERS, WIDTH_PX, rays)
    phase_rad, quality = stages.discard_invalid(phase_rad, margin, wrapped.modulation, **LIMITS)
    phase_rad, column_px = stages.columns_from_phase(phase_rad, NUMBERS, WIDTH_PX)
    wrong = stages.wrong_order_probability(quality)
    wrong[np.isnan(phase_rad)] = np.nan
    return {
        "phase_rad": phase_rad,
        "column_px": column_px,
        "modulation": wrapped.modulation,
        "quality": quality,
        "wrong_order_probability": wrong,
    }


def assert_same_bits(found: dict[str, Map], shape: qf.Shape) -> None:
    assert np.isfinite(shape.phase_rad).mean() > 0.1
    for name, values in found.items():
        expected = getattr(shape, name)
        assert values.dtype == expected.dtype == np.float32
        differing = (values != expected) & ~(np.isnan(values) & np.isnan(expected))
        assert not differing.any(), f"{name}: {differing.sum()} pixels differ"


@pytest.mark.parametrize(("surface", "seed"), [("plane", 1), ("steps", 2), ("face", 3)])
def test_stages_give_the_bits_of_the_decoder(surface: str, seed: int) -> None:
    shot, calibration = grab(surface, seed)
    for known in (None, calibration):
        plan = qf.Plan(WIDTH_PX, calibration=known, response=LINEAR, decode=PUBLISHED)
        assert_same_bits(by_hand(shot, known), qf.Decoder(shot, plan).decode(shot))


def test_stages_give_the_bits_of_the_decoder_with_crosstalk_and_registration() -> None:
    shot, calibration = grab("face", 4)
    crosstalk = np.eye(4)
    crosstalk[0, 1], crosstalk[3, 0] = 0.02, 0.01
    registration = ((1.0, 0.0002, 0.9), (-0.0002, 1.0, -0.6))
    known = calibration.model_copy(
        update={
            "crosstalk": tuple(map(tuple, crosstalk.tolist())),
            "dark": (0.01, 0.012, 0.01, 0.005),
            "ir_registration": registration,
        }
    )
    plan = qf.Plan(WIDTH_PX, calibration=known, response=LINEAR, decode=PUBLISHED)
    found = by_hand(shot, known)
    assert np.isnan(found["modulation"]).any(), "registration leaves gaps"
    assert_same_bits(found, qf.Decoder(shot, plan).decode(shot))


def test_a_search_along_the_rays_gives_the_bits_of_the_decoder() -> None:
    shot, calibration = grab("sphere", 5)
    known = calibration.model_copy(update={"infrared": calibration.projector})
    camera, projector = core_device(calibration.camera), core_device(calibration.projector)
    rays = _core.PairTable(camera, projector, projector, NUMBERS)
    decode = qf.DecodeConfig(method="published", unwrapping="pair")
    plan = qf.Plan(WIDTH_PX, calibration=known, response=LINEAR, decode=decode)
    assert_same_bits(by_hand(shot, known, rays), qf.Decoder(shot, plan).decode(shot))


def test_wrapped_phases_are_wrapped_and_agree_with_the_absolute_phase() -> None:
    shot, calibration = grab("plane", 6)
    light = stages.linear_light(shot, calibration)
    phases = stages.wrapped_phases(light, NUMBERS)
    plan = qf.Plan(WIDTH_PX, calibration=calibration, response=LINEAR, decode=PUBLISHED)
    absolute = qf.Decoder(shot, plan).decode(shot).phase_rad
    for wrapped, number in zip(phases, NUMBERS, strict=True):
        assert np.abs(wrapped).max() < np.pi + 1e-5
        error = np.angle(np.exp(1j * (wrapped - absolute * number / NUMBERS[0])))
        hold("stages.wrapped_median_rad", np.nanmedian(np.abs(error)))


def test_a_row_without_fringes_is_an_error() -> None:
    flat = np.full((32, 256), 0.5, np.float32)
    with pytest.raises(qf.DecodeError, match="no fringes cross the rows"):
        stages.demodulate({"red": flat, "green": flat, "blue": flat, "ir": flat}, NUMBERS)


def test_a_response_means_the_same_as_in_a_plan(tmp_path: Path) -> None:
    shot, calibration = grab("plane", 7)
    bent = qf.ResponseCalibration(red={"exponent": 0.5})
    known = calibration.model_copy(update={"response": qf.Response(red={"exponent": 0.5})})
    bent.save(tmp_path / "response.json")
    known.save(tmp_path / "calibration.json")
    expected = stages.linear_light(shot, known)["red"]
    linear = stages.linear_light(shot, known, "linear")["red"]
    assert not np.array_equal(expected, linear, equal_nan=True)
    for arguments in (
        (known, "auto"),
        (tmp_path / "calibration.json", "calibration"),
        (calibration, bent),
        (calibration, str(tmp_path / "response.json")),
    ):
        np.testing.assert_array_equal(stages.linear_light(shot, *arguments)["red"], expected)
    for arguments in ((None, "linear"), (None, "calibration"), (calibration, "calibration")):
        np.testing.assert_array_equal(stages.linear_light(shot, *arguments)["red"], linear)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"response": None}, 'response: expected "auto", "linear", .* got None'),
        ({"response": "foo"}, 'response: expected "auto", "linear"'),
        ({"response": "auto"}, 'call qf.estimate_response first, or pass response="linear"'),
        ({"calibration": "no.json"}, "no.json: No such file"),
        ({"calibration": 5}, "calibration: expected a Calibration"),
    ],
)
def test_linear_light_names_the_argument_at_fault(arguments: dict[str, Any], reason: str) -> None:
    with pytest.raises(qf.InputError, match=reason):
        stages.linear_light(qf.Shot(*(np.zeros((8, 8), np.uint8),) * 4), **arguments)


def test_both_estimates_say_linear_where_no_response_shows() -> None:
    shot, _ = grab("plane", 8)
    assert qf.estimate_response(shot, qf.Plan(WIDTH_PX)) == "linear"
    flat = np.zeros((64, 64), np.float32)
    assert stages.response_of_shot(qf.Shot(flat, flat, flat, flat), flat, NUMBERS, WIDTH_PX) == "linear"
