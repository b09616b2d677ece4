"""Kill writers and batches with SIGKILL at random times; count what is lost, wrong or left.

    python tests/hostile/kills.py [--kills 50] [--only record live parent worker helper terminated] [--json FILE]

record      a process that writes shots and reports each; every reported shot must be on file to the last byte, and
            must be found by `recover`
live        the same of a process that measures, records and shows its shots in the live page
parent      `quadfringe batch`, whose process is killed; the same command must end with the files of an undisturbed run
worker      `quadfringe batch`, one of whose workers is killed; the run must end with the files of an undisturbed run
helper      `quadfringe batch`, whose helper processes that read recordings are killed; as worker
terminated  as parent, with SIGTERM; a fifth as often

A run that ends before it is killed does not count, and another one takes its place. A process of a batch or of the live
view that lives 5 s after the end of its parent counts as left. The exit status is 1 if anything is lost, wrong or left,
or if fewer were killed than asked for.
"""

from __future__ import annotations

import argparse
import filecmp
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

import quadfringe as qf
from quadfringe.data import Shot
from quadfringe.evaluation._takes import kill_reporting, start_writer, whole
from quadfringe.recording import Recorder, Recording, recover

LEFT_S = 5.0
END_S = 300.0  # limit for one run of a batch
WHOM = ("record", "live", "parent", "worker", "helper", "terminated")
COMMANDS = {"worker": b"spawn_main", "helper": b"io.bounded import serve"}  # in the command line of those processes
MARK = "QUADFRINGE_KILLS"  # in the environment of what is killed and of all processes that it starts
SYSTEM = qf.SystemConfig(
    camera=qf.Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5)),
    scene=qf.SceneConfig(surface="steps", noise=0.01),
    decode=qf.DecodeConfig(method="published"),
)
SHOTS = 6


def start_live(path: Path) -> subprocess.Popen[str]:
    """Start a measurement with recording and view, which prints how many shots it has reported as written."""
    command = [sys.executable, str(Path(__file__).with_name("live_writer.py")), str(path)]
    return subprocess.Popen(command, env=os.environ | {MARK: str(path)}, stdout=subprocess.PIPE, text=True)


WRITERS: dict[str, Callable[[Path], subprocess.Popen[str]]] = {"record": start_writer, "live": start_live}


def writers_killed(folder: Path, who: str, kills: int, chance: random.Random) -> Counter[str]:
    counts: Counter[str] = Counter()
    for number in range(kills):
        path, rescued = folder / f"kill{number}.h5", folder / f"whole{number}.h5"
        reported = kill_reporting(WRITERS[who](path), chance.uniform(0.0, 0.5))
        counts["processes_left"] += left(path)
        with Recording(path) as take:
            found = [take.read(index) for index in range(len(take))]
        recovered = recover(path, rescued)
        counts[f"{who}_shots_reported"] += reported
        counts[f"{who}_lost"] += max(0, reported - min(len(found), recovered.shots))
        counts[f"{who}_wrong"] += sum(shot is None or not whole(shot, index) for index, shot in enumerate(found))
        with Recording(rescued) as take:
            counts[f"{who}_wrong"] += sum(not whole(shot, index) for index, shot in enumerate(take))
        path.unlink()
        rescued.unlink()
    return counts


