"""Takes for tests and benches: shots that tell their number everywhere, and writers that die."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from quadfringe.data import AnyShot, Shot

HERE = Path(__file__).resolve().parent
HEIGHT_PX, WIDTH_PX = 64, 96

WRITER = """
import resource, signal, sys
sys.path.insert(0, sys.argv[1])
from takes import numbered_shot
from quadfringe.recording import RecordingWriter
from quadfringe.recording._layout import Header
path, limit, height, width = sys.argv[2], *map(int, sys.argv[3:])
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
    """A shot whose every pixel depends on its number (of sixteen)."""
    ramp = (np.arange(shape[0] * shape[1]) % 239).reshape(shape)
    return Shot(*((ramp + 16 * channel + number % 16).astype(np.uint8) for channel in range(4)))


def whole(shot: AnyShot, number: int) -> bool:
    """Whether this is, to the last byte, the shot of this number."""
    expected = numbered_shot(number, shot.images["ir"].shape).images  # type: ignore[arg-type]
    return all(np.array_equal(image, expected[name]) for name, image in shot.images.items())


def start_writer(
    path: Path, limit_bytes: int = 0, shape: tuple[int, int] = (HEIGHT_PX, WIDTH_PX)
) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", WRITER, str(HERE), str(path), str(limit_bytes), *map(str, shape)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def kill_writer(path: Path, after_s: float, shape: tuple[int, int] = (HEIGHT_PX, WIDTH_PX)) -> int:
    """Start a writer, kill it with SIGKILL some time after its first shot; returns the shots that it reported."""
    with start_writer(path, shape=shape) as writer:
        assert writer.stdout is not None
        first = writer.stdout.readline()
        time.sleep(after_s)
        writer.kill()
        return int(([first, *writer.stdout.read().splitlines(keepends=True)][-1:] or ["0"])[0])


def run_with_file_limit(path: Path, limit_bytes: int) -> tuple[int, str]:
    """Write until the system refuses at this file size; returns the shots that were reported, and the error."""
    with start_writer(path, limit_bytes) as writer:
        out, reason = writer.communicate(timeout=120)
    return int(out.split()[-1]), reason
