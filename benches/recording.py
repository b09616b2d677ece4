"""Recording: megabytes per second against a plain file, and shots lost to kill -9.

    python benches/recording.py [--folder DIR] [--shots 300] [--kills 20] [--json FILE]

Writes raw shots of 1024 x 768 (four images of 8 bit with noise, 3.1 MB) into DIR as fast as possible, in turns with the
same bytes in a plain file; both are synced to the disk before the clock stops. Then it kills writers with SIGKILL at
random times: a shot that a writer had reported and that is not on file, to the last byte, counts as lost. The bars are
150 MB/s or the speed of the plain file, whichever is lower, and no shot lost; the exit status is 1 otherwise.
"""

from __future__ import annotations

import argparse
import os
import random
import statistics
import sys
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

from quadfringe.data import AnyShot, Shot
from quadfringe.evaluation._takes import kill_writer, whole
from quadfringe.files import figures_text
from quadfringe.recording import Recorder, Recording

SHAPE = (768, 1024)
BAR_MB_PER_S = 150.0
TURNS = 5


def noisy_shots(count: int) -> list[AnyShot]:
    noise = np.random.default_rng(1)
    return [Shot(*(noise.integers(0, 256, SHAPE, np.uint8) for _ in range(4))) for _ in range(count)]


def recorded(path: Path, shots: list[AnyShot], count: int) -> tuple[float, float]:
    """Give MB/s and processor ms a shot of a recording."""
    begin, busy = perf_counter(), process_time()
    with Recorder(path) as recorder:
        for number in range(count):
            recorder.write(shots[number % len(shots)])
    _sync(path)
    spent_s, busy_s = perf_counter() - begin, process_time() - busy
    assert recorder.statistics().written == count
    return recorder.statistics().image_bytes / 1e6 / spent_s, 1e3 * busy_s / count


def plain(path: Path, shots: list[AnyShot], count: int) -> float:
    """Give MB/s of the same bytes in a plain file."""
    begin = perf_counter()
    with path.open("wb", buffering=0) as file:
        for number in range(count):
            for image in shots[number % len(shots)].images.values():
                file.write(image.data)
    _sync(path)
    return path.stat().st_size / 1e6 / (perf_counter() - begin)


def _sync(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def lost_after_kills(folder: Path, kills: int) -> tuple[int, int]:
    """Give how many reported shots are not on file, and how many were reported."""
    chance = random.Random(1)
    lost = reported = 0
    for kill in range(kills):
        path = folder / f"kill{kill}.h5"
        promised = kill_writer(path, chance.uniform(0.0, 0.5), SHAPE)
        with Recording(path) as take:
            safe = sum(whole(take[number], number) for number in range(min(promised, len(take))))
        lost += promised - safe
        reported += promised
        path.unlink()
    return lost, reported


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--folder", type=Path, default=Path())
    parser.add_argument("--shots", type=int, default=300)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    shots = noisy_shots(16)
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        speeds, bare, busy = [], [], []
        for _ in range(TURNS):
            bare.append(plain(folder / "plain.bin", shots, options.shots))
            (folder / "plain.bin").unlink()
            speed, busy_ms = recorded(folder / "take.h5", shots, options.shots)
            (folder / "take.h5").unlink()
            speeds.append(speed)
            busy.append(busy_ms)
        lost, reported = lost_after_kills(folder, options.kills)
    figures = {
        "recording_mb_per_s": statistics.median(speeds),
        "plain_file_mb_per_s": statistics.median(bare),
        "recording_of_plain_file": statistics.median(s / b for s, b in zip(speeds, bare, strict=True)),
        "recording_busy_ms_per_shot": statistics.median(busy),
        "kills": options.kills,
        "kills_shots_reported": reported,
        "kills_shots_lost": lost,
    }
    for key, value in figures.items():
        print(f"{key:28}{value:12.4g}")
    if options.json:
        options.json.write_text(figures_text(figures))
    bar = min(BAR_MB_PER_S, figures["plain_file_mb_per_s"])
    return int(figures["recording_mb_per_s"] < bar or lost > 0)


if __name__ == "__main__":
    sys.exit(main())
