"""`calibrate response --system`: the projector shows steps, the camera takes them, each channel gets a response."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.bars import tolerance
from support.screens import GAMMA, SYSTEM, FakeWindow, capture, screen, windows
from typer.testing import CliRunner

from quadfringe.calibration.response import WalkThrough, estimate_from_steps, take_steps
from quadfringe.cli.app import app
from quadfringe.config import ProjectorsConfig
from quadfringe.data import ResponseCalibration
from quadfringe.devices.hdmi import PICTURE_MODES, HdmiProjectors
from quadfringe.devices.uvc import UvcCamera
from quadfringe.errors import InputError

__all__ = ["capture", "windows"]


@pytest.mark.usefixtures("capture")
def test_the_walk_through_measures_any_projector_with_any_camera(tmp_path: Path) -> None:
    later = f'calibration = "calibration.json"\n{SYSTEM}\n[decode]\nresponse = "response.json"\n'  # none exists yet
    (tmp_path / "system.toml").write_text(later)
    out = tmp_path / "response.json"
    command = ["calibrate", "response", "--system", str(tmp_path / "system.toml"), "--out", str(out), "--json", "-"]
    done = CliRunner().invoke(app, command, input="\n")
    assert done.exit_code == 0, done.output
    found = ResponseCalibration.load(out)
    exponents = [found.red.exponent, found.green.exponent, found.blue.exponent]
    np.testing.assert_allclose(exponents, 1 / GAMMA, atol=tolerance("response.steps_exponent_error"))
    assert (found.ir.exponent, found.steps, found.inputs) == (1.0, 16, ("uvc:0",))
    assert all(words in done.stderr for words in (*PICTURE_MODES, "image 18 of 18", "press Enter"))
    assert "warning" not in done.stderr
    assert json.loads(done.stdout)["figures"].keys() >= {"steadiness_percent", "red_exponent", "blue_offset"}


@pytest.mark.usefixtures("capture")
def test_light_from_elsewhere_is_no_part_of_the_response() -> None:
    with HdmiProjectors(ProjectorsConfig(visible=screen())) as projector, UvcCamera() as camera:
        taken = take_steps(projector, camera, WalkThrough())
    limit = tolerance("response.steps_exponent_error")
    with_black = estimate_from_steps(taken).calibration.green
    assert with_black.exponent == pytest.approx(1 / GAMMA, abs=limit)
    unaware = replace(taken, dark={name: np.zeros_like(image) for name, image in taken.dark.items()})
    without = estimate_from_steps(unaware).calibration.green
    print(f"exponent {without.exponent:.3f} without a black image, {with_black.exponent:.3f} with one")
    assert abs(without.exponent - 1 / GAMMA) > limit


@pytest.mark.usefixtures("capture")
def test_a_lamp_that_follows_the_image_is_found(windows: list[FakeWindow]) -> None:
    with HdmiProjectors(ProjectorsConfig(visible=screen())) as projector, UvcCamera() as camera:
        windows[0].follows = 0.1
        found = estimate_from_steps(take_steps(projector, camera, WalkThrough()))
    assert "brighter or darker after white than after black: switch off dynamic contrast" in found.doubts[0]


@pytest.mark.usefixtures("capture")
def test_images_that_give_no_response_are_named() -> None:
    with HdmiProjectors(ProjectorsConfig(visible=screen())) as projector, UvcCamera() as camera:
        taken = take_steps(projector, camera, WalkThrough(steps=8))
    dark = replace(taken, stacks={name: 0.001 * stack for name, stack in taken.stacks.items()})
    with pytest.raises(InputError, match=r"red: .*; light a matt white surface that fills the image"):
        estimate_from_steps(dark)
    posterised = replace(taken, stacks={name: np.round(4 * stack) / 4 for name, stack in taken.stacks.items()})
    assert (
        "harmonics are left, so that no smooth response explains the images"
        in estimate_from_steps(posterised).doubts[0]
    )


def test_the_walk_through_on_the_virtual_bench_takes_infrared_too(tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(
        "[scene]\nsurface = 'plane'\nnoise = 0.005\nseed = 1\nambient = [0, 0, 0, 0]\n"
        "projector_exponent = [2.0, 2.0, 2.0, 1.5]\n[camera]\nwidth_px = 320\nheight_px = 240\nfocal_px = [806, 806]\n"
        "centre_px = [159.5, 119.5]\n"
    )
    out = tmp_path / "response.json"
    command = ["calibrate", "response", "--system", str(tmp_path / "system.toml"), "--out", str(out), "--number", "36"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    found = ResponseCalibration.load(out)
    exponents = [row[1] for row in found.rows]
    expected = [1 / 2.0, 1 / 2.0, 1 / 2.0, 1 / 1.5]
    np.testing.assert_allclose(exponents, expected, atol=tolerance("response.steps_exponent_error"))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ([], "give the FILES of an N-step capture, or --system FILE"),
        (["x.png"], "--steps is missing"),
        (["x.png", "--steps", "4", "--camera", "virtual:"], "give one of them"),
        (["--camera", "virtual:", "--channel", "ir"], "--system takes all channels"),
        (["--camera", "replay:no.h5"], "no.h5"),
    ],
)
def test_words_at_fault(tmp_path: Path, words: list[str], reason: str) -> None:
    done = CliRunner().invoke(app, ["calibrate", "response", *words, "--out", str(tmp_path / "r.json")])
    assert done.exit_code == 2
    assert reason in done.stderr
