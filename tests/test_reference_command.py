"""The reference measurement on the command line and with the devices of a scanner."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.bars import hold
from support.steps import NUMBERS, WIDTH_PX, errors_px, levels, stacks
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.decoding import StepSettings, decode_steps, read_steps
from quadfringe.devices import ExternalLight
from quadfringe.errors import ConfigError, DecodeError, DecodeWarning, InputError
from quadfringe.scanner.reference import take_steps


def run(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the steps of three fringe numbers in the order of their names."""
    where = tmp_path_factory.mktemp("steps")
    for k, stack in enumerate(levels(stacks((4, 4, 4), noise=0.01), 255)):
        for s, image in enumerate(stack):
            cv2.imwrite(str(where / f"f{k}_s{s}.png"), image)
    return where


def test_the_command_reads_folders_and_files_in_both_orders(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "ref.npz"
    words = ["--steps", 4, "--numbers", 36, 35, 30]
    more = ["--projector-width", WIDTH_PX, "--out", out]
    code, text = run("decode", *words, folder, *more, "--json", tmp_path / "f.json")
    assert code == 0, text
    assert json.loads((tmp_path / "f.json").read_text())["figures"]["returned_percent"] == 100.0
    by_folder = qf.Shape.load(out)
    files = sorted(folder.iterdir())
    for order, listed in (("frequency", files), ("step", [files[4 * k + s] for s in range(4) for k in range(3)])):
        code, text = run("decode", *words, *listed, *more, "--order", order)
        assert code == 0, text
        assert np.array_equal(qf.Shape.load(out).phase_rad, by_folder.phase_rad)
    hold("reference.noisy_px", np.abs(errors_px(by_folder)).max())


def test_the_command_explains_what_is_wrong(folder: Path, tmp_path: Path) -> None:
    files, out = sorted(folder.iterdir()), tmp_path / "ref.npz"
    more = ["--projector-width", WIDTH_PX, "--out", out]
    steps = ["decode", "--steps", 4, "--numbers", 36, 35, 30]
    cases = [
        ([*steps, *files[:11]], 2, "expected 12 images, 11 are given"),
        ([*steps, *files, files[0]], 2, "name only the images of the steps"),
        ([*steps, *files, "--method", "joint"], 2, "--method: only for a single shot"),
        ([*steps, *files, "--order", "step"], 1, "order of the images"),
        (["decode", "--steps", 4, *files], 2, "--numbers"),
        (["decode", "--steps", 2, "--numbers", 36, *files], 2, "at least 3"),
        (["decode", folder], 2, "--fringes"),
        (["decode", "--fringes", 36, 35, 30, *files], 2, "expected one folder"),
    ]
    for words, status, text in cases:
        code, output = run(*words, *more)
        assert (code, text in output) == (status, True), output
    assert not out.exists()


def test_read_steps_wants_images_alike(folder: Path, tmp_path: Path) -> None:
    assert [stack.shape for stack in read_steps(folder, 3, 4)] == [(4, 64, 256)] * 3
    files = sorted(folder.iterdir())
    cv2.imwrite(str(tmp_path / "other.png"), np.zeros((8, 8), np.uint16))
    with pytest.raises(InputError, match=r"other.png: 8 x 8 uint16, but .* is 256 x 64 uint8"):
        read_steps([*files[:11], tmp_path / "other.png"], 3, 4)


def test_a_scanner_measures_with_steps(small_bench: Path, tmp_path: Path) -> None:
    out = tmp_path / "ref.npz"
    code, text = run("measure", small_bench / "system.toml", "--reference", "--steps", 4, "--out", out)
    assert code == 0, text
    shape = qf.Shape.load(out)
    assert (shape.config["decode"]["method"], shape.config["steps"]) == ("reference", [4, 4, 4])
    assert shape.config["scene"]["surface"] == "steps"
    with qf.open(small_bench / "system.toml") as scanner:
        single = scanner.measure()
        shown = []
        show = scanner.projector.show
        scanner.projector.show = lambda light: (shown.append(light), show(light))
        infrared = scanner.measure(reference=True, steps=3, infrared=True)
        with pytest.raises(InputError, match="at least 3, got 2"):
            scanner.measure(reference=True, steps=2)
    assert [(light.number, light.beam) for light in shown] == [(n, "infrared") for n in NUMBERS for _ in range(3)]
    assert single.depth_mm is not None
    for found in (shape, infrared):
        assert found.depth_mm is not None
        apart_mm = (found.depth_mm - single.depth_mm)[found.returned & single.returned]
        hold("reference.apart_mm", np.median(np.abs(apart_mm)))
    code, text = run("measure", small_bench / "system.toml", "--steps", 4, "--out", out)
    assert (code, "--reference" in text) == (2, True)


def test_a_system_without_projector_says_so(small_bench: Path) -> None:
    with qf.open(small_bench / "system.toml") as scanner:
        scanner.projector = ExternalLight()
        with pytest.raises(ConfigError, match="no projector"):
            scanner.measure(reference=True)


def test_a_calibration_that_contradicts_and_depths_outside_a_range(small_bench: Path) -> None:
    with qf.open(small_bench / "system.toml") as scanner:
        taken = take_steps(scanner.projector, scanner.camera, scanner.plan, 4, "visible")
        known = scanner.calibration
    turned = [np.ascontiguousarray(stack[:, :, ::-1]) for stack in taken.stacks]
    with pytest.raises(DecodeError, match="run backwards"):
        decode_steps(turned, NUMBERS, WIDTH_PX, calibration=known)
    whole = decode_steps(taken.stacks, NUMBERS, WIDTH_PX, calibration=known)
    assert whole.depth_mm is not None
    middle_mm = float(np.nanmedian(whole.depth_mm))
    near = StepSettings(depth_range_mm=(middle_mm, 2 * middle_mm))
    part = decode_steps(taken.stacks, NUMBERS, WIDTH_PX, calibration=known, settings=near)
    assert part.depth_mm is not None
    assert np.nanmin(part.depth_mm) >= middle_mm
    assert part.warnings == ()
    far = StepSettings(depth_range_mm=(2 * middle_mm, 3 * middle_mm))
    with pytest.warns(DecodeWarning, match="outside the stated depths"):
        decode_steps(taken.stacks, NUMBERS, WIDTH_PX, calibration=known, settings=far)
