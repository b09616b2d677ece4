"""The scripts of benches/: how peers are judged, and what is written of it."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scoring import ROOT

sys.path.append(str(ROOT / "benches"))
import accuracy
import peers
import results

import quadfringe as qf


@pytest.fixture(scope="module")
def bench() -> peers.Bench:
    return peers.bench_shot()


def contender(phase_rad: NDArray[np.floating], kind: str) -> peers.Contender:
    return peers.Contender("someone", "1", "phase", 1, lambda: 0.0, lambda: phase_rad, kind)


def test_sign_and_offset_of_a_wrapped_phase_are_undone(bench: peers.Bench) -> None:
    turned = np.angle(np.exp(-1j * (bench.scene.phase_rad - 0.7)))
    assert peers.judged(contender(turned, "wrapped"), bench)["phase_rms_rad"] < 1e-6
    wavy = np.angle(np.exp(1j * (bench.scene.phase_rad + 0.1 * np.cos(bench.scene.phase_rad))))
    found = peers.judged(contender(wavy, "wrapped"), bench)
    assert found["phase_rms_rad"] == pytest.approx(0.1 / np.sqrt(2), rel=0.05)
    assert "wrong_orders_percent" not in found


def test_whole_turns_are_undone_only_for_a_relative_phase(bench: peers.Bench) -> None:
    off = bench.scene.phase_rad + 4 * np.pi
    assert peers.judged(contender(off, "relative"), bench)["wrong_orders_percent"] == 0
    assert peers.judged(contender(off, "absolute"), bench)["wrong_orders_percent"] == 100


def test_pixels_that_are_not_returned_are_left_out(bench: peers.Bench) -> None:
    holes = bench.scene.phase_rad.copy()
    holes[:, ::2] = np.nan
    assert peers.judged(contender(holes, "absolute"), bench) == {"phase_rms_rad": 0.0, "wrong_orders_percent": 0.0}


def test_a_time_without_a_phase_is_not_judged(bench: peers.Bench) -> None:
    assert peers.judged(replace(contender(bench.scene.phase_rad, "absolute"), phase_rad=None), bench) == {}


def test_steps_of_the_same_scene_carry_the_same_phase(bench: peers.Bench) -> None:
    stack = np.stack(bench.steps(36.0, [0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi], seed=1)).astype(float)
    phase_rad = np.arctan2(stack[3] - stack[1], stack[0] - stack[2])
    assert peers.judged(contender(phase_rad, "wrapped"), bench)["phase_rms_rad"] < 0.08  # 3 % noise in four steps


def test_a_peer_that_nobody_knows_cannot_be_skipped() -> None:
    command = [sys.executable, str(ROOT / "benches" / "peers.py"), "--skip", "nobody"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert "invalid choice: 'nobody'" in done.stderr


def test_a_print_changes_the_light_and_not_the_truth() -> None:
    white, truth_rad = accuracy.white(1)
    for take in (accuracy.patches, accuracy.shades, accuracy.printed):
        shot, same_rad = take(1)
        np.testing.assert_array_equal(same_rad, truth_rad)
        assert shot.red.dtype == np.uint8
        assert shot.red.mean() < 0.95 * white.red.mean()
        assert np.corrcoef(shot.red.ravel(), shot.blue.ravel())[0, 1] < 0.9


def test_shots_without_a_seed_of_their_own_differ() -> None:
    assert not np.array_equal(accuracy.printed(1)[0].red, accuracy.printed(2)[0].red)
    assert isinstance(accuracy.white(1)[0], qf.Shot)


def test_tables_are_written_from_records() -> None:
    text = results.columns([{"a": 1.23456, "b": "x"}, {"a": None, "b": 7}], {"b": "name", "a": "value"})
    assert text.splitlines() == ["| name | value |", "| --- | --- |", "| x | 1.235 |", "| 7 |  |"]
    text = results.accuracy({"figures": {"published_peaks_rms_rad": 0.06, "best_peaks_rms_rad": 0.009}})
    assert "| peaks_rms_rad | 0.06 | 0.009 |" in text
    assert "no test data" in text


def test_a_script_without_figures_stops_the_results() -> None:
    with pytest.raises(SystemExit, match="no figures, exit status 2"):
        results.measured(str(ROOT / "benches" / "peers.py"), "--skip", "nobody")
