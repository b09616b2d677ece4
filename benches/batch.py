"""Batch: how much faster two worker processes decode a recording than one.

    python benches/batch.py [--shots 200] [--turns 1] [--json FILE]

The default scene at 1024 x 768, the published steps, decoded with the best method into zarr and PLY, one kernel thread
a worker; one worker and two in turns. The time is from the first result to the last, so that starting processes, which
a long batch does once, is not weighed; with it the factor is given too. Busy cores are what the workers got of the
processors: the machine must have two free ones for the figure to mean anything. The bar is 1.7; exit status 1 below it.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

import quadfringe as qf
from quadfringe.batch import decode_recordings
from quadfringe.data import Shot
from quadfringe.files import figures_text
from quadfringe.recording import Recorder

BAR = 1.7


def recording(path: Path, shots: int) -> None:
    """Record one scene many times, with noise of its own in every shot."""
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


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--shots", type=int, default=200)
    parser.add_argument("--turns", type=int, default=1)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    runs: dict[int, list[tuple[float, float, float]]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory(dir=Path()) as name:
        take = Path(name) / "take.h5"
        recording(take, options.shots)
        for turn in range(options.turns):
            for workers, done in runs.items():
                done.append(decoded(take, Path(name) / f"out{turn}_{workers}", workers))
    one, two = ([statistics.median(column) for column in zip(*done, strict=True)] for done in runs.values())
    figures = {
        "batch_shots_per_s_1_worker": one[0],
        "batch_shots_per_s_2_workers": two[0],
        "batch_two_workers_over_one": two[0] / one[0],
        "batch_two_workers_over_one_with_start": one[1] / two[1],
        "batch_busy_cores_1_worker": one[2],
        "batch_busy_cores_2_workers": two[2],
    }
    for key, value in figures.items():
        print(f"{key:40}{value:10.4g}")
    if options.json:
        options.json.write_text(figures_text(figures))
    return int(figures["batch_two_workers_over_one"] < BAR)


if __name__ == "__main__":
    sys.exit(main())
