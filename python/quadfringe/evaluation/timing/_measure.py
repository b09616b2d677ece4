"""Timing runs: which cases are decoded, in which order, and how often.

Every case, one method at one number of threads, runs in a separate process, started with RAYON_NUM_THREADS, because the
thread pool is created once per process. The processes take turns, so that a busy moment of the machine affects all of
them. Before each timed decode the process decodes the shot several times untimed (`warm`), so that no case pays for
cold caches or sleeping threads.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from quadfringe.config import SceneConfig, SystemConfig
from quadfringe.evaluation.machine import resident_bytes
from quadfringe.evaluation.timing._worker import Worker
from quadfringe.evaluation.timing.records import Case, Memory, Timing
from quadfringe.scanner import open_system

__all__ = ["METHODS", "NOISE", "SCALING_SIZES", "memory", "scaling", "time_decoding"]

METHODS = ("published", "joint")
NOISE = 0.03  # standard deviation of the sensor noise, share of full scale, as in the published evaluation
# (width, height) in px, 4:3, each about twice the pixels of the one before, from 0.25 to 16 million pixels.
SCALING_SIZES = ((576, 432), (800, 600), (1152, 864), (1600, 1200), (2304, 1728), (3200, 2400), (4608, 3456))
REPEATS_MIN = 3  # the fewest times of which a median means anything
# With these thresholds glibc returns every freed map to the system at once, so that only memory in use is resident.
RETURN_FREED_MEMORY = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "65536"}


def time_decoding(
    size: tuple[int, int], methods: Sequence[str], threads: Sequence[int], *, repeats: int, scene: SceneConfig
) -> list[Timing]:
    """Time every method at every number of threads on one shot of a scene; `size` is (width, height) in pixels.

    Raises `DecodeError` when a shot of this size cannot be decoded.
    """
    cases = [Case(*size, method, count) for method in methods for count in threads]
    with _shot_folder(size, scene) as folder:
        return _time_in_turns(folder, cases, repeats)


def scaling(methods: Sequence[str], threads: int, *, repeats: int, scene: SceneConfig) -> Iterator[Timing]:
    """Time every method at each of `SCALING_SIZES`, 0.25 to 16 million pixels of the same field of view.

    Large images are repeated less often, but at least three times.
    """
    for size in SCALING_SIZES:
        fewer = max(REPEATS_MIN, min(repeats, round(repeats * 1e6 / (size[0] * size[1]))))
        with _shot_folder(size, scene) as folder:
            for method in methods:  # one at a time, because two decoders of 16 million pixels need several GB
                yield from _time_in_turns(folder, [Case(*size, method, threads)], fewer)


def memory(size: tuple[int, int], methods: Sequence[str], threads: int, *, scene: SceneConfig) -> list[Memory]:
    """Measure the memory of a decoder of each method; empty where the system does not report resident memory."""
    if resident_bytes() is None:
        return []
    found = []
    with _shot_folder(size, scene) as folder:
        for case in (Case(*size, method, threads) for method in methods):
            with Worker(folder, case, **RETURN_FREED_MEMORY) as worker:
                found.append(Memory(case, **worker.ask("weigh")))
    return found


def _time_in_turns(folder: Path, cases: Sequence[Case], repeats: int) -> list[Timing]:
    """Time the cases on the shot of a folder in turns; the first turn is discarded as a warm-up."""
    with ExitStack() as stack:
        workers = [stack.enter_context(Worker(folder, case)) for case in cases]
        turns: list[list[dict[str, float]]] = [[worker.ask("time") for worker in workers] for _ in range(repeats + 1)]
    return [_timing(case, [turn[i] for turn in turns[1:]]) for i, case in enumerate(cases)]


def _timing(case: Case, turns: list[dict[str, float]]) -> Timing:
    decode_ms = [turn["decode_ms"] for turn in turns]
    return Timing(
        case=case,
        repeats=len(turns),
        median_ms=float(np.median(decode_ms)),
        minimum_ms=min(decode_ms),
        verdict_ms=float(np.median([turn["verdict_ms"] for turn in turns])),
        busy_cores=sum(turn["processor_ms"] for turn in turns) / sum(decode_ms),
        returned_percent=turns[0]["returned_percent"],
    )


@contextmanager
def _shot_folder(size: tuple[int, int], scene: SceneConfig) -> Iterator[Path]:
    """Yield a temporary folder with shot.npy, (4, H, W) uint8, and calibration.json."""
    with open_system(_resized_bench(size, scene)) as scanner, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        np.save(folder / "shot.npy", np.stack(list(scanner.grab().channels.values())))
        assert scanner.calibration is not None, "the virtual bench has a calibration"
        scanner.calibration.save(folder / "calibration.json")
        yield folder


def _resized_bench(size: tuple[int, int], scene: SceneConfig) -> SystemConfig:
    """Return the published bench with a camera of another size and the same field of view."""
    with open_system(SystemConfig(scene=scene)) as scanner:
        camera = scanner.config.camera
    assert camera is not None, "the virtual bench writes its devices out"
    width, height = size
    scale = width / camera.width_px
    resized = {
        "width_px": width,
        "height_px": height,
        "focal_px": (camera.focal_px[0] * scale, camera.focal_px[1] * scale),
        "centre_px": ((width - 1) / 2, (height - 1) / 2),
    }
    return SystemConfig(scene=scene, camera=camera.model_copy(update=resized))
