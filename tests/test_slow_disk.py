"""A disk that is slower than the camera: measuring goes on, memory is bounded, and every lost shot is counted.

QUADFRINGE_SLOW_DISK_S=60 lets the disk be slow for a minute; two seconds suffice to fill the queue.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.host_faults import faulty_host
from typer.testing import CliRunner

from quadfringe.cli import app
from quadfringe.devices.virtual import VirtualCamera
from quadfringe.recording import Recording
from quadfringe.scanner.streaming import TAP_LENGTH

HERE = Path(__file__).parent
SLOW_S = float(os.environ.get("QUADFRINGE_SLOW_DISK_S", "2"))
SHOT_KB = 4 * 512 * 512 // 1024


def test_a_slow_disk_loses_counted_shots_and_nothing_else(tmp_path: Path) -> None:
    take = tmp_path / "take.h5"
    environment = faulty_host(tmp_path)
    environment["PYTHONPATH"] = ":".join([str(HERE), environment.get("PYTHONPATH", "")])
    program = [sys.executable, HERE / "stream_to_a_slow_disk.py", take, str(SLOW_S)]
    ran = subprocess.run(
        program, env=environment, stdout=subprocess.PIPE, text=True, check=True, timeout=60 + 2 * SLOW_S
    )
    found = json.loads(ran.stdout)
    during = found["during"]
    assert during["written"] < during["given"] / 4, "the disk was not slow"
    assert during["decoded"] > during["given"] / 2, "decoding waited for the disk"
    assert during["longest_pause_s"] < 1.0, "decoding waited for the disk"
    assert during["most_waiting"] == TAP_LENGTH
    assert during["grown_kb"] < 1.5 * TAP_LENGTH * SHOT_KB
    assert found["dropped"] > 0
    assert found["dropped"] == found["dropped_until_caught_up"], "shots are lost although the disk is fast again"
    assert found["refused"] == 0
    assert found["written"] + found["dropped"] == found["given"]
    with Recording(take) as recorded:
        assert len(recorded) == found["written"]
        assert recorded.closed_in_order
        assert recorded.verify().damaged == ()
        ids = [shot.id for shot in recorded]
    assert np.all(np.diff(ids) > 0)
    assert ids[-1] == found["given"]
    assert sum(np.diff(ids) - 1) + ids[0] - 1 == found["dropped"]


def test_the_command_fails_when_shots_were_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count = VirtualCamera.statistics
    monkeypatch.setattr(VirtualCamera, "statistics", lambda camera: replace(count(camera), dropped=7))
    for command in (["record"], ["live", "--record"]):
        file = tmp_path / f"{command[0]}.h5"
        words = [command[0], "--shots", "2", "--out" if command[0] == "record" else "--record", str(file)]
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 1, result.output
        assert "7 shots were not recorded: the disk is slower than the camera" in result.stderr
        with Recording(file) as take:
            assert len(take) == 2
