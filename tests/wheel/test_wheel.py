"""The wheel without extras: every module, the demonstration, files, and what is said of missing extras."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
from environments import TOOLS, Environment
from support.bars import hold

from quadfringe.evaluation.demo import SCENES

CHECK = Path(__file__).resolve().parents[2] / "scripts" / "check_wheel.py"

# Programs, which do something when they are imported. `make test-camera` runs the one that needs Aravis.
PROGRAMS = ("quadfringe.__main__", "quadfringe.devices.emulator.__main__", "quadfringe.evaluation._aravis_fake")

IMPORT_ALL = f"""
import importlib, pkgutil, quadfringe
names = [found.name for found in pkgutil.walk_packages(quadfringe.__path__, "quadfringe.")]
for name in names:
    if name not in {PROGRAMS}:
        importlib.import_module(name)
print(quadfringe.__file__)
print(len(names))
"""

SYSTEM = """
[camera]
width_px = 512
height_px = 384
focal_px = [1290.0, 1290.0]
centre_px = [255.5, 191.5]

[scene]
surface = "peaks"
"""

READ = """
import quadfringe as qf
shape = qf.Shape.load("peaks.npz")
print(shape.returned.mean() > 0.95, shape.depth_mm.shape, (shape.mesh().save("mesh.glb")))
"""


def test_no_compiler_is_found(bare: Environment) -> None:
    assert [tool for tool in TOOLS if shutil.which(tool, path=bare.variables["PATH"])] == []


def test_every_module_is_imported(bare: Environment) -> None:
    place, count = bare.run(IMPORT_ALL).splitlines()
    assert place.startswith(str(bare.folder))
    assert int(count) > 150


@pytest.mark.parametrize("encoding", [[], ["--encoding", "rgb"]], ids=["four", "rgb"])
def test_the_demonstration_leaves_pictures(bare: Environment, encoding: list[str]) -> None:
    name = "_".join(["demo", *encoding])
    said = bare.quadfringe("demo", *encoding, "--out", name)
    assert said.count('pip install "quadfringe[export,plot,view]"') == 1
    figures = json.loads((bare.folder / name / "figures.json").read_text())["figures"]
    for scene in SCENES:
        hold("demo.returned_percent", figures[f"{scene}_returned_percent"])
        hold("demo.wrong_order_percent", figures[f"{scene}_wrong_order_percent"])
        picture = cv2.imread(str(bare.folder / name / f"{scene}.png"))
        assert picture is not None
        assert picture.shape[1] > 1000
        assert picture.std() > 50
        assert (bare.folder / name / f"{scene}.glb").read_bytes()[:4] == b"glTF"


def test_files_are_decoded(bare: Environment) -> None:
    (bare.folder / "system.toml").write_text(SYSTEM)
    bare.quadfringe("simulate", "system.toml", "--out", "shot")
    calibration = ["--calibration", "shot/calibration.json"]
    numbers = ["--fringes", "36", "35", "30", "--projector-width", "912"]
    bare.quadfringe("decode", "shot", *numbers, *calibration, "--out", "peaks.npz")
    assert bare.run(READ).split() == ["True", "(384,", "512)", "None"]
    assert "phase_rad: float32 (384, 512)" in bare.quadfringe("info", "peaks.npz")
    # Commands that need an extra say which one.
    for out, extra in (("peaks.ply", "export"), ("peaks.tif", "export"), ("peaks.e57", "e57")):
        assert f"quadfringe[{extra}]" in bare.quadfringe("convert", "peaks.npz", out, fails=True)
    assert "quadfringe[plot]" in bare.quadfringe("report", "peaks.npz", fails=True)
    assert "quadfringe[view]" in bare.quadfringe("view", "peaks.npz", fails=True)


def test_the_installation_is_examined(bare: Environment) -> None:
    assert "compiled with optimisation" in bare.quadfringe("doctor")


# In CI this runs or fails.
@pytest.mark.skipif(sys.platform != "linux" and "CI" not in os.environ, reason="auditwheel examines wheels for Linux")
@pytest.mark.parametrize("policy", ["manylinux_2_12", "musllinux_1_2"])
def test_a_wheel_for_newer_or_other_systems_is_refused(wheel: Path, policy: str) -> None:
    done = subprocess.run([sys.executable, str(CHECK), str(wheel), policy], capture_output=True, text=True)
    assert done.returncode == 1
    assert f"expected {policy} or older" in done.stderr
