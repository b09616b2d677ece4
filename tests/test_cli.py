"""The command line as scripts use it: options, keys, exit statuses, complete files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from quadfringe.cli import app
from quadfringe.data import Shape
from quadfringe.io.images import read_image, write_image

FRINGES = ["--fringes", "36", "35", "30", "--projector-width", "912"]
KEYS = {"phase_rad", "column_px", "order", "modulation", "quality", "uncertainty_rad", "wrong_order_probability"}


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


def files_of(folder: Path) -> list[object]:
    return [part for name in ("red", "green", "blue", "ir") for part in (f"--{name}", folder / f"{name}.png")]


def refused(result: Result, status: int, *reasons: str) -> None:
    assert result.exit_code == status, result.output
    for reason in reasons:
        assert reason in result.stderr
    assert "Traceback" not in result.output


def test_help_needs_no_heavy_import() -> None:
    code = (
        "import sys, quadfringe, quadfringe.cli\n"
        "heavy = {'numpy', 'cv2', 'pydantic', 'matplotlib', 'trimesh', 'quadfringe._core'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_script_and_the_module_are_the_same_command() -> None:
    script = Path(sys.executable).with_name("quadfringe")
    plain = {**os.environ, "NO_COLOR": "1", "COLUMNS": "100"}
    for command in ([str(script)], [sys.executable, "-m", "quadfringe"]):
        done = subprocess.run([*command, "--help"], capture_output=True, text=True, check=True, env=plain)
        commands = ("demo", "pattern", "simulate", "decode", "measure", "info", "calibrate", "projector", "reproduce")
        for name in (*commands, "bench", "live", "record", "recover", "batch"):
            assert name in done.stdout


def test_version() -> None:
    result = run("--version")
    assert result.exit_code == 0
    assert result.stdout.startswith("quadfringe 0.")


@pytest.mark.parametrize(
    "arguments",
    [
        ["no-such-command"],
        ["decode", "--no-such-option"],
        ["decode", "--fringes", "36", "35", "--projector-width", "912", "--out", "x.npz"],
        ["decode", "--fringes", "36", "35", "many", "--projector-width", "912", "--out", "x.npz"],
        ["reproduce", "everything"],
        ["bench", "--no-such-option"],
        ["bench", "--size", "1024"],
        ["bench", "--size", "8x8"],
        ["bench", "--threads", "0"],
        ["bench", "--repeats", "1"],
        ["bench", "--method", "fastest"],
        ["calibrate", "response", "--steps", "2", "a.png", "--out", "r.json"],
    ],
)
def test_wrong_usage_exits_with_2(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


def test_decode_keeps_the_contract(small_bench: Path, tmp_path: Path) -> None:
    result = run("decode", *files_of(small_bench), *FRINGES, "--out", tmp_path / "x.npz")
    assert result.exit_code == 0, result.output
    with np.load(tmp_path / "x.npz") as stored:
        assert set(stored.files) >= KEYS
        assert "xyz_mm" not in stored.files
        for key in KEYS:
            assert stored[key].dtype == np.float32
            assert stored[key].shape == read_image(small_bench / "red.png").shape
        phase, column = stored["phase_rad"], stored["column_px"]
        seen = np.isfinite(phase)
        np.testing.assert_allclose(column[seen], phase[seen] * 912 / (2 * np.pi * 36), atol=1e-3)
        np.testing.assert_array_equal(stored["order"][seen], np.floor(phase[seen] / (2 * np.pi)))


def test_a_calibrated_decode_has_millimetres(small_bench: Path, tmp_path: Path) -> None:
    calibration = ["--calibration", small_bench / "calibration.json"]
    for name in ("x.npz", "x.ply", "x.tif"):
        result = run("decode", *files_of(small_bench), *FRINGES, *calibration, "--out", tmp_path / name)
        assert result.exit_code == 0, result.output
        assert (tmp_path / name).stat().st_size > 1000
    with np.load(tmp_path / "x.npz") as stored:
        assert stored["xyz_mm"].shape == (*stored["phase_rad"].shape, 3)
        assert json.loads(str(stored["config"]))["fringes"]["numbers"] == [36.0, 35.0, 30.0]
        assert "projector" in json.loads(str(stored["calibration"]))


def test_a_folder_is_as_good_as_four_files(small_bench: Path, tmp_path: Path) -> None:
    options = [*FRINGES, "--method", "published", "--linear", "--out"]
    for source, out in (([small_bench], "folder.npz"), (files_of(small_bench), "files.npz")):
        result = run("decode", *source, *options, tmp_path / out)
        assert result.exit_code == 0, result.output
    with np.load(tmp_path / "folder.npz") as first, np.load(tmp_path / "files.npz") as second:
        np.testing.assert_array_equal(first["phase_rad"], second["phase_rad"])


def test_a_folder_is_given_alone(small_bench: Path, tmp_path: Path) -> None:
    out = ["--out", tmp_path / "x.npz"]
    result = run("decode", small_bench, "--ir", small_bench / "ir.png", *FRINGES, *out)
    refused(result, 2, "leave out --ir, or the folder")
    refused(
        run("decode", tmp_path, *FRINGES, *out), 2, "no image of a shot in it; expected red.png, green.png, blue.png"
    )
    write_image(tmp_path / "red.png", read_image(small_bench / "red.png"))
    refused(run("decode", tmp_path, *FRINGES, *out), 2, "no image for green, blue: add green.png, blue.png")


def test_a_colour_file_is_as_good_as_three(small_bench: Path, tmp_path: Path) -> None:
    rgb = np.stack([read_image(small_bench / f"{name}.png") for name in ("red", "green", "blue")], axis=2)
    write_image(tmp_path / "rgb.png", rgb)
    colour = ["--rgb", tmp_path / "rgb.png", "--ir", small_bench / "ir.png"]
    assert run("decode", *colour, *FRINGES, "--out", tmp_path / "a.npz").exit_code == 0
    assert run("decode", *files_of(small_bench), *FRINGES, "--out", tmp_path / "b.npz").exit_code == 0
    with np.load(tmp_path / "a.npz") as a, np.load(tmp_path / "b.npz") as b:
        np.testing.assert_array_equal(a["phase_rad"], b["phase_rad"])


@pytest.mark.parametrize("method", ["published", "joint"])
def test_json_on_stdout_is_nothing_but_json(small_bench: Path, tmp_path: Path, method: str) -> None:
    chosen = ["--method", method, "--json", "-", "--out", tmp_path / "x.npz"]
    result = run("decode", *files_of(small_bench), *FRINGES, *chosen)
    assert result.exit_code == 0, result.output
    assert 20 < json.loads(result.stdout)["figures"]["returned_percent"] <= 100


def spoiled(folder: Path, bench: Path, **images: np.ndarray) -> list[object]:
    """Give the options of a shot in which some channels are replaced."""
    for name in ("red", "green", "blue", "ir"):
        write_image(folder / f"{name}.png", images.get(name, read_image(bench / f"{name}.png")))
    return files_of(folder)


def shape_of(bench: Path) -> tuple[int, ...]:
    return read_image(bench / "red.png").shape


@pytest.mark.parametrize("channel", ["red", "green", "blue", "ir"])
@pytest.mark.parametrize(("level", "reason"), [(0, "is black"), (255, "is saturated")])
def test_a_blind_channel_is_named(small_bench: Path, tmp_path: Path, channel: str, level: int, reason: str) -> None:
    shot = spoiled(tmp_path, small_bench, **{channel: np.full(shape_of(small_bench), level, np.uint8)})
    result = run("decode", *shot, *FRINGES, "--out", tmp_path / "x.npz")
    refused(result, 1, f"channel {channel} {reason}")
    assert not (tmp_path / "x.npz").exists()


@pytest.mark.parametrize("pair", list(combinations(("red", "green", "blue", "ir"), 2)))
def test_swapped_channels_are_suspected(small_bench: Path, tmp_path: Path, pair: tuple[str, str]) -> None:
    first, second = (read_image(small_bench / f"{name}.png") for name in pair)
    shot = spoiled(tmp_path, small_bench, **{pair[0]: second, pair[1]: first})
    result = run("decode", *shot, *FRINGES, "--out", tmp_path / "x.npz")
    refused(result, 1, "swapped")
    assert not (tmp_path / "x.npz").exists()


def test_images_of_two_sizes_are_refused(small_bench: Path, tmp_path: Path) -> None:
    shot = spoiled(tmp_path, small_bench, blue=np.zeros((9, 9), np.uint8))
    refused(run("decode", *shot, *FRINGES, "--out", tmp_path / "x.npz"), 2, "expected one size", "blue 9 x 9")


def test_not_a_number_is_refused(small_bench: Path, tmp_path: Path) -> None:
    shot = files_of(small_bench)
    for i in (1, 3, 5, 7):
        image = read_image(Path(str(shot[i]))).astype(np.float32) / 255
        image[5, 7] = np.nan
        shot[i] = tmp_path / f"{i}.tif"
        write_image(Path(str(shot[i])), image)
    refused(run("decode", *shot, *FRINGES, "--out", tmp_path / "x.npz"), 2, "not finite", "row 5, column 7")


def test_files_at_fault_are_named(small_bench: Path, tmp_path: Path) -> None:
    shot, out = files_of(small_bench), ["--out", tmp_path / "x.npz"]
    refused(run("decode", *shot[:6], *FRINGES, *out), 2, "the shot has red, green, blue", "--encoding")
    refused(run("decode", *shot[:7], tmp_path / "no.png", *FRINGES, *out), 2, "no.png")
    (tmp_path / "bad.png").write_bytes(b"bad")
    refused(run("decode", *shot[:7], tmp_path / "bad.png", *FRINGES, *out), 2, "bad.png", "not a readable image")
    refused(run("decode", *shot, *FRINGES, "--out", tmp_path / "no" / "x.npz"), 2, "does not exist")
    refused(run("decode", *shot, *FRINGES, "--out", tmp_path / "x.stl"), 2, ".npz")
    refused(run("decode", *shot, *FRINGES, "--out", tmp_path / "x.ply"), 2, "--calibration")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.png"]


@pytest.mark.parametrize("numbers", [(16, 8, 4), (30, 30, 30), (-36, 35, 30), (500, 35, 30)])
def test_fringes_that_cannot_number_the_field(small_bench: Path, tmp_path: Path, numbers: tuple[int, int, int]) -> None:
    fringes = ["--fringes", *numbers, "--projector-width", "912"]
    refused(run("decode", *files_of(small_bench), *fringes, "--out", tmp_path / "x.npz"), 2, "fringe")


def test_calibrations_at_fault_are_explained(small_bench: Path, tmp_path: Path) -> None:
    shot, out = files_of(small_bench), ["--out", tmp_path / "x.npz"]
    known = json.loads((small_bench / "calibration.json").read_text())
    bad = tmp_path / "c.json"
    bad.write_text(json.dumps(known | {"lens": "new", "dark": [0.1]}))
    result = run("decode", *shot, *FRINGES, *out, "--calibration", bad)
    refused(result, 2, "c.json", "lens: this key is not known", "dark")
    known.pop("digest")  # tests/test_damaged_files.py: it shows that a number was changed
    bad.write_text(json.dumps(known | {"camera": known["camera"] | {"width_px": 640}}))
    refused(run("decode", *shot, *FRINGES, *out, "--calibration", bad), 2, "640 x")
    bad.write_text(json.dumps(known | {"projector": known["projector"] | {"width_px": 1920}}))
    refused(run("decode", *shot, *FRINGES, *out, "--calibration", bad), 2, "1920 columns")
    (tmp_path / "r.json").write_text('{"rad": {}}')
    refused(run("decode", *shot, *FRINGES, *out, "--response", tmp_path / "r.json"), 2, "rad: this key is not known")


def test_patterns_are_what_a_projector_shows(tmp_path: Path) -> None:
    result = run("pattern", "--out", tmp_path, "--layout", "diamond")
    assert result.exit_code == 0, result.output
    visible, infrared = read_image(tmp_path / "visible.png"), read_image(tmp_path / "infrared.png")
    assert (visible.shape, infrared.shape) == ((1140, 912, 3), (1140, 912))
    assert visible[0, 0].tolist() == [255, 255, 128]
    refused(run("pattern", "--out", tmp_path, "--fringes", 16, 8, 4), 2, "joint range")


def test_measure_saves_each_kind(small_bench: Path, tmp_path: Path) -> None:
    names = ["a.ply", "a.tif", "a.npz"]
    out = [part for name in names for part in ("--out", tmp_path / name)]
    result = run("measure", small_bench / "system.toml", *out)
    assert result.exit_code == 0, result.output
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(names)


def test_measure_refuses_a_bad_system(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text("[scene]\nsurface = 'unicorn'\nnose = 1\n")
    result = run("measure", tmp_path / "s.toml", "--out", tmp_path / "a.ply")
    refused(result, 2, "scene.nose: this key is not known")
    (tmp_path / "s.toml").write_text("[scene]\nsurface = 'unicorn'\n")
    refused(run("measure", tmp_path / "s.toml", "--out", tmp_path / "a.ply"), 2, "unicorn")
    refused(run("measure", tmp_path / "s.toml", "--out", tmp_path / "a.doc"), 2, "a.doc")


def test_info_tells_what_a_file_holds(small_bench: Path, tmp_path: Path) -> None:
    run("measure", small_bench / "system.toml", "--out", tmp_path / "a.npz", "--out", tmp_path / "a.ply")
    expected = {
        tmp_path / "a.npz": "phase_rad: float32",
        tmp_path / "a.ply": "property float quality",
        small_bench / "red.png": "image: uint8",
        small_bench / "calibration.json": "Calibration",
        small_bench / "system.toml": '"surface"',
        small_bench / "truth.npz": "xyz_mm",
    }
    for path, text in expected.items():
        result = run("info", path)
        assert result.exit_code == 0, result.output
        assert text in result.stdout
    missing = [one for one in Shape.load(tmp_path / "a.npz").reasons() if one]
    assert missing
    for one in missing:
        assert f"reason {one.name}, {one.words}: " in run("info", tmp_path / "a.npz").stdout
    refused(run("info", tmp_path / "no.npz"), 2, "no.npz")
    (tmp_path / "figures.json").write_text('{"figures": {"face_depth_rms_mm": 0.05}}')
    assert run("info", tmp_path / "figures.json").stdout.split("\n")[:2] == [
        "Figures of a command",
        "face_depth_rms_mm: 0.05",
    ]
    (tmp_path / "other.json").write_text('{"findings": []}')
    refused(run("info", tmp_path / "other.json"), 2, "expected a calibration,", "got JSON with the keys findings")
    (tmp_path / "a.txt").touch()
    refused(run("info", tmp_path / "a.txt"), 2, "a.txt")


def test_too_little_memory_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise MemoryError("Unable to allocate 9 GiB")

    monkeypatch.setattr("quadfringe.recording.inspection.lines_about", refuse)
    result = run("info", tmp_path)
    assert (result.exit_code, result.output) == (1, "error: out of memory: Unable to allocate 9 GiB\n")
