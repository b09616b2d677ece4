"""The response (gamma) is estimated from the shot, unless it is known."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.bars import hold, tolerance
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli.app import app
from quadfringe.data import AnyShot, Shape
from quadfringe.evaluation import scoring
from quadfringe.io.images import write_image

WIDTH_PX = 912
PLAN = qf.Plan(WIDTH_PX)
LINEAR = replace(PLAN, response="linear")


def taken(**scene: object) -> qf.Shot:
    config = qf.SystemConfig(scene=qf.SceneConfig.model_validate({"noise": 0.01, "seed": 1, **scene}))
    with qf.open(config) as scanner:
        shot = scanner.grab()
    assert isinstance(shot, qf.Shot)
    return shot


@pytest.fixture(scope="module")
def bent() -> qf.Shot:
    return taken(surface="face", projector_exponent=1.8)


def phase_rms_rad(shape: Shape, shot: AnyShot) -> float:
    assert shot.truth is not None
    error = shape.phase_rad - 2 * np.pi * 36 * shot.truth.column_px / WIDTH_PX
    return scoring.rms(error[np.abs(error) < np.pi])


def test_the_response_of_a_shot_is_undone_and_told(bent: qf.Shot) -> None:
    own, linear = qf.decode(bent, PLAN), qf.decode(bent, LINEAR)
    hold("response.phase_of_uncorrected", phase_rms_rad(own, bent) / phase_rms_rad(linear, bent))
    assert own.config["response_from"] == "shots"
    for channel in own.config["response"].values():
        assert channel["exponent"] == pytest.approx(1 / 1.8, rel=tolerance("response.exponent_error"))
    assert (linear.config["response"], linear.config["response_from"]) == (None, "plan")


def test_many_shots_take_it_from_one(bent: qf.Shot) -> None:
    response = qf.estimate_response(bent, PLAN)
    other = taken(surface="steps", projector_exponent=1.8)
    shape = qf.Decoder(other, replace(PLAN, response=response)).decode(other)
    uncorrected = phase_rms_rad(qf.decode(other, LINEAR), other)
    hold("response.phase_of_uncorrected", phase_rms_rad(shape, other) / uncorrected)


def test_prints_in_bent_light_keep_their_orders() -> None:
    shot = taken(surface="plane", projector_exponent=2.5, patch_mm=10.0)
    assert shot.truth is not None
    own, linear = qf.decode(shot, PLAN), qf.decode(shot, LINEAR)
    for shape in (own, linear):
        error = shape.phase_rad - 2 * np.pi * 36 * shot.truth.column_px / WIDTH_PX
        assert np.all(np.abs(error[shape.returned]) < np.pi)
    hold("response.print_phase_of_uncorrected", phase_rms_rad(own, shot) / phase_rms_rad(linear, shot))
    assert own.returned.sum() > linear.returned.sum()


def test_a_part_of_the_image_will_do(bent: qf.Shot) -> None:
    middle = np.s_[256:512, 384:640]
    printed = taken(surface="plane", patch_mm=10.0, noise=0.03)
    parts = [qf.Shot(*(image[middle].copy() for image in shot.channels.values())) for shot in (bent, printed)]
    found = qf.estimate_response(parts[0], PLAN)
    assert isinstance(found, qf.Response)
    assert found.red.exponent == pytest.approx(1 / 1.8, rel=tolerance("response.exponent_error_part"))
    assert qf.estimate_response(parts[1], PLAN) == "linear"


@pytest.mark.parametrize("scene", [{"surface": "face"}, {"surface": "plane", "patch_mm": 10.0, "noise": 0.03}])
def test_linear_light_is_left_alone(scene: dict[str, object]) -> None:
    shot = taken(**scene)
    shape = qf.decode(shot, PLAN)
    assert shape.config["response"] is None
    assert shape.config["response_from"] == "shots"
    np.testing.assert_array_equal(shape.phase_rad, qf.decode(shot, LINEAR).phase_rad)


def test_what_is_known_is_not_asked_of_the_shot(bent: qf.Shot) -> None:
    with qf.open() as scanner:
        nothing = {"response": None, "crosstalk": None, "projector_response": None}
        silent = scanner.calibration.model_copy(update=nothing)
    known = silent.model_copy(update={"response": qf.Response()})
    for plan, source in ((LINEAR, "plan"), (replace(PLAN, calibration=known), "calibration")):
        assert qf.decode(bent, plan).config["response_from"] == source
        with pytest.raises(qf.InputError, match="has a response"):
            qf.estimate_response(bent, plan)
    shape = qf.decode(bent, replace(PLAN, calibration=silent))
    assert shape.config["response_from"] == "shots"
    assert shape.xyz_mm is not None


def test_the_command_line_tells_it(bent: qf.Shot, tmp_path: Path) -> None:
    words = ["decode", "--fringes", "36", "35", "30", "--projector-width", str(WIDTH_PX), "--json", "-"]
    for name, image in bent.channels.items():
        write_image(tmp_path / f"{name}.png", image)
        words += [f"--{name}", str(tmp_path / f"{name}.png")]
    words += ["--out", str(tmp_path / "shape.npz")]
    own = CliRunner().invoke(app, words)
    assert own.exit_code == 0, own.output
    assert "response estimated from the shot" in own.stderr
    assert json.loads(own.stdout)["figures"]["response_exponent_red"] == pytest.approx(
        1 / 1.8, rel=tolerance("response.exponent_error")
    )
    linear = CliRunner().invoke(app, [*words, "--linear"])
    assert linear.exit_code == 0, linear.output
    assert "response" not in linear.output
    (tmp_path / "response.json").write_text("{}")
    both = CliRunner().invoke(app, [*words, "--linear", "--response", str(tmp_path / "response.json")])
    assert both.exit_code == 2
    assert "--response and --linear" in str(both.exception) + both.output
