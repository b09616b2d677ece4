"""A sample of the mutated recordings of `mutated_recordings.py`, and writers and batches killed by `kills.py`."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


def figures_of(command: str, tmp_path: Path, *options: object) -> dict[str, Any]:
    out = tmp_path / "figures.json"
    words = [sys.executable, HERE / command, "--json", out, *options]
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    print(done.stdout, done.stderr)
    figures: dict[str, Any] = json.loads(out.read_text())["figures"]
    return figures


def test_no_mutated_recording_hangs_crashes_or_lies(tmp_path: Path) -> None:
    figures = figures_of("mutated_recordings.py", tmp_path, "--count", 120)
    faults = {name: figures[name] for name in ("mutated", "hang", "crash", "traceback", "wrong", "silent")}
    assert faults == {"mutated": 120, "hang": 0, "crash": 0, "traceback": 0, "wrong": 0, "silent": 0}


def test_nothing_is_lost_or_left_when_processes_are_killed(tmp_path: Path) -> None:
    figures = figures_of("kills.py", tmp_path, "--kills", 2)
    assert figures.pop("record_shots_reported") > 0
    assert figures.pop("live_shots_reported") > 0
    assert [figures.pop(f"{who}_killed") for who in ("parent", "worker", "helper", "terminated")] == [2, 2, 2, 1]
    assert figures == {
        "kills_of_each": 2,
        "record_lost": 0,
        "record_wrong": 0,
        "live_lost": 0,
        "live_wrong": 0,
        "parent_files_that_differ": 0,
        "worker_files_that_differ": 0,
        "helper_files_that_differ": 0,
        "terminated_files_that_differ": 0,
        "processes_left": 0,
    }
