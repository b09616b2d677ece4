"""The worker processes of a timing run, and the commands that they answer."""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from types import TracebackType

import numpy as np

from quadfringe.config import DecodeConfig
from quadfringe.data import Calibration, Shot
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.decoder import judged
from quadfringe.errors import DecodeError, InputError
from quadfringe.evaluation.machine import resident_bytes
from quadfringe.evaluation.timing.records import Case

__all__ = ["Worker", "warm", "work"]

# How long decodes run before one is timed, s: the scheduler needs several milliseconds to give each woken thread a core
# and the processor needs some to reach its working frequency; a tenth of a second covers both and costs little.
WARM_S = 0.1
DECODERS = 4  # one that fills the shared pools and three that are weighed


class Worker:
    """A process that decodes one case and answers each command with one line of JSON."""

    def __init__(self, folder: Path, case: Case, **environment: str) -> None:
        self._case = case
        full = os.environ | environment | {"RAYON_NUM_THREADS": str(case.threads)}
        command = [
            sys.executable,
            "-c",
            "from quadfringe.evaluation.timing._worker import work; work()",
            str(folder),
            case.method,
        ]
        self._process = subprocess.Popen(command, env=full, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, command: str) -> dict[str, float]:
        """Send a command and return its figures; raises `DecodeError` when the process has failed."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(f"{command}\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pass  # the process has ended; its last line, if any, says why
        answer = json.loads(self._process.stdout.readline() or '{"error": "the process ended without an answer"}')
        if "error" in answer:
            case = self._case
            raise DecodeError(f"{case.method} at {case.width_px} x {case.height_px} pixels: {answer['error']}")
        figures: dict[str, float] = answer
        return figures

    def __enter__(self) -> Worker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.communicate()  # closes its standard input, which ends it


def warm(run: Callable[[], object]) -> None:
    """Call `run` without timing it, for at least `WARM_S` seconds."""
    start = perf_counter()
    while True:
        run()
        if perf_counter() - start > WARM_S:
            return


def work() -> None:
    """Answer the commands `time` and `weigh` on standard input until it ends: the loop of a worker process.

    The arguments of the process are the folder of the shot and the method.
    """
    folder, method = Path(sys.argv[1]), sys.argv[2]
    shot = Shot(*np.load(folder / "shot.npy"))
    calibration = Calibration.load(folder / "calibration.json")
    settings = DecodeConfig.model_validate({"method": method})
    plan = Plan(calibration.projector.width_px, calibration=calibration, decode=settings)
    answers = {"time": _timed, "weigh": _weighed}
    try:
        decoder = Decoder(shot, plan)
        for line in sys.stdin:
            print(json.dumps(answers[line.strip()](decoder, shot)), flush=True)
    except (DecodeError, InputError, ValueError) as error:
        print(json.dumps({"error": str(error)}), flush=True)


def _timed(decoder: Decoder, shot: Shot) -> dict[str, float]:
    warm(lambda: decoder.decode(shot))
    start, processor_start = perf_counter(), process_time()
    shape = decoder.decode(shot)
    decoded, processor_decoded = perf_counter(), process_time()
    judged(shape, shot, decoder.plan, None)
    checked = perf_counter()
    return {
        "decode_ms": 1e3 * (decoded - start),
        "verdict_ms": 1e3 * (checked - decoded),
        "processor_ms": 1e3 * (processor_decoded - processor_start),
        "returned_percent": 100.0 * float(shape.returned.mean()),
    }


def _weighed(first: Decoder, shot: Shot) -> dict[str, float]:
    decoders = [first]
    first.decode(shot)
    before = _resident_mb()
    for _ in range(DECODERS - 1):
        decoders.append(Decoder(shot, first.plan))
        for _ in range(2):
            decoders[-1].decode(shot)
    return {"held_mb": (_resident_mb() - before) / (DECODERS - 1)}


def _resident_mb() -> float:
    gc.collect()
    resident = resident_bytes()
    assert resident is not None, "the caller has checked that the system reports resident memory"
    return resident / 2**20
