"""How long a decode takes and how much memory it holds, measured on shots of the virtual bench.

Every case, one method at one number of threads, runs in a process of its own that was started with
RAYON_NUM_THREADS: the pool of threads is made once for each process, so that no other way is sound. The processes
take turns, and in every turn some decodes off the clock go before the one on it (`warm`): a busy moment of the machine
hits all of them, and nobody pays for the caches that another has filled, or for threads that slept.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time
from types import TracebackType
from typing import Any

import numpy as np

from quadfringe.config import DecodeConfig, SceneConfig, SystemConfig
from quadfringe.data import Calibration, Shot
from quadfringe.decoding import Plan, ShotDecoder
from quadfringe.decoding.verdict import judge
from quadfringe.errors import DecodeError, InputError
from quadfringe.evaluation.machine import resident_bytes
from quadfringe.scanner import open_system

__all__ = [
    "METHODS",
    "SCALING_SIZES",
    "Case",
    "Cost",
    "Memory",
    "Timing",
    "cost_of",
    "memory",
    "scaling",
    "time_decoding",
    "warm",
    "work",
]

METHODS = ("published", "best")
NOISE = 0.03
SCALING_SIZES = ((576, 432), (800, 600), (1152, 864), (1600, 1200), (2304, 1728), (3200, 2400), (4608, 3456))
REPEATS_MIN = 3
WARM_S = 0.1
DECODERS = 4  # one that warms up and three that are weighed
# glibc then gives every freed map back at once, so that what stays is what a decoder holds.
GIVE_BACK = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "65536"}


@dataclass(frozen=True)
class Case:
    """What is timed: images of `width_px` x `height_px`, a method, a number of threads."""

    width_px: int
    height_px: int
    method: str
    threads: int

    @property
    def pixels(self) -> int:
        """Pixels of one image."""
        return self.width_px * self.height_px


@dataclass(frozen=True)
class Timing:
    """Times of one case, from four uint8 images to X, Y, Z and the verdict on the shot.

    `verdict_ms` is the part of it that judges the shot. `busy_cores` is processor time over time on the clock: near
    the number of threads when all of them have work, and never above it.
    """

    case: Case
    repeats: int
    median_ms: float
    minimum_ms: float
    verdict_ms: float
    busy_cores: float
    returned_percent: float

    @property
    def shots_per_s(self) -> float:
        """Shots in a second, by the median."""
        return 1e3 / self.median_ms

    @property
    def ns_per_pixel(self) -> float:
        """Time for a pixel, by the median."""
        return 1e6 * self.median_ms / self.case.pixels

    def record(self) -> dict[str, Any]:
        """Give everything by name with unit, as plain data."""
        own = {name: value for name, value in vars(self).items() if name != "case"}
        return vars(self.case) | own | {"shots_per_s": self.shots_per_s, "ns_per_pixel": self.ns_per_pixel}


@dataclass(frozen=True)
class Memory:
    """Resident memory of one decoder, that of its last results included: the next shot takes it again."""

    case: Case
    held_mb: float

    def record(self) -> dict[str, Any]:
        """Give everything by name with unit, as plain data."""
        return vars(self.case) | {"held_mb": self.held_mb}


@dataclass(frozen=True)
class Cost:
    """How the time of a decode by one method grows with the pixels: what every shot costs, and what a pixel does.

    `off_percent` is the furthest that a time lies from this line; `spread_percent` how much more a pixel costs at the
    dearest size than at the cheapest, the part that every shot costs included.
    """

    method: str
    fixed_ms: float
    ns_per_pixel: float
    off_percent: float
    spread_percent: float

    def record(self) -> dict[str, Any]:
        """Give everything by name with unit, as plain data."""
        return dict(vars(self))


def time_decoding(
    size: tuple[int, int], methods: Sequence[str], threads: Sequence[int], *, repeats: int, scene: SceneConfig
) -> list[Timing]:
    """Time every method at every number of threads on one shot of a scene, `size` (width, height) pixels, in turns.

    Raises `DecodeError` when a shot of this size cannot be decoded.
    """
    cases = [Case(*size, method, count) for method in methods for count in threads]
    with _shot_folder(size, scene) as folder:
        return _time_in_turns(folder, cases, repeats)


def scaling(methods: Sequence[str], threads: int, *, repeats: int, scene: SceneConfig) -> Iterator[Timing]:
    """Time every method at each of `SCALING_SIZES`, 0.25 to 16 million pixels of the same field of view.

    Fewer repeats for large images, but never less than three.
    """
    for size in SCALING_SIZES:
        fewer = max(REPEATS_MIN, min(repeats, round(repeats * 1e6 / (size[0] * size[1]))))
        with _shot_folder(size, scene) as folder:
            for method in methods:  # one after the other: two decoders of 16 million pixels need some GB
                yield from _time_in_turns(folder, [Case(*size, method, threads)], fewer)


def cost_of(timings: Sequence[Timing]) -> Cost:
    """Draw the line through the times of one method at two sizes or more; least squares of what it is off, in parts.

    Raises `InputError` for less than two sizes, or several methods.
    """
    methods = {timing.case.method for timing in timings}
    pixels = np.array([timing.case.pixels for timing in timings], dtype=np.float64)
    if len(methods) != 1 or len(set(pixels)) < 2:
        raise InputError(f"expected times of one method at two sizes or more, got {len(timings)} of {sorted(methods)}")
    taken_ms = np.array([timing.median_ms for timing in timings])
    parts = np.stack([np.ones_like(pixels), pixels], axis=1) / taken_ms[:, None]
    line, *_ = np.linalg.lstsq(parts, np.ones_like(pixels), rcond=None)
    costs = taken_ms / pixels
    return Cost(
        method=methods.pop(),
        fixed_ms=float(line[0]),
        ns_per_pixel=float(1e6 * line[1]),
        off_percent=float(100.0 * np.abs(parts @ line - 1.0).max()),
        spread_percent=float(100.0 * (costs.max() / costs.min() - 1.0)),
    )


def memory(size: tuple[int, int], methods: Sequence[str], threads: int, *, scene: SceneConfig) -> list[Memory]:
    """Weigh the decoders of each method; empty where the system does not tell what is resident."""
    if resident_bytes() is None:
        return []
    found = []
    with _shot_folder(size, scene) as folder:
        for case in (Case(*size, method, threads) for method in methods):
            with _Worker(folder, case, **GIVE_BACK) as worker:
                found.append(Memory(case, **worker.ask("weigh")))
    return found


def warm(run: Callable[[], object]) -> None:
    """Run off the clock for a tenth of a second at least: systems take time to give threads that slept a core each."""
    start = perf_counter()
    while True:
        run()
        if perf_counter() - start > WARM_S:
            return


def _time_in_turns(folder: Path, cases: Sequence[Case], repeats: int) -> list[Timing]:
    """Time the cases on the shot of a folder; the first turn of all is not counted."""
    with ExitStack() as stack:
        workers = [stack.enter_context(_Worker(folder, case)) for case in cases]
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
    """Give a folder with shot.npy, (4, H, W) uint8, and calibration.json."""
    with open_system(_bench(size, scene)) as scanner, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        np.save(folder / "shot.npy", np.stack(list(scanner.grab().channels.values())))
        scanner.calibration.save(folder / "calibration.json")
        yield folder


def _bench(size: tuple[int, int], scene: SceneConfig) -> SystemConfig:
    """Give the published bench with a camera of another size that sees the same field."""
    with open_system(SystemConfig(scene=scene)) as scanner:
        camera = scanner.calibration.camera
    width, height = size
    scale = width / camera.width_px
    resized = {
        "width_px": width,
        "height_px": height,
        "focal_px": (camera.focal_px[0] * scale, camera.focal_px[1] * scale),
        "centre_px": ((width - 1) / 2, (height - 1) / 2),
    }
    return SystemConfig(scene=scene, camera=camera.model_copy(update=resized))


class _Worker:
    """A process that answers one line of JSON to each command."""

    def __init__(self, folder: Path, case: Case, **environment: str) -> None:
        self._case = case
        full = os.environ | environment | {"RAYON_NUM_THREADS": str(case.threads)}
        command = [
            sys.executable,
            "-c",
            "from quadfringe.evaluation.timing import work; work()",
            str(folder),
            case.method,
        ]
        self._process = subprocess.Popen(command, env=full, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, command: str) -> dict[str, float]:
        """Send a command and wait for its figures; raises `DecodeError` when the process has given up."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(f"{command}\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass  # the process has ended: its last line, or none, tells why
        answer = json.loads(self._process.stdout.readline() or '{"error": "the process ended without an answer"}')
        if "error" in answer:
            case = self._case
            raise DecodeError(f"{case.method} at {case.width_px} x {case.height_px} pixels: {answer['error']}")
        figures: dict[str, float] = answer
        return figures

    def __enter__(self) -> _Worker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.communicate()  # closes its input, at which it ends


