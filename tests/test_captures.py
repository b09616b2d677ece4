"""Real captures of a projector with uncorrected response, decoded as any user would decode them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.bars import hold

from quadfringe import ResponseCalibration, Shape
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring

MAPS = ("phase_rad", "column_px", "order", "modulation", "quality")


def quadfringe(*words: object) -> None:
    command = [str(Path(sys.executable).with_name("quadfringe")), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module", params=scenes.CAPTURES)
def scene(request: pytest.FixtureRequest, data_dir: Path) -> scoring.Scene:
    return scenes.capture(data_dir, request.param)


@pytest.fixture(scope="module")
def response_file(scene: scoring.Scene, data_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp(scene.name) / "response.json"
    files = scenes.step_files(data_dir, scene.name)
    quadfringe("calibrate", "response", "--steps", scenes.STEPS, *files, "--out", out)
    return out


def assert_bars(score: scoring.Score, right: str = "captures.right_percent") -> None:
    hold(right, score.right_percent)
    hold("captures.right_of_returned_percent", score.right_of_returned_percent)


def test_command_line_decodes_a_capture(scene: scoring.Scene, response_file: Path, tmp_path: Path) -> None:
    words: list[object] = []
    for name, image in scene.channels.items():
        cv2.imwrite(str(tmp_path / f"{name}.png"), image)
        words += [f"--{name}", tmp_path / f"{name}.png"]
    words += ["--fringes", 45.714285714, 42.666666667, 40, "--projector-width", 1920]
    out = tmp_path / "shape.npz"
    quadfringe("decode", *words, "--response", response_file, "--out", out)
    with np.load(out) as maps:
        assert_bars(scoring.score(scene, maps["phase_rad"]))
        for name in (*MAPS, "wrong_order_probability", "uncertainty_rad"):
            assert maps[name].shape == scene.red.shape
            assert maps[name].dtype == np.float32
        returned = np.isfinite(maps["phase_rad"])
        order = np.floor(maps["phase_rad"][returned] / (2 * np.pi))
        assert (np.abs(maps["order"][returned] - order) <= 1).all()  # equal except for rounding
        assert "xyz_mm" not in maps


@pytest.fixture(scope="module")
def shapes(scene: scoring.Scene, response_file: Path) -> dict[str, Shape]:
    """The capture decoded with the response uncorrected, estimated from the shot, and known from twelve steps."""
    known = ResponseCalibration.load(response_file)
    responses = {"linear": "linear", "auto": "auto", "known": known}
    return {name: scenes.shape_of(scene, response=response) for name, response in responses.items()}


def test_package_decodes_a_capture(scene: scoring.Scene, shapes: dict[str, Shape]) -> None:
    assert_bars(scoring.score(scene, shapes["known"].phase_rad))


def test_wrong_orders_are_as_many_as_the_probabilities_say(scene: scoring.Scene, shapes: dict[str, Shape]) -> None:
    for response, shape in shapes.items():
        assert shape.wrong_order_probability is not None
        seen = scene.scored & shape.returned
        wrong = np.abs(shape.phase_rad - scene.phase_rad)[seen] >= np.pi
        probability = shape.wrong_order_probability[seen]
        hold("captures.wrong_over_expected", wrong.sum() / probability.sum())
        # The probability is useful: most of the object has a small one, and hardly any of those pixels is wrong.
        sure = probability < 0.01
        hold("captures.sure_of_object", np.count_nonzero(sure) / np.count_nonzero(scene.scored))
        hold("captures.sure_of_returned_known" if response == "known" else "captures.sure_of_returned", sure.mean())
        hold("captures.wrong_of_sure", wrong[sure].mean())


def test_the_response_is_estimated_from_a_capture(
    scene: scoring.Scene, shapes: dict[str, Shape], response_file: Path
) -> None:
    assert shapes["auto"].config["response_from"] == "shots"
    scores = [scoring.score(scene, shapes[name].phase_rad) for name in ("auto", "known")]
    assert_bars(scores[0], "captures.auto_right_percent")
    # Nearly as good as the response from twelve images of each channel, on both captures.
    hold("captures.auto_right_below_known_percent", scores[1].right_percent - scores[0].right_percent)
    hold("captures.auto_phase_over_known", scores[0].right_phase_rms_rad / scores[1].right_phase_rms_rad)
    exponents = np.array([list(channel.values()) for channel in shapes["auto"].config["response"].values()])[:, 1]
    known = ResponseCalibration.load(response_file)
    hold("captures.auto_exponent_error", np.abs(exponents - known.red.exponent))


def test_the_published_method_uses_the_estimated_response(scene: scoring.Scene) -> None:
    auto, linear = (
        scoring.score(scene, scenes.shape_of(scene, response=response, method="published").phase_rad)
        for response in ("auto", "linear")
    )
    hold("captures.published_gain_percent", auto.right_percent - linear.right_percent)
    hold("captures.published_gain_percent", auto.right_of_returned_percent - linear.right_of_returned_percent)


def test_an_uncorrected_capture_is_still_ordered(scene: scoring.Scene, shapes: dict[str, Shape]) -> None:
    score = scoring.score(scene, shapes["linear"].phase_rad)
    hold("captures.linear_right_of_returned_percent", score.right_of_returned_percent)
    hold("captures.linear_right_percent", score.right_percent)


def test_the_response_makes_the_phase_better(scene: scoring.Scene, shapes: dict[str, Shape]) -> None:
    phases_rad = [shapes[name].phase_rad for name in ("linear", "known")]
    raw, linear = (scoring.score(scene, phase_rad) for phase_rad in phases_rad)
    hold("captures.response_gain_percent", linear.right_percent - raw.right_percent)
    hold("captures.phase_of_uncorrected", linear.right_phase_rms_rad / raw.right_phase_rms_rad)
    # The pixels that are returned only with linear light lie at steep rims and have the largest errors.
    off_rad = [np.abs(phase_rad - scene.phase_rad) for phase_rad in phases_rad]
    both = scene.scored & (off_rad[0] < np.pi) & (off_rad[1] < np.pi)
    before, after = (scoring.rms(off[both]) for off in off_rad)
    hold("captures.phase_of_uncorrected_same_pixels", after / before)


def test_both_captures_tell_of_the_same_projector(data_dir: Path, tmp_path: Path) -> None:
    exponents = []
    for name in scenes.CAPTURES:
        out = tmp_path / f"{name}.json"
        files = scenes.step_files(data_dir, name)
        quadfringe("calibrate", "response", "--steps", scenes.STEPS, *files, "--out", out)
        exponents.append(json.loads(out.read_text())["red"]["exponent"])
    hold("captures.exponent", exponents)
    hold("captures.exponents_apart", abs(exponents[0] - exponents[1]))


def test_all_three_stacks_may_be_given_at_once(data_dir: Path, tmp_path: Path) -> None:
    files = [f for k in range(3) for f in scenes.step_files(data_dir, "plate", k)]
    assert len(files) == 3 * scenes.STEPS
    out = tmp_path / "response.json"
    quadfringe("calibrate", "response", "--steps", scenes.STEPS, *files, "--out", out)
    hold("captures.exponent", json.loads(out.read_text())["ir"]["exponent"])
