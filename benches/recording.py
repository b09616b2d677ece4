"""Recording: megabytes per second against a plain file, and shots lost to kill -9.

    python benches/recording.py [--folder DIR] [--shots 300] [--kills 20] [--json FILE]
    python benches/recording.py --checksums

Writes raw shots of 1024 x 768 (four images of 8 bit with noise, 3.1 MB) into DIR as fast as possible, in turns with the
same bytes in a plain file; both are synced to the disk before the clock stops. Then it kills writers with SIGKILL at
random times: a shot that a writer had reported and that is not on file, to the last byte, counts as lost. The bars are
150 MB/s or the speed of the plain file, whichever is lower, and no shot lost; the exit status is 1 otherwise.

--checksums prints the time that checksums of a shot take: those of a recording, and others that it could have.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import statistics
import sys
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time

import h5py
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot, Shot
from quadfringe.evaluation._takes import kill_writer, whole
from quadfringe.files import figures_text
from quadfringe.recording import Recorder, Recording
from quadfringe.recording._checksums import crc_of_shot, crcs_of

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


def checksum_times(shot: AnyShot) -> dict[str, float]:
    """Give ms a shot of the checksums of a recording, and of others over the same bytes."""
    images = [image.tobytes() for image in shot.images.values()]
    with tempfile.TemporaryDirectory() as folder, h5py.File(Path(folder) / "memory.h5", "w", driver="core") as file:
        shape = (len(images), *SHAPE)
        plain, summed = (
            file.create_dataset(name, shape, "u1", chunks=(1, *SHAPE), fletcher32=name == "summed")
            for name in ("plain", "summed")
        )
        array = np.stack(list(shot.images.values()))
        fletcher_ms = fastest_ms(lambda: written(summed, array)) - fastest_ms(lambda: written(plain, array))
    return {
        "of_a_recording": fastest_ms(lambda: crc_of_shot("0" * 64, 1, (1, 2), ((1, 2, 3),) * 2, crcs_of(shot.images))),
        "of_the_images_in_it": fastest_ms(lambda: crcs_of(shot.images)),
        "zlib_crc32": fastest_ms(lambda: [zlib.crc32(image) for image in images]),
        "sha256": fastest_ms(lambda: [hashlib.sha256(image).digest() for image in images]),
        "blake2b": fastest_ms(lambda: [hashlib.blake2b(image).digest() for image in images]),
        "hdf5_fletcher32": fletcher_ms,
    }


def written(dataset: h5py.Dataset, array: NDArray[np.uint8]) -> None:
    dataset.write_direct(array)
    dataset.file.flush()  # HDF5 computes its checksum here


def fastest_ms(call: Callable[[], object]) -> float:
    times = []
    for _ in range(50):
        begin = perf_counter()
        call()
        times.append(perf_counter() - begin)
    return 1e3 * min(times)


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
    parser.add_argument("--checksums", action="store_true")
    options = parser.parse_args()
    shots = noisy_shots(16)
    if options.checksums:
        for key, value in checksum_times(shots[0]).items():
            print(f"{key:28}{value:12.3f} ms")
        return 0
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