def work() -> None:
    """Answer `time` and `weigh` on standard input until it ends; folder and method stand in the arguments.

    This is the other side of `time_decoding` and `memory`, and of no other use.
    """
    folder, method = Path(sys.argv[1]), sys.argv[2]
    shot = Shot(*np.load(folder / "shot.npy"))
    calibration = Calibration.load(folder / "calibration.json")
    settings = DecodeConfig.model_validate({"method": method})
    plan = Plan(calibration.projector.width_px, calibration=calibration, settings=settings)
    answers = {"time": _timed, "weigh": _weighed}
    try:
        decoder = ShotDecoder(shot, plan)
        for line in sys.stdin:
            print(json.dumps(answers[line.strip()](decoder, shot)), flush=True)
    except (DecodeError, InputError, ValueError) as error:
        print(json.dumps({"error": str(error)}), flush=True)


def _timed(decoder: ShotDecoder, shot: Shot) -> dict[str, float]:
    warm(lambda: decoder.decode(shot))
    start, processor_start = perf_counter(), process_time()
    shape = decoder.decode(shot)
    decoded, processor_decoded = perf_counter(), process_time()
    judge(shape, shot, None)
    judged = perf_counter()
    return {
        "decode_ms": 1e3 * (decoded - start),
        "verdict_ms": 1e3 * (judged - decoded),
        "processor_ms": 1e3 * (processor_decoded - processor_start),
        "returned_percent": 100.0 * float(shape.returned.mean()),
    }


def _weighed(first: ShotDecoder, shot: Shot) -> dict[str, float]:
    decoders = [first]
    first.decode(shot)
    before = _resident_mb()
    for _ in range(DECODERS - 1):
        decoders.append(ShotDecoder(shot, first.plan))
        for _ in range(2):
            decoders[-1].decode(shot)
    return {"held_mb": (_resident_mb() - before) / (DECODERS - 1)}


def _resident_mb() -> float:
    gc.collect()
    resident = resident_bytes()
    assert resident is not None, "asked only where it is told"
    return resident / 2**20