def noisy_take(path: Path) -> Path:
    noise = np.random.default_rng(5)
    with qf.open(SYSTEM) as scanner, Recorder(path, scanner.config, scanner.calibration) as recorder:
        shot = scanner.grab()
        for _ in range(SHOTS):
            images = {n: (i // 2 + noise.integers(0, 3, i.shape)).astype(np.uint8) for n, i in shot.images.items()}
            recorder.write(Shot(**images))
    return path


def start_batch(take: Path, out: Path, workers: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "quadfringe", "batch", str(take), "--out", str(out), "--workers", str(workers)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(command, env=os.environ | {MARK: str(out)}, start_new_session=True, **quiet)


def batch_killed(batch: subprocess.Popen[bytes], out: Path, who: str, chance: random.Random) -> tuple[bool, int]:
    """Kill a batch while it works; return whether it was still at work, and how many processes are left."""
    at = chance.randrange(SHOTS)
    with batch:
        end_s = time.monotonic() + END_S
        while batch.poll() is None and time.monotonic() < end_s and len(list((out / "take").glob("shot_*.ply"))) < at:
            time.sleep(0.005)
        time.sleep(chance.uniform(0.0, 0.2))
        working = batch.poll() is None
        if who in COMMANDS:
            found = sorted(children_of(batch.pid, out, COMMANDS[who])) if working else []
            chosen = found if who == "helper" else found[:1]
            for child in chosen:
                os.kill(child, signal.SIGKILL)
            batch.wait(END_S)
            working = bool(chosen)
        else:
            batch.send_signal(signal.SIGTERM if who == "terminated" else signal.SIGKILL)
    return working, left(out)


def children_of(parent: int, out: Path, command: bytes) -> list[int]:
    words = {}
    for pid in processes(out):
        with suppress(OSError):  # it has ended
            words[pid] = Path(f"/proc/{pid}/cmdline").read_bytes()
    return [pid for pid, line in words.items() if pid != parent and command in line]


def processes(out: Path) -> list[int]:
    """Return the processes that a batch into this folder started, and itself."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            marked = f"{MARK}={out}\0".encode() in (entry / "environ").read_bytes()
        except OSError:  # it has ended, or belongs to somebody else
            continue
        if marked and int(entry.name) != os.getpid():
            found.append(int(entry.name))
    return found


def left(out: Path) -> int:
    end_s = time.monotonic() + LEFT_S
    while (alive := processes(out)) and time.monotonic() < end_s:
        time.sleep(0.02)
    for process in alive:
        os.kill(process, signal.SIGKILL)
    return len(alive)


def differing(out: Path, whole_out: Path) -> int:
    files = {path.relative_to(folder) for folder in (out, whole_out) for path in folder.rglob("*") if path.is_file()}
    return sum(
        not ((out / f).is_file() and (whole_out / f).is_file() and filecmp.cmp(out / f, whole_out / f, shallow=False))
        for f in files
    )


def batches_killed(folder: Path, whom: list[str], kills: int, chance: random.Random) -> Counter[str]:
    counts: Counter[str] = Counter()
    take, undisturbed = noisy_take(folder / "take.h5"), folder / "undisturbed"
    assert start_batch(take, undisturbed, 2).wait(END_S) == 0
    for who in whom:
        wanted, number = -(-kills // 5) if who == "terminated" else kills, 0
        while counts[f"{who}_killed"] < wanted and number < 10 * wanted:
            number += 1
            out, workers = folder / f"{who}{number}", 1 + number % 2
            killed, alive = batch_killed(start_batch(take, out, workers), out, who, chance)
            counts[f"{who}_killed"] += killed
            if who not in COMMANDS:
                assert start_batch(take, out, workers).wait(END_S) == 0
            differ = differing(out, undisturbed)
            print(f"{who} {number}: {alive} processes left, {differ} files differ", file=sys.stderr, flush=True)
            counts["processes_left"] += alive
            counts[f"{who}_files_that_differ"] += differ
            shutil.rmtree(out)
    return counts


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--only", nargs="+", choices=WHOM, default=WHOM)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    chance = random.Random(1)
    folder = Path(tempfile.mkdtemp())
    try:
        counts: Counter[str] = Counter()
        for who in (who for who in WRITERS if who in options.only):
            counts.update(writers_killed(folder, who, options.kills, chance))
        if whom := [who for who in options.only if who not in WRITERS]:
            counts.update(batches_killed(folder, whom, options.kills, chance))
    finally:
        shutil.rmtree(folder)
    names = tuple(f"{who}_{what}" for who in WRITERS for what in ("shots_reported", "lost", "wrong"))
    batches = [who for who in WHOM if who not in WRITERS]
    names += (*(f"{who}_killed" for who in batches), *(f"{who}_files_that_differ" for who in batches), "processes_left")
    figures = {"kills_of_each": options.kills, **{name: counts[name] for name in names}}
    for name, value in figures.items():
        print(f"{name:32}{value:8}")
    if options.json:
        options.json.write_text(json.dumps({"figures": figures}))
    fewer = any(counts[f"{who}_killed"] < (options.kills + 4) // 5 for who in options.only if who not in WRITERS)
    return int(fewer or any(v for name, v in figures.items() if name.endswith(("lost", "wrong", "differ", "left"))))


if __name__ == "__main__":
    sys.exit(main())
