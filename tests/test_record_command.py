"""The commands `record`, `recover`, `live` and `batch`."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from quadfringe.cli import app
from quadfringe.evaluation._takes import kill_writer
from quadfringe.recording import Recording

SYSTEM = """
[camera]
width_px = 128
height_px = 96
focal_px = [322.5, 322.5]
centre_px = [63.5, 47.5]

[scene]
surface = "plane"
noise = 0.01
"""


@pytest.fixture
def system(tmp_path: Path) -> Path:
    path = tmp_path / "system.toml"
    path.write_text(SYSTEM)
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refused(result: Result, status: int, *reasons: str) -> None:
    assert result.exit_code == status, result.output
    for reason in reasons:
        assert reason in result.stderr
    assert "Traceback" not in result.output


def test_a_take_is_recorded_described_and_measured_again(system: Path, tmp_path: Path) -> None:
    take = tmp_path / "take.h5"
    result = run("record", system, "--out", take, "--shots", 3, "--json", "-")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["figures"] == {"written": 3, "refused": 0, "dropped": 0}
    told = run("info", take).stdout
    assert "Recording: 3 shots of red, green, blue, ir of 128 x 96 uint8" in told
    assert "not closed" not in told
    (tmp_path / "replay.toml").write_text('capture = "replay:take.h5"\n')
    for source, name in ((system, "a.npz"), (tmp_path / "replay.toml", "b.npz")):
        assert run("measure", source, "--out", tmp_path / name).exit_code == 0
    with np.load(tmp_path / "a.npz") as direct, np.load(tmp_path / "b.npz") as replayed:
        np.testing.assert_array_equal(direct["xyz_mm"], replayed["xyz_mm"])
    refused(run("record", system, "--out", take, "--shots", 1), 2, "take.h5", "exists already")


@pytest.mark.parametrize("asked", [signal.SIGTERM, signal.SIGINT])
def test_seconds_and_signals_end_a_take_in_order(system: Path, tmp_path: Path, asked: signal.Signals) -> None:
    assert run("record", system, "--out", tmp_path / "a.h5", "--seconds", 0.2).exit_code == 0
    command = [sys.executable, "-m", "quadfringe", "record", str(system), "--out", str(tmp_path / "b.h5")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as recording:
        end = time.monotonic() + 60
        while not (tmp_path / "b.h5").exists() and time.monotonic() < end:
            time.sleep(0.05)
        recording.send_signal(asked)
        assert "shots" in recording.communicate(timeout=60)[0]
        assert recording.returncode == 0
    for name in ("a.h5", "b.h5"):
        with Recording(tmp_path / name) as take:
            assert take.closed_in_order
            assert len(take) > 0


def test_a_full_disk_fails_the_run_and_keeps_what_was_written(
    system: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage, asked = shutil.disk_usage(tmp_path), iter(range(1000))
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=1 << 40 if next(asked) < 3 else 0))
    result = run("record", system, "--out", tmp_path / "a.h5", "--shots", 5)
    refused(result, 1, "3 shots were not recorded", "the disk is full")
    with Recording(tmp_path / "a.h5") as take:
        assert len(take) == 2


def test_recover_makes_a_whole_file(tmp_path: Path) -> None:
    reported = kill_writer(tmp_path / "torn.h5", after_s=0.05)
    assert "not closed:" in run("info", tmp_path / "torn.h5").stdout
    result = run("recover", tmp_path / "torn.h5", "--out", tmp_path / "whole.h5", "--json", "-")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["figures"]["shots"] >= reported
    assert "not closed:" not in run("info", tmp_path / "whole.h5").stdout
    (tmp_path / "text.h5").write_text("no")
    refused(
        run("recover", tmp_path / "text.h5", "--out", tmp_path / "x.h5"), 2, "text.h5", "expected an HDF5 recording"
    )
    assert not (tmp_path / "x.h5").exists()


def test_live_measures_records_and_ends(system: Path, tmp_path: Path) -> None:
    result = run("live", system, "--shots", 3, "--record", tmp_path / "a.h5", "--port", 8260)
    assert result.exit_code == 0, result.output
    assert "http://127.0.0.1:8260" in result.stdout.splitlines()
    with Recording(tmp_path / "a.h5") as take:
        assert len(take) == 3


def test_batch_says_what_it_did_and_what_is_wrong(system: Path, tmp_path: Path) -> None:
    take = tmp_path / "take.h5"
    assert run("record", system, "--out", take, "--shots", 2).exit_code == 0
    out = tmp_path / "out"
    done = run("batch", take, "--out", out, "--workers", 1, "--no-ply", "--json", "-")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["figures"] == {"shots": 2, "decoded": 2, "errors": 0, "finished_before": 0}
    assert "2 were already finished" in run("batch", take, "--out", out, "--workers", 1, "--no-ply").stdout
    refused(run("batch", take, "--out", out, "--workers", 1, "--scheduler", "tcp://127.0.0.1:9"), 2, "one of them")
    refused(run("batch", tmp_path / "no.h5", "--out", out), 2, "no.h5")
