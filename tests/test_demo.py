"""The demonstration and the reproduction keep their contract and their bars."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import pytest
import trimesh
from support.bars import hold
from typer.testing import CliRunner

from quadfringe.cli import app
from quadfringe.evaluation.demo import SCENES, next_steps

Figures = dict[str, float]


def figures_of(*arguments: str) -> Figures:
    result = CliRunner().invoke(app, [*arguments, "--json", "-"])
    assert result.exit_code == 0, result.output
    stored = json.loads(result.stdout)
    assert list(stored) == ["figures"]
    figures: Figures = stored["figures"]
    return figures


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("demo")


@pytest.fixture(scope="module")
def demo(folder: Path) -> Figures:
    return figures_of("demo", "--out", str(folder))


@pytest.fixture(scope="module")
def peaks(folder: Path) -> Figures:
    return figures_of("reproduce", "peaks", "--out", str(folder))


def test_demo_names_its_figures(demo: Figures, folder: Path) -> None:
    kinds = ("depth_rms_mm", "wrong_order_percent", "returned_percent")
    assert set(demo) == {f"{scene}_{kind}" for scene in SCENES for kind in kinds} | {"decode_ms"}
    assert json.loads((folder / "figures.json").read_text())["figures"] == demo


def test_demo_ends_with_what_to_do_next(tmp_path: Path) -> None:
    lines = next_steps(tmp_path)
    assert len(lines) <= 3
    assert str(tmp_path / "face.png") in lines[0]
    assert lines[-1].endswith(" live")


def test_demo_needs_no_infrared(tmp_path: Path) -> None:
    found = figures_of("demo", "--encoding", "rgb", "--out", str(tmp_path))
    for scene in SCENES:
        hold("demo.returned_percent", found[f"{scene}_returned_percent"])
        hold("demo.wrong_order_percent", found[f"{scene}_wrong_order_percent"])
        assert (tmp_path / f"{scene}.png").exists()


@pytest.mark.parametrize("scene", SCENES)
def test_demo_is_metric(demo: Figures, folder: Path, scene: str) -> None:
    for figure in ("depth_rms_mm", "wrong_order_percent", "returned_percent"):
        hold(f"demo.{figure}", demo[f"{scene}_{figure}"])
    cloud = trimesh.load(folder / f"{scene}.ply")
    assert len(cloud.vertices) > 500_000
    report = cv2.imread(str(folder / f"{scene}.png"))
    assert report is not None
    assert report.shape[1] > 1000


def test_peaks_stand_as_published(peaks: Figures, folder: Path) -> None:
    names = {f"{method}_rms_rad" for method in ("traditional_ftp", "improved_ftp", "proposed")}
    assert set(peaks) == names | {f"{name}_row760" for name in names}
    for row in ("", "_row760"):
        for method in ("traditional_ftp", "improved_ftp", "proposed"):
            hold(f"peaks.{method}_rms_rad", peaks[f"{method}_rms_rad{row}"])
    assert cv2.imread(str(folder / "peaks.png")) is not None
