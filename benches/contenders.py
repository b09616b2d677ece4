"""The programs that `peers.py` times: quadfringe, plain NumPy, the compiled floor, and other packages."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from bench_decode import numpy_contender, product_contender
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe import _core
from quadfringe.decoding.stages import linear_light, wrapped_phases
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation.machine import usable_cores
from quadfringe.evaluation.timing import warm

ROOT = Path(__file__).resolve().parents[1]
SURFACE, NOISE = "peaks", 0.03
FRINGE_PX = 28
ONE_SHOT = "4, one shot"

Map = NDArray[Any]


@dataclass(frozen=True)
class Contender:
    """A program to time: `turn` gives one time in ms, `phase_rad` its phase map, `kind` the meaning of that map."""

    name: str
    images: str
    gives: str
    threads: int
    turn: Callable[[], float]
    phase_rad: Callable[[], Map] | None = None
    kind: str = "absolute"  # absolute, relative or wrapped


@dataclass(frozen=True)
class Bench:
    """The scene that all contenders get, and its truth."""

    shot: qf.Shot
    calibration: qf.Calibration
    config: qf.SystemConfig
    scene: scoring.Scene
    inner: NDArray[np.bool_]

    def steps(self, number: float, shifts_rad: list[float], seed: int) -> list[Map]:
        """Give one image for each shift of the same scene, with the same noise but other seeds."""
        bench = _core.Bench()
        cast = bench.cast(SURFACE)
        images = []
        for i, shift_rad in enumerate(shifts_rad):
            shown = bench.render_step(cast, number, shift_rad, noise=NOISE, seed=seed + i, bit_depth=8)
            images.append(shown["red"])
        return images


def bench_shot() -> Bench:
    config = qf.SystemConfig(scene=qf.SceneConfig(surface=SURFACE, noise=NOISE))
    with qf.open(config) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    scene = scenes.scene_from(shot, config, calibration.projector.width_px)
    return Bench(shot, calibration, config, scene, scoring.inside(scene.scored, FRINGE_PX))


def timed(run: Callable[[], object]) -> Callable[[], float]:
    def turn() -> float:
        warm(run)
        start = time.perf_counter()
        run()
        return 1e3 * (time.perf_counter() - start)

    return turn


def product(bench: Bench) -> list[Contender]:
    found = []
    for method in ("published", "joint"):
        for threads in sorted({1, usable_cores()}):
            run = product_contender(bench.shot, bench.config, bench.calibration, method=method, threads=threads)
            name = f"{method}_{threads}_threads"
            found.append(Contender(name, ONE_SHOT, "X, Y, Z", threads, timed(run), lambda run=run: run()[0]))
    return found


def plain_numpy(bench: Bench) -> list[Contender]:
    found = []
    for dtype in (np.float32, np.float64):
        run = numpy_contender(bench.shot, bench.calibration, dtype)
        name = f"numpy_{np.dtype(dtype).name}"
        found.append(Contender(name, ONE_SHOT, "X, Y, Z", 1, timed(run), lambda run=run: run()[0]))
    return found


class FloorProcess:
    """The compiled bench at a number of threads; answers a name with a time in ms."""

    def __init__(self, program: str, threads: int) -> None:
        environment = os.environ | {"RAYON_NUM_THREADS": str(threads)}
        pipe = subprocess.PIPE
        self._process = subprocess.Popen([program, "--serve"], env=environment, stdin=pipe, stdout=pipe, text=True)

    def time_ms(self, name: str) -> float:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{name}\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())

    def __enter__(self) -> FloorProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.communicate()


def floor_program() -> str:
    command = ["cargo", "bench", "--package", "quadfringe", "--bench", "floor", "--no-run", "--message-format=json"]
    done = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    programs = [message.get("executable") for message in map(json.loads, done.stdout.splitlines())]
    return next(program for program in programs if program)


def floor(stack: ExitStack) -> list[Contender]:
    program = floor_program()
    found = []
    for threads in sorted({1, usable_cores()}):
        process = stack.enter_context(FloorProcess(program, threads))
        for name, gives in (("floor", "bytes"), ("published", "X, Y, Z"), ("joint", "X, Y, Z")):
            label = f"{'floor' if name == 'floor' else f'kernel_{name}'}_{threads}_threads"
            found.append(Contender(label, ONE_SHOT, gives, threads, lambda p=process, n=name: p.time_ms(n)))
    return found


def opencv(bench: Bench) -> list[Contender]:
    import cv2

    light = cv2.structured_light
    height, width = bench.shot.red.shape
    thirds = [0.0, 2 * np.pi / 3, 4 * np.pi / 3]
    # Its patterns are sines where the bench shows cosines; a constant offset, undone when judged.
    images = bench.steps(bench.config.fringes.numbers[0], thirds, seed=100)
    found = []
    for name, method, used in (("opencv_ftp", light.FTP, "1"), ("opencv_psp", light.PSP, "3")):
        settings = cv2.structured_light_SinusoidalPattern_Params()
        settings.width, settings.height, settings.methodId = width, height, method
        settings.nbrOfPeriods = int(bench.config.fringes.numbers[0])
        pattern = light.SinusoidalPattern_create(settings)

        def run(pattern: Any = pattern) -> Map:
            phase_rad, _ = pattern.computePhaseMap(images)
            return np.asarray(phase_rad)

        found.append(Contender(name, used, "wrapped phase", cv2.getNumThreads(), timed(run), run, "wrapped"))
    return found


def scikit_image(bench: Bench) -> list[Contender]:
    from skimage.restoration import unwrap_phase

    wrapped_rad = wrapped_phases(linear_light(bench.shot), bench.config.fringes.numbers)[0]
    masked = np.ma.masked_array(wrapped_rad, ~np.isfinite(wrapped_rad))

    def run() -> Map:
        return np.ma.filled(unwrap_phase(masked, rng=0), np.nan)

    return [Contender("scikit_image_unwrap", "wrapped phase", "relative phase", 1, timed(run), run, "relative")]
