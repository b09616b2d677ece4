"""Recordings for tests of losses: shots that carry their number in every pixel, and writers that are killed."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from quadfringe.data import AnyShot, Shot

HEIGHT_PX, WIDTH_PX = 64, 96

WRITER = """
import resource, signal, sys
from quadfringe.evaluation._takes import numbered_shot
from quadfringe.recording import RecordingWriter
from quadfringe.recording._layout import Header
path, limit, height, width = sys.argv[1], *map(int, sys.argv[2:])
if limit:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
shots = [numbered_shot(number, (height, width)) for number in range(16)]
with RecordingWriter(path, Header.of(shots[0], None, None)) as writer:
    for number in range(100_000):
        writer.append(shots[number % 16])
        print(writer.written, flush=True)
"""


def numbered_shot(number: int, shape: tuple[int, int] = (HEIGHT_PX, WIDTH_PX)) -> AnyShot:
    """Give a shot in which every pixel depends on the number, modulo sixteen."""
    ramp = (np.arange(shape[0] * shape[1]) % 239).reshape(shape)
    red, green, blue, ir = ((ramp + 16 * channel + number % 16).astype(np.uint8) for channel in range(4))
    return Shot(red, green, blue, ir)


def whole(shot: AnyShot, number: int) -> bool:
    """Tell whether this is the shot of that number, to the last byte."""
    expected = numbered_shot(number, shot.images["ir"].shape).images
    return all(np.array_equal(image, expected[name]) for name, image in shot.images.items())


def start_writer(
    path: Path, limit_bytes: int = 0, shape: tuple[int, int] = (HEIGHT_PX, WIDTH_PX)
) -> subprocess.Popen[str]:
    """Start a process that writes shots and prints how many it has reported as written."""
    command = [sys.executable, "-c", WRITER, str(path), str(limit_bytes), *map(str, shape)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def kill_writer(path: Path, after_s: float, shape: tuple[int, int] = (HEIGHT_PX, WIDTH_PX)) -> int:
    """Kill a writer with SIGKILL some time after its first shot; give the number of shots that it reported."""
    return kill_reporting(start_writer(path, shape=shape), after_s)


def kill_reporting(process: subprocess.Popen[str], after_s: float) -> int:
    """Kill a process that prints its number of shots line by line; give the last number that it printed."""
    with process as writer:
        assert writer.stdout is not None
        first = writer.stdout.readline()
        time.sleep(after_s)
        writer.kill()
        return int(([first, *writer.stdout.read().splitlines(keepends=True)][-1:] or ["0"])[0])


def run_with_file_limit(path: Path, limit_bytes: int) -> tuple[int, str]:
    """Write until the file reaches this size and the system refuses more; give the number of shots, and the error."""
    with start_writer(path, limit_bytes) as writer:
        out, reason = writer.communicate(timeout=120)
    return int(out.split()[-1]), reason
