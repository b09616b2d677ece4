"""Read mutated recordings by every command that reads them; count hangs, crashes, tracebacks and wrong data.

    python tests/hostile/mutated_recordings.py [--count 3000] [--first 0] [--json FILE]

Mutation `number` is drawn from the seed `number`, so that each can be repeated alone (`--first N --count 1`). The base
files are a closed recording, one of raw mosaics, one whose writer was killed, and one of version 1. A child process
reads the mutated file by one of: iteration, `info`, `info --verify`, `recover`, replay. It counts as

    hang            it took more than 5 s, twice: the first time may be that of a busy machine, and counts as repeated
    crash           it ended by a signal
    traceback       the command ended with an exception that is none of its errors
    wrong           a pixel, stamp, setting or calibration differs from the one recorded, without an error
    silent          a shot of a closed recording is missing, without an error or a warning

A recording of version 1 has checksums of images only: there a stamp or calibration may differ if a warning says that
they cannot be verified. The exit status is 1 if any count is not zero.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from recording_mutations import mutated
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.data import AnyShot, BayerShot, Calibration, FrameStamp, Stamp
from quadfringe.errors import RecordingError
from quadfringe.evaluation._takes import numbered_shot
from quadfringe.recording import Recorder, Recording, RecordingWriter
from quadfringe.recording._layout import Header
from quadfringe.recording.replay import ReplayCamera

LIMIT_S = 5.0
SHOTS = 6
SIZE = (32, 48)
FAULTS = ("hang", "crash", "traceback", "wrong", "silent")
VERSION_1 = Path(__file__).parents[1] / "golden" / "take.h5"


@dataclass(frozen=True)
class Base:
    """A sound file and what it contains; `closed` when the number of its shots is known."""

    data: bytes
    shots: dict[int, AnyShot]
    config: qf.SystemConfig | None
    calibration: Calibration | None
    closed: bool = True
    version: int = 2


def stamped(number: int) -> AnyShot:
    frames = {name: FrameStamp(number + i, 7 * number + i, 9 * number) for i, name in enumerate(("visible", "ir"))}
    return replace(numbered_shot(number, SIZE), stamp=Stamp(100 + number, 10_000 * number, "twin", frames))


def mosaic(number: int) -> AnyShot:
    shot = stamped(number)
    images = {name: shot.images[name].astype(np.uint16) for name in ("red", "ir")}
    return BayerShot(images["red"], "rggb", images["ir"], 4095.0, stamp=shot.stamp)


def bases(folder: Path) -> list[Base]:
    with qf.open() as scanner:
        config, calibration = scanner.config, scanner.calibration
    made = []
    for make in (stamped, mosaic):
        shots = [make(number) for number in range(SHOTS)]
        path = folder / f"{make.__name__}.h5"
        with Recorder(path, config, calibration) as recorder:
            for shot in shots:
                recorder.write(shot)
        made.append(Base(path.read_bytes(), by_id(shots), config, calibration))
    shots = [stamped(number) for number in range(SHOTS)]
    with RecordingWriter(folder / "killed.h5", Header.of(shots[0], config, calibration)) as writer:
        for shot in shots:
            writer.append(shot)
        made.append(Base(writer.path.read_bytes(), by_id(shots), config, calibration, closed=False))
    with warnings.catch_warnings(action="ignore"), Recording(VERSION_1) as take:
        made.append(Base(VERSION_1.read_bytes(), by_id(list(take)), take.config, take.calibration, version=1))
    return made


def by_id(shots: list[AnyShot]) -> dict[int, AnyShot]:
    return {shot.stamp.id: shot for shot in shots if shot.stamp is not None}


# Ways to read a file: each returns the names of its faults


def read_all(path: Path, base: Base) -> list[str]:
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            with Recording(path) as take:
                shots = [take.read(index) for index in range(len(take))]
                faults = compare(take, [shot for shot in shots if shot is not None], base, warned=bool(warned))
                known = len(shots) >= len(base.shots) or bool(warned) or not base.closed
        except (qf.InputError, RecordingError):
            return []
    return faults if known else [*faults, "silent"]


def compare(take: Recording, shots: list[AnyShot], base: Base, *, warned: bool) -> list[str]:
    unverified = base.version == 1 and warned
    faults = [] if unverified or all(same(shot, base) for shot in shots) else ["wrong"]
    pixels = [[image.tobytes() for image in shot.images.values()] for shot in base.shots.values()]
    if any([image.tobytes() for image in shot.images.values()] not in pixels for shot in shots):
        faults.append("wrong")
    if unverified:
        return faults
    for number, time_us in zip(take.ids[take.stamped].tolist(), take.times_us[take.stamped].tolist(), strict=True):
        stamp = base.shots[number].stamp if number in base.shots else None
        if stamp is None or stamp.time_us != time_us:
            faults.append("wrong")
    for name in ("config", "calibration"):
        if getattr(take, name) not in (getattr(base, name), None) or (getattr(take, name) is None and not warned):
            faults.append("wrong")
    return faults


def same(shot: AnyShot, base: Base) -> bool:
    true = base.shots.get(shot.stamp.id) if shot.stamp else None
    return (
        true is not None
        and type(shot) is type(true)
        and (shot.stamp, shot.full_scale_value) == (true.stamp, true.full_scale_value)
        and all(np.array_equal(image, true.images[name]) for name, image in shot.images.items())
    )


def run(*words: object) -> Any:
    return CliRunner().invoke(app, [str(word) for word in words])


def traceback_in(result: Any) -> list[str]:
    known = result.exception is None or isinstance(result.exception, SystemExit)
    return [] if known and result.exit_code in (0, 1, 2) and "Traceback" not in result.output else ["traceback"]


def info(path: Path, base: Base) -> list[str]:
    """Describe the file; what is printed without a warning or an error must be the calibration recorded."""
    result = run("info", path, "--full")
    faults = traceback_in(result)
    if result.exit_code == 0 and not result.stderr and base.calibration is not None:
        printed = "".join(result.stdout.split())
        if "".join(base.calibration.model_dump_json(indent=2, exclude_none=True).split()) not in printed:
            faults.append("wrong")
    return faults


def verify(path: Path, base: Base) -> list[str]:
    """What passes must be as it was recorded."""
    result = run("info", path, "--verify")
    return traceback_in(result) + (read_all(path, base) if result.exit_code == 0 else [])


def recover(path: Path, base: Base) -> list[str]:
    whole = path.with_name("whole.h5")
    whole.unlink(missing_ok=True)
    result = run("recover", path, "--out", whole)
    faults = traceback_in(result)
    if result.exit_code == 0:
        with warnings.catch_warnings(action="ignore"), Recording(whole) as take:
            faults += compare(take, list(take), base, warned=bool(result.stderr))
    return faults


def replay(path: Path, base: Base) -> list[str]:
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            take = Recording(path)
        except (qf.InputError, RecordingError):
            return []
        with ReplayCamera(take, "full") as camera:
            shots: list[AnyShot] = []
            told = False
            try:
                shots.extend(camera.stream(keep="all"))
            except RecordingError:
                told = True
            counted = len(shots) + camera.statistics().damaged
            faults = compare(take, shots, base, warned=bool(warned))
    return faults if counted >= len(base.shots) or warned or told or not base.closed else [*faults, "silent"]


READERS: tuple[Callable[[Path, Base], list[str]], ...] = (read_all, info, verify, recover, replay)


def outcome(path: Path, base: Base, read: Callable[[Path, Base], list[str]]) -> tuple[set[str], float]:
    """Read a file in a child process; return the faults and the time in s."""
    receive, send = os.pipe()
    begin_s = time.monotonic()
    child = os.fork()
    if child == 0:
        try:
            faults = read(path, base)
        except Exception as error:  # noqa: BLE001 - counted
            faults = ["traceback"]
            print(f"{path.name}: {read.__name__}: {error!r}", file=sys.stderr)
        os.write(send, json.dumps(sorted(set(faults))).encode())
        os._exit(0)
    os.close(send)
    while not (ended := os.waitpid(child, os.WNOHANG))[0]:
        if time.monotonic() - begin_s > LIMIT_S:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            os.close(receive)
            return {"hang"}, LIMIT_S
        time.sleep(0.002)
    with os.fdopen(receive) as told:
        words = told.read()
    spent_s = time.monotonic() - begin_s
    return ({"crash"} if ended[1] or not words else set(json.loads(words))), spent_s


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--count", type=int, default=3000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    counts, longest_s = Counter(dict.fromkeys((*FAULTS, "repeated"), 0)), 0.0
    folder = Path(tempfile.mkdtemp())
    try:
        sound = bases(folder)
        for number in range(options.first, options.first + options.count):
            chance = random.Random(number)
            base, read = sound[number % len(sound)], READERS[number // len(sound) % len(READERS)]
            path = folder / "mutated.h5"
            path.write_bytes(mutated(base.data, chance))
            faults, spent_s = outcome(path, base, read)
            if "hang" in faults:
                counts["repeated"] += 1
                faults, spent_s = outcome(path, base, read)
            longest_s = max(longest_s, spent_s)
            counts.update(faults)
            if faults:
                print(f"{number}: {read.__name__}: {', '.join(sorted(faults))}", flush=True)
    finally:
        shutil.rmtree(folder)
    figures = {"mutated": options.count, **counts, "longest_s": round(longest_s, 2)}
    print("  ".join(f"{name} {value}" for name, value in figures.items()))
    if options.json:
        options.json.write_text(json.dumps({"figures": figures}))
    return int(any(counts[name] for name in FAULTS))


if __name__ == "__main__":
    sys.exit(main())
