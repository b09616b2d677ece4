"""Paths that are not valid UTF-8, which Linux allows and OpenCV does not survive."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from quadfringe.calibration.opencv_files import read_opencv, write_opencv
from quadfringe.cli import app
from quadfringe.data import Calibration
from quadfringe.errors import InputError
from quadfringe.io.images import read_image, write_image
from quadfringe.view.movie import movie

# In CI this runs or fails.
pytestmark = pytest.mark.skipif(
    sys.platform != "linux" and "CI" not in os.environ, reason="other systems have no such paths"
)
BYTES = b"\xff\xfe"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / os.fsdecode(BYTES)
    path.mkdir()
    return path


@pytest.mark.parametrize("suffix", [".png", ".tif", ".bmp"])
def test_images_have_any_path(suffix: str, folder: Path) -> None:
    path = folder / f"{os.fsdecode(BYTES)}{suffix}"
    image = np.arange(24, dtype=np.uint8).reshape(4, 6)
    write_image(path, image)
    assert (read_image(path) == image).all()
    with pytest.raises(InputError, match="cannot be written as an image"):
        write_image(path.with_suffix(f".{os.fsdecode(BYTES)}"), image)
    assert list(folder.iterdir()) == [path]


@pytest.mark.parametrize("suffix", [".yml", ".xml", ".json"])
def test_opencv_files_have_any_path(suffix: str, folder: Path, small_bench: Path) -> None:
    known = Calibration.load(small_bench / "calibration.json")
    path = folder / f"c{suffix}"
    write_opencv(path, known)
    found = read_opencv(path)
    assert (found.camera, found.projector) == (known.camera, known.projector)


def test_a_comment_in_another_encoding_does_no_harm(tmp_path: Path, small_bench: Path) -> None:
    known, path = Calibration.load(small_bench / "calibration.json"), tmp_path / "c.yml"
    write_opencv(path, known)
    path.write_bytes(path.read_bytes().replace(b"camera_size:", b"# Gr\xf6\xdfe\ncamera_size:"))
    assert read_opencv(path).camera == known.camera


def test_a_movie_refuses_such_a_path(folder: Path) -> None:
    with pytest.raises(InputError, match="a movie needs a path that is valid UTF-8"), movie(folder / "m.mp4", 10):
        pass
    assert not list(folder.iterdir())


def test_simulated_images_are_read_again(folder: Path) -> None:
    out = str(folder / "bench")
    result = CliRunner().invoke(app, ["simulate", "--out", out])
    assert (result.exit_code, "\\udcff" in result.output) == (0, True), result.output
    assert CliRunner().invoke(app, ["info", f"{out}/ir.png"]).exit_code == 0
