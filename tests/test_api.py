"""The public API as a new user meets it: names, paths, files, and decoding."""

from __future__ import annotations

import dataclasses
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadfringe as qf
from quadfringe import data, errors
from quadfringe.files import atomic

ROOT = Path(__file__).parents[1]
DOCUMENTS = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *(
        page
        for name in ("method", "howto", "start", "tutorials")
        for page in sorted((ROOT / "docs" / name).glob("*.md"))
    ),
]


@pytest.fixture(scope="module")
def shot_folder(small_bench: Path) -> Path:
    return small_bench


# Names


def test_every_public_name_is_there_and_a_star_import_hides_no_builtin() -> None:
    star: dict[str, Any] = {}
    exec("from quadfringe import *", star)
    assert sorted(set(star) - {"__builtins__"}) == sorted(qf.__all__)
    assert not set(qf.__all__) & set(dir(__builtins__))
    assert qf.open is qf.open_system
    assert set(qf.__all__) < set(dir(qf))


def test_every_error_is_exported() -> None:
    assert {name for name in errors.__all__ if name != "require"} < set(qf.__all__)
    assert qf.CameraLostError is errors.CameraLostError


def test_modules_are_there_without_an_import() -> None:
    import subprocess
    import sys

    words = "import quadfringe as qf; qf.stages.two_step; qf.devices.open_camera; qf.recording.Recording"
    subprocess.run([sys.executable, "-c", words], check=True)
    with pytest.raises(AttributeError, match="no attribute 'render'"):
        _ = qf.render


def test_every_name_of_a_package_is_there_without_an_import() -> None:
    import subprocess
    import sys

    words = """
import pkgutil, sys
import quadfringe
packages = [m.name for m in pkgutil.walk_packages(quadfringe.__path__, "quadfringe.") if m.ispkg]
assert {"quadfringe.view", "quadfringe.evaluation"} < set(packages)
missing = []
for name in sys.argv[1:] or packages:
    package = __import__(name, fromlist=["_"])
    for public in getattr(package, "__all__", ()):
        try:
            getattr(package, public)
        except ImportError:
            pass  # an optional library that is not installed
        except AttributeError:
            missing.append(f"{name}.{public}")
assert not missing, missing
"""
    for package in ("quadfringe.view", "quadfringe.evaluation"):  # alone, before another module imports their parts
        subprocess.run([sys.executable, "-c", words, package], check=True)
    subprocess.run([sys.executable, "-c", words], check=True)
    for package in (qf.view, qf.evaluation):
        with pytest.raises(AttributeError, match="no attribute 'render'"):
            _ = package.render


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_names_of_documents_exist(document: Path) -> None:
    text = document.read_text()
    for name in set(re.findall(r"\bqf\.(\w+)", text)):
        assert name in qf.__all__ or name == "open" or name in dir(qf), f"{document.name}: qf.{name}"
    for path in set(re.findall(r"\bquadfringe((?:\.[a-z_]\w*)+\.?[A-Z]?\w*)", text)):
        found: Any = qf
        for part in path.strip(".").split("."):
            found = getattr(found, part, None) or import_module(f"{found.__name__}.{part}")


@pytest.mark.parametrize("package", ["config", "data", "decoding", "devices", "recording", "scanner"])
def test_packages_say_what_is_public(package: str) -> None:
    module = import_module(f"quadfringe.{package}")
    assert module.__doc__
    for name in module.__all__:
        assert hasattr(module, name)


# Files


def test_read_shot_takes_a_folder_and_names(shot_folder: Path) -> None:
    names = ("red", "green", "blue", "ir")
    by_name = qf.read_shot({name: str(shot_folder / f"{name}.png") for name in names})
    for source in (shot_folder, str(shot_folder)):
        shot = qf.read_shot(source)
        assert all((shot.images[name] == by_name.images[name]).all() for name in names)


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("no_such_folder", "no such folder"),
        ({"red": "a.png", "infrared": "b.png"}, "expected images named .* got infrared"),
        (5, "expected a folder or a mapping .* got int"),
        ({"raw": "a.png", "ir": "b.png"}, "bayer = rggb"),
    ],
)
def test_read_shot_says_what_is_wrong(source: Any, reason: str) -> None:
    with pytest.raises(qf.InputError, match=reason):
        qf.read_shot(source)


