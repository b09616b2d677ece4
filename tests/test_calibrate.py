"""`calibrate response`: an N-step capture of a projector whose response is not linear."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from support.bars import hold, tolerance
from typer.testing import CliRunner, Result

from quadfringe import _core
from quadfringe.cli import app
from quadfringe.data import ResponseCalibration
from quadfringe.io.images import write_image

STEPS = 12
GAMMA = 2.0


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Twelve steps of the face under a projector of gamma 2, 8 bit."""
    folder = tmp_path_factory.mktemp("capture")
    bench = _core.Bench(camera=_core.Device(320, 240, (806.0, 806.0), (159.5, 119.5)))
    cast = bench.cast("face")
    paths = [folder / f"step{i:02d}.png" for i in range(STEPS)]
    for i, path in enumerate(paths):
        shift_rad = 2 * math.pi * i / STEPS
        options = {"projector_exponent": (GAMMA,) * 4, "noise": 0.005, "seed": i, "ambient": (0.0,) * 4}
        images = bench.render_step(cast, 36.0, shift_rad, **options)
        write_image(path, images["red"])
    return paths


def calibrate(files: list[Path], *options: object) -> Result:
    return CliRunner().invoke(app, ["calibrate", "response", *map(str, files), *map(str, options)])


def test_the_response_is_found(capture: list[Path], tmp_path: Path) -> None:
    result = calibrate(capture, "--steps", STEPS, "--out", tmp_path / "r.json", "--json", "-")
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)["figures"]
    assert figures["exponent"] == pytest.approx(1 / GAMMA, abs=tolerance("response.steps_exponent_error"))
    improved = figures["two_step_rms_after_rad"] / figures["two_step_rms_before_rad"]
    hold("response.two_step_after_over_before", improved)
    found = ResponseCalibration.load(tmp_path / "r.json")
    assert found.steps == STEPS
    assert found.inputs == tuple(path.name for path in capture)
    assert len({found.red, found.green, found.blue, found.ir}) == 1


def test_one_channel_leaves_the_others(capture: list[Path], tmp_path: Path) -> None:
    calibrate(capture, "--steps", STEPS, "--out", tmp_path / "a.json")
    options = ["--channel", "ir", "--base", tmp_path / "a.json", "--out", tmp_path / "b.json"]
    assert calibrate(capture[::2], "--steps", STEPS // 2, *options).exit_code == 0
    first, second = (ResponseCalibration.load(tmp_path / name) for name in ("a.json", "b.json"))
    assert second.red == first.red
    assert second.ir != first.ir


def test_captures_at_fault_are_explained(capture: list[Path], tmp_path: Path) -> None:
    out = ["--out", tmp_path / "r.json"]
    odd = calibrate(capture[:-1], "--steps", STEPS, *out)
    assert (odd.exit_code, "expected a multiple of 12 files (steps of a stack), got 11" in odd.stderr) == (2, True)
    shuffled = calibrate(capture[1::2] + capture[::2], "--steps", STEPS, *out)
    assert shuffled.exit_code == 2
    write_image(tmp_path / "small.png", np.zeros((9, 9), np.uint8))
    mixed = calibrate([*capture[:-1], tmp_path / "small.png"], "--steps", STEPS, *out)
    assert (mixed.exit_code, "must have one size and type" in mixed.stderr) == (2, True)
    write_image(tmp_path / "black.png", np.zeros((240, 320), np.uint8))
    black = calibrate([tmp_path / "black.png"] * STEPS, "--steps", STEPS, *out)
    assert black.exit_code == 2
    assert not (tmp_path / "r.json").exists()
