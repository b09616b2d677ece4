"""From nothing to a metric shape with one projector and a webcam, by the commands of docs/formats.md."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import typer
from support.bars import hold
from support.lit_scene import CROSSTALK, LitScene, Webcam
from support.screens import FakeWindow, windows
from support.videos import let_opencv_open
from typer.testing import CliRunner, Result

from quadfringe.calibration.session import session_of
from quadfringe.calibration.session.virtual import VirtualCaptures
from quadfringe.cli.app import app
from quadfringe.data import Calibration, Shape

__all__ = ["windows"]

SYSTEM = """
[capture]
kind = "uvc"
device = "0"
exposure_us = 66700
gamma = 100
skip_frames = 0

[projectors.visible]
kind = "hdmi"
size_px = [1280, 720]
frame_rate_hz = 60
settle_s = 0.0

[fringes]
encoding = "rgb"
"""


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch, windows: list[FakeWindow]) -> LitScene:
    """A webcam before a scene, and a person who does what the prompts say."""
    lit = LitScene()
    captures = VirtualCaptures(lit.config, session_of(lit.config, "virtual", poses=7))
    let_opencv_open(Webcam(lit, windows), monkeypatch)
    monkeypatch.setattr("quadfringe.devices.lightcrafter.outputs", lambda _=None: [("HDMI-1", 1280, 720, 60.0, None)])

    def person(words: str, **_: object) -> str:
        step, _, name = words.partition(":")[0].partition("/")
        captures._place(lit.bench, *((step, name) if name else ("levels", "")))
        return ""

    monkeypatch.setattr(typer, "prompt", person)
    return lit


def quadfringe(*words: object, fails: int = 0) -> Result:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == fails, done.output
    return done


def calibrated(folder: Path) -> Calibration:
    """Plan a session, take its captures, and calibrate; fewer images than a person would take."""
    system, session, out = folder / "system.toml", folder / "session", folder / "calibration.json"
    quadfringe("calibrate", "plan", session, "--rig", "webcam", "--system", system, "--poses", 7)
    settings = json.loads((session / "session.json").read_text())
    assert (settings["projector_size_px"], settings["fringes"]["encoding"]) == ([1280, 720], "rgb")
    (session / "session.json").write_text(json.dumps(settings | {"phase_steps": 5, "level_steps": 5}))
    steps = [word for step in ("dark", "levels", "poses") for word in ("--step", step)]
    taken = quadfringe("calibrate", "capture", session, "--system", system, *steps)
    assert "34 captures taken" in taken.stdout
    told = quadfringe("calibrate", "run", "--captures", session, "--out", out).stdout
    assert 'use it with calibration = "calibration.json"' in told
    return Calibration.load(out)


def test_from_nothing_to_a_metric_shape(tmp_path: Path, scene: LitScene) -> None:
    """The whole walk takes about 20 s, most of them for the 210 images of seven poses."""
    system, shape_file = tmp_path / "system.toml", tmp_path / "face.npz"
    assert 'kind = "hdmi" with size_px = [1280, 720]' in quadfringe("projector", "screens").stdout
    system.write_text(SYSTEM)
    quadfringe("calibrate", "response", "--system", system, "--out", tmp_path / "response.json")
    calibration = calibrated(tmp_path)
    error = np.array(calibration.crosstalk)[:3, :3] - CROSSTALK
    hold("rgb.walk_crosstalk_percent", 100 * np.abs(error).max())

    system.write_text(f'calibration = "calibration.json"\n{SYSTEM}')
    scene.bench.place_scene("face")
    quadfringe("measure", system, "--out", shape_file)
    shape, truth = Shape.load(shape_file), scene.truth
    assert shape.depth_mm is not None
    sound = ~truth.edge & ~truth.shadow & np.isfinite(truth.xyz_mm[..., 2])
    hold("rgb.walk_returned_percent", 100 * shape.returned[sound].mean())
    error_mm = (shape.depth_mm - truth.xyz_mm[..., 2])[sound & shape.returned]
    hold("rgb.walk_depth_rms_mm", np.sqrt(np.mean(error_mm**2)))
    hold("rgb.walk_depth_bias_mm", np.median(error_mm))

    system.write_text(f'{system.read_text()}\n[decode]\nresponse = "response.json"\n')
    both = quadfringe("measure", system, "--out", shape_file, fails=2)
    assert "this calibration holds a response of the projector too; leave the response out" in both.stderr
