"""Batch decoding: how much faster two worker processes are than one.

    python benches/batch.py [--shots 200] [--turns 1] [--only speed|restart] [--folder DIR] [--json FILE]

Decodes one recording of the published steps (1024 x 768, joint method) into zarr and PLY, with one kernel thread per
worker, by one worker and by two in turns. The time runs from the first result to the last, because a long batch starts
its processes only once; the factor that includes the start is reported too. The busy cores show how much processor time
the workers got: the figure means something only on two free cores. Then the script kills a run with SIGKILL, gives the
same command again, and compares every file with those of the first run. Bars: 1.7, and no file differs; the exit status
is 1 otherwise. DIR needs 40 MB a shot; the default is the system's temporary folder.
"""

from __future__ import annotations

import argparse
import filecmp
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter

import numpy as np

import quadfringe as qf
from quadfringe.data import Shot
from quadfringe.files import figures_text
from quadfringe.recording import Recorder
from quadfringe.recording.batch import decode_recordings

BAR = 1.7


def recording(path: Path, shots: int) -> None:
    """Record one scene many times, each shot with different noise."""
    noise = np.random.default_rng(1)
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="steps", noise=0.01))) as scanner:
        shot = scanner.grab()
        with Recorder(path, scanner.config, scanner.calibration) as recorder:
            for _ in range(shots):
                images = {n: i // 2 + noise.integers(0, 3, i.shape, np.uint8) for n, i in shot.images.items()}
                recorder.write(Shot(**images))


def decoded(take: Path, out: Path, workers: int) -> tuple[float, float, float]:
    """Give shots a second once the first is there, seconds over all, and busy cores of the workers."""
    begin, moments = perf_counter(), []
    before = os.times()
    for outcome in decode_recordings([take], out, workers=workers):
        assert outcome.error is None, outcome.error
        moments.append(perf_counter())
    spent_s = perf_counter() - begin
    after = os.times()
    busy_s = after.children_user + after.children_system - before.children_user - before.children_system
    # The first result of every worker is late by its start.
    return (len(moments) - workers) / (moments[-1] - moments[workers - 1]), spent_s, busy_s / spent_s


def killed_and_restarted(take: Path, out: Path, whole: Path) -> tuple[int, int]:
    """Kill a batch in the middle, give it again; return how many shots were finished, and how many files differ."""
    command = [sys.executable, "-m", "quadfringe", "batch", str(take), "--out", str(out)]
    wanted = len(list((whole / take.stem).glob("*.ply"))) // 2
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True) as run:
        while len(list((out / take.stem).glob("*.ply"))) < wanted:
            assert run.poll() is None, "it ended before it could be killed"
            time.sleep(0.05)
        os.killpg(run.pid, signal.SIGKILL)
    finished = len(list((out / take.stem).glob("*.ply")))
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    files = {path.relative_to(folder) for folder in (out, whole) for path in folder.rglob("*") if path.is_file()}
    return finished, sum(not same(out / file, whole / file) for file in files)


def same(one: Path, other: Path) -> bool:
    return one.is_file() and other.is_file() and filecmp.cmp(one, other, shallow=False)


@contextmanager
def stopped_like_an_error() -> Iterator[None]:
    """Let SIGTERM unwind as Ctrl-C does, so that no temporary file stays on the disk."""
    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    yield
    signal.signal(signal.SIGTERM, before)


def speed(take: Path, folder: Path, turns: int) -> dict[str, float]:
    runs: dict[int, list[tuple[float, float, float]]] = {1: [], 2: []}
    for turn in range(turns):
        for workers, done in runs.items():
            out = folder / f"out{turn}_{workers}"
            done.append(decoded(take, out, workers))
            shutil.rmtree(out)
    one, two = ([statistics.median(column) for column in zip(*done, strict=True)] for done in runs.values())
    return {
        "batch_shots_per_s_1_worker": one[0],
        "batch_shots_per_s_2_workers": two[0],
        "batch_two_workers_over_one": two[0] / one[0],
        "batch_two_workers_over_one_with_start": one[1] / two[1],
        "batch_busy_cores_1_worker": one[2],
        "batch_busy_cores_2_workers": two[2],
    }


def restart(take: Path, folder: Path) -> dict[str, float]:
    decoded(take, folder / "whole", 2)
    finished, differing = killed_and_restarted(take, folder / "killed", folder / "whole")
    return {"batch_shots_finished_when_killed": finished, "batch_files_that_differ": differing}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--shots", type=int, default=200)
    parser.add_argument("--turns", type=int, default=1)
    parser.add_argument("--only", choices=["speed", "restart"])
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    figures: dict[str, float] = {}
    with stopped_like_an_error(), tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        recording(folder / "take.h5", options.shots)
        if options.only != "restart":
            figures |= speed(folder / "take.h5", folder, options.turns)
        if options.only != "speed":
            figures |= restart(folder / "take.h5", folder)
    for key, value in figures.items():
        print(f"{key:40}{value:10.4g}")
    if options.json:
        options.json.write_text(figures_text(figures))
    slow = figures.get("batch_two_workers_over_one", BAR) < BAR
    return int(slow or figures.get("batch_files_that_differ", 0) > 0)


if __name__ == "__main__":
    sys.exit(main())