def test_read_shot_names_an_empty_folder(tmp_path: Path) -> None:
    with pytest.raises(
        qf.InputError, match=rf"{tmp_path}: no image of a shot in it; expected red.png, .* and ir.png, or rgb.png"
    ):
        qf.read_shot(tmp_path)
    data.write_shot(tmp_path, qf.Shot(*np.zeros((4, 6, 8), np.uint8)))
    (tmp_path / "ir.png").unlink()
    assert qf.read_shot(tmp_path).ir is None
    (tmp_path / "blue.png").unlink()
    with pytest.raises(qf.InputError, match=rf"{tmp_path}: no image for blue: add blue.png, or one colour image"):
        qf.read_shot(tmp_path)
    (tmp_path / "file.png").write_bytes(b"")
    with pytest.raises(qf.InputError, match="a file, not a folder"):
        qf.read_shot(tmp_path / "file.png")


def test_a_plan_takes_what_a_person_types(shot_folder: Path, tmp_path: Path) -> None:
    calibration = qf.Calibration.load(shot_folder / "calibration.json")
    for source in (
        calibration,
        shot_folder / "calibration.json",
        str(shot_folder / "calibration.json"),
        str(shot_folder),
    ):
        assert qf.Plan(912, calibration=source).calibration == calibration
    assert qf.Plan(912, (36, 35, 30)) == qf.Plan(np.int64(912))
    assert qf.Plan(912, decode={"method": "published"}).decode.method == "published"
    response = qf.ResponseCalibration(red={"exponent": 0.5})
    response.save(tmp_path / "response.json")
    for path in (tmp_path / "response.json", str(tmp_path / "response.json")):
        assert qf.Plan(912, response=path).response == response
        assert qf.Plan(912, decode=qf.DecodeConfig(response=path)).response == response


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"projector_width_px": "912"}, "projector_width_px: expected a number of columns, such as 912, got '912'"),
        ({"calibration": 5}, "calibration: expected a Calibration or the path of its file, got int"),
        ({"calibration": "no.json"}, "no.json: No such file"),
        ({"response": None}, 'response: expected "auto", "linear", .* got None'),
        ({"response": "liner"}, 'response: expected "auto", "linear"'),
        ({"response": "no.json"}, "no.json: No such file"),
        ({"response": "linear", "decode": {"response": {"red": {"exponent": 2.0}}}}, "give it once"),
        ({"decode": {"methd": "x"}}, "methd: this key is not known"),
        ({"response": "liner"}, "^response: 1 problem"),
        ({"fringes": (36, 35)}, r"joint range covers the projector, such as \(16, 15\), got \(36, 35\)"),
        ({"fringes": 36}, "expected three fringe numbers, .* got 36"),
        ({"projector_width_px": -1}, "projector_width_px: .* from 2 to 65536, got -1"),
        ({"projector_width_px": 10**9}, "projector_width_px: .* got 1000000000"),
        ({"decode": {"quality_min": 7}}, r"quality_min: expected a fraction in \[0, 1\), got 7"),
    ],
)
def test_a_plan_names_the_argument_at_fault(arguments: dict[str, Any], reason: str) -> None:
    with pytest.raises(qf.InputError, match=reason):
        qf.Plan(**({"projector_width_px": 912} | arguments))


def test_a_plan_can_be_changed_and_compared(shot_folder: Path) -> None:
    plan = qf.Plan(912, calibration=shot_folder, response="linear")
    assert dataclasses.replace(plan, response="auto") == qf.Plan(912, calibration=shot_folder)
    assert qf.Plan(912, decode=qf.DecodeConfig(response="linear")) == qf.Plan(912, response="linear")


