"""Scores of phase maps, textured shots, and the reports that are written from measured figures."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe import _core
from quadfringe.evaluation import _report as report
from quadfringe.evaluation import _textures as textures
from quadfringe.evaluation._scenes import ROOT
from quadfringe.evaluation.scoring import phase_errors

FOLDERS = ("benches", "docs", "evaluation")
# benches/camera.py needs Aravis; `make test-camera` runs it.
SCRIPTS = sorted(p for folder in FOLDERS for p in (ROOT / folder).glob("*.py") if p.name != "camera.py")


@pytest.fixture(scope="module")
def truth_rad() -> NDArray[np.float64]:
    """The phase of the peaks surface on the virtual bench."""
    bench = _core.Bench()
    column_px = bench.cast("peaks").column_px().astype(np.float64)
    return 2 * np.pi * 36 * column_px / bench.visible.width


def test_sign_and_offset_of_a_wrapped_phase_are_undone(truth_rad: NDArray[np.float64]) -> None:
    turned = np.angle(np.exp(-1j * (truth_rad - 0.7)))
    assert phase_errors(turned, truth_rad, "wrapped")["phase_rms_rad"] < 1e-6
    wavy = np.angle(np.exp(1j * (truth_rad + 0.1 * np.cos(truth_rad))))
    found = phase_errors(wavy, truth_rad, "wrapped")
    assert found["phase_rms_rad"] == pytest.approx(0.1 / np.sqrt(2), rel=0.05)
    assert "wrong_orders_percent" not in found


def test_whole_periods_are_undone_only_for_a_relative_phase(truth_rad: NDArray[np.float64]) -> None:
    off = truth_rad + 4 * np.pi
    assert phase_errors(off, truth_rad, "relative")["wrong_orders_percent"] == 0
    assert phase_errors(off, truth_rad, "absolute")["wrong_orders_percent"] == 100


def test_pixels_that_are_not_returned_are_left_out(truth_rad: NDArray[np.float64]) -> None:
    lit = np.isfinite(truth_rad)
    holes = truth_rad.copy()
    holes[:, ::2] = np.nan
    assert phase_errors(holes[lit], truth_rad[lit]) == {"phase_rms_rad": 0.0, "wrong_orders_percent": 0.0}


def test_steps_of_the_same_scene_carry_the_same_phase(truth_rad: NDArray[np.float64]) -> None:
    bench = _core.Bench()
    cast = bench.cast("peaks")
    images = [
        bench.render_step(cast, 36.0, 0.5 * np.pi * step, noise=0.03, seed=1 + step, bit_depth=8)["red"].astype(float)
        for step in range(4)
    ]
    phase_rad = np.arctan2(images[3] - images[1], images[0] - images[2])
    seen = (cast.edge_distance_px() > 28) & ~cast.shadow()
    # 3 % noise in four steps leaves sigma / (b sqrt 2), some 0.06 rad.
    assert phase_errors(phase_rad[seen], truth_rad[seen], "wrapped")["phase_rms_rad"] < 0.08


def test_a_texture_changes_the_light_and_not_the_truth() -> None:
    white, truth_rad = textures.white(1)
    for name, take in textures.TEXTURES.items():
        shot, same_rad = take(1)
        np.testing.assert_array_equal(same_rad, truth_rad)
        assert isinstance(shot, qf.Shot)
        assert shot.red.dtype == np.uint8
        if name != "white":
            assert shot.red.mean() < 0.95 * white.channels["red"].mean()
            assert np.corrcoef(shot.red.ravel(), shot.blue.ravel())[0, 1] < 0.9


def test_seeds_give_different_shots() -> None:
    assert not np.array_equal(textures.printed(1)[0].ir, textures.printed(2)[0].ir)


def test_tables_are_written_from_records() -> None:
    text = report.columns([{"a": 1.23456, "b": "x"}, {"a": None, "b": 7}], {"b": "name", "a": "value"})
    assert text.splitlines() == ["| name | value |", "| --- | --- |", "| x | 1.235 |", "| 7 |  |"]
    text = report.accuracy_section({"figures": {"published_peaks_rms_rad": 0.06, "joint_peaks_rms_rad": 0.009}})
    assert "| peaks_rms_rad | 0.06 | 0.009 |" in text
    assert "no test data" in text


def test_scenes_are_rows_and_the_rest_is_listed() -> None:
    figures = {f"face_{key}": float(n) for n, key in enumerate(report.WORLD)}
    text = report.world_section({"figures": figures | {"edge_px": 1.5, "face_stated_wrong_percent": 3.0}}, "tune")
    assert "| face | 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8 | 9 |" in text
    assert "| edge_px | 1.5 |" in text
    assert "stated" not in text


def test_a_script_without_figures_stops_the_report() -> None:
    with pytest.raises(SystemExit, match="no figures, exit status 2"):
        report.measured(str(ROOT / "benches" / "peers.py"), "--skip", "nobody")


def test_a_package_that_is_not_compared_cannot_be_skipped() -> None:
    command = [sys.executable, str(ROOT / "benches" / "peers.py"), "--skip", "nobody"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert "invalid choice: 'nobody'" in done.stderr


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_every_script_imports_what_it_needs(script: Path) -> None:
    """Run each script as Python does, up to its `main`, with its folder alone on the path."""
    code = f"import runpy, sys; sys.path[0] = {str(script.parent)!r}; runpy.run_path({str(script)!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