def test_a_folder_is_named_where_a_file_is_meant(tmp_path: Path) -> None:
    for read in (qf.Shape.load, qf.recording.Recording, qf.ResponseCalibration.load, qf.Calibration.load):
        with pytest.raises(qf.InputError, match="folder"):
            read(tmp_path)
        with pytest.raises(qf.InputError, match=r"[Nn]o such file"):
            read(str(tmp_path / "missing.json"))
    with pytest.raises(qf.InputError, match=r"a folder without system\.toml"):
        qf.open(tmp_path)


def test_open_takes_a_folder(shot_folder: Path) -> None:
    with qf.open(shot_folder) as by_folder, qf.open(str(shot_folder / "system.toml")) as by_file:
        assert by_folder.config == by_file.config


def test_a_scanner_takes_the_path_of_a_calibration(shot_folder: Path) -> None:
    with qf.open(shot_folder) as bench:
        made = qf.Scanner(bench.config, bench.projector, bench.camera, shot_folder / "calibration.json")
        assert made.measure().xyz_mm is not None


def test_files_are_written_by_text_paths(tmp_path: Path) -> None:
    with atomic(str(tmp_path / "a.txt")) as temporary:
        temporary.write_text("whole")
    assert (tmp_path / "a.txt").read_text() == "whole"


# Decoding


def test_a_decoder_is_planned_by_size_or_by_shot(shot_folder: Path) -> None:
    shot, plan = qf.read_shot(shot_folder), qf.Plan(912, calibration=shot_folder)
    shapes = [qf.Decoder(like, plan).decode(shot) for like in (shot, (384, 512), shot.red.shape)] + [
        qf.decode(shot, plan)
    ]
    for shape in shapes[1:]:
        np.testing.assert_array_equal(shape.phase_rad, shapes[0].phase_rad)
    with pytest.raises(qf.InputError, match=r"expected a shot or a size \(rows, columns\), got 'shot'"):
        qf.Decoder("shot", plan)  # type: ignore[arg-type]


def test_a_decoder_refuses_shots_of_another_kind(shot_folder: Path) -> None:
    shot = qf.read_shot(shot_folder)
    decoder = qf.Decoder(shot, qf.Plan(912))
    with pytest.raises(qf.InputError, match="for 512 x 384 pixels up to 255, the shot has 511 x 384 up to 255"):
        decoder.decode(qf.Shot(*(image[:, 1:] for image in shot.images.values())))
    twelve = qf.Shot(*(image.astype(np.uint16) * 16 for image in shot.images.values()), full_scale=4095)
    with pytest.raises(qf.InputError, match="up to 255, the shot has 512 x 384 up to 4095"):
        decoder.decode(twelve)
    with pytest.raises(qf.InputError, match="up to 65535, the shot has 512 x 384 up to 4095"):
        qf.Decoder((384, 512), qf.Plan(912)).decode(twelve)
    qf.Decoder((384, 512), qf.Plan(912), full_scale=4095).decode(twelve)


def test_a_result_says_what_made_it(shot_folder: Path, tmp_path: Path) -> None:
    with qf.open(shot_folder) as bench:
        bench.measure().save(tmp_path / "scanner.npz")
    qf.decode(qf.read_shot(shot_folder), qf.Plan(912, calibration=shot_folder)).save(tmp_path / "plan.npz")
    for name in ("scanner", "plan"):
        shape = qf.Shape.load(tmp_path / f"{name}.npz")
        assert shape.calibration == qf.Calibration.load(shot_folder)
        assert shape.config["quadfringe_version"] == qf.__version__
        assert shape.config["decode"]["method"] == "joint"
        assert shape.config["decode"]["method_version"]
        assert shape.config["response_from"] == "calibration"
        assert shape.config["projector_width_px"] == 912
        assert shape.config["fringes"]["numbers"] == [36, 35, 30]
