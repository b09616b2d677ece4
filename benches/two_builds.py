"""Time of a decode by this build against another one, in one run: the ratio of both, and whether they give the same.

    python benches/two_builds.py OTHER_PYTHON [--turns 15] [--threads 2]

OTHER_PYTHON is the interpreter of an environment in which the other build is installed. Each build has one process, and
both decode the same shots of the virtual bench (1024 x 768, 8 bit, 3 % noise, to X, Y, Z). They take turns, and the
order changes with every turn, so that other load on the machine affects both. For each scene and method the script
prints the median and the minimum of each build, and the ratio of this build to the other: the median over the turns,
and the middle half of the turns as its spread. Builds that call the joint method "best" are understood.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import zlib
from contextlib import suppress
from functools import partial
from itertools import chain, product
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import numpy as np

PLAIN = ("steps", "face", "peaks")
SCENES: dict[str, Any] = {"textured": {"surface": "peaks", "patch_mm": 20.0}} | {n: {"surface": n} for n in PLAIN}
METHODS = {"published": ("published",), "joint": ("joint", "best")}  # with their names in older builds
NUMBERS, WIDTH_PX = (36.0, 35.0, 30.0), 912
DECODES = 8  # timed in a turn


def render(folder: Path) -> None:
    import quadfringe as qf

    for name, scene in SCENES.items():
        with qf.open(qf.SystemConfig(scene=qf.SceneConfig(**scene, noise=0.03))) as scanner:
            np.save(folder / f"{name}.npy", np.stack(list(scanner.grab().channels.values())))


def planned(shape: tuple[int, int], names: tuple[str, ...], threads: int) -> Any:
    from quadfringe import _core

    bench = _core.Bench()
    settings = {"camera": bench.camera, "projector": bench.visible, "threads": threads}
    for name in names[:-1]:
        with suppress(ValueError):
            return _core.Decoder(shape, NUMBERS, WIDTH_PX, method=name, **settings)
    return _core.Decoder(shape, NUMBERS, WIDTH_PX, method=names[-1], **settings)


def work(folder: Path, threads: int) -> None:
    """Answer each line "scene method" with the times of decodes, ms, and a checksum of all maps."""
    shots = {name: list(np.load(folder / f"{name}.npy")) for name in SCENES}
    shape = shots["peaks"][0].shape
    decoders = {method: planned(shape, names, threads) for method, names in METHODS.items()}
    for line in sys.stdin:
        scene, method = line.split()
        decoder, shot, spent_ms = decoders[method], shots[scene], []
        maps = decoder.decode(*shot)  # warms up
        for _ in range(DECODES):
            start = time.perf_counter()
            maps = decoder.decode(*shot)
            spent_ms.append(1e3 * (time.perf_counter() - start))
        checksum = 0
        for _, values in sorted(maps.items()):
            checksum = zlib.crc32(np.ascontiguousarray(values), checksum)
        print(json.dumps([spent_ms, checksum]), flush=True)


def ask(build: subprocess.Popen[str], scene: str, method: str) -> tuple[list[float], int]:
    assert build.stdout
    print(scene, method, file=build.stdin, flush=True)
    return json.loads(build.stdout.readline() or sys.exit(f"{build.args}: ended early"))


def compare(builds: tuple[subprocess.Popen[str], ...], scene: str, method: str, turns: int) -> str:
    """Give the line of the table for this build, the first, and the other one."""
    spent_ms: tuple[list[list[float]], ...] = ([], [])
    checksums = set()
    for turn in range(turns):
        for at in (0, 1) if turn % 2 else (1, 0):
            times, checksum = ask(builds[at], scene, method)
            spent_ms[at].append(times)
            checksums.add(checksum)
    figures_ms = [[median(chain(*spent)), min(chain(*spent))] for spent in spent_ms]
    low, ratio, high = quantiles(median(this) / median(other) for this, other in zip(*spent_ms, strict=True))
    shown = "".join(f"{ms:10.2f}" for ms in chain(*figures_ms)) + f"{ratio:8.3f}  {low:.3f} to {high:.3f}"
    return f"{method:10}{scene:9}{shown}  {'same' if len(checksums) == 1 else 'differs'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("other", metavar="OTHER_PYTHON", help="interpreter with the other build")
    parser.add_argument("--turns", type=int, default=15)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--work", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        work(options.work, options.threads)
        return
    with tempfile.TemporaryDirectory() as name:
        render(Path(name))
        command = [__file__, "-", "--work", name, f"--threads={options.threads}"]
        elsewhere = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        piped = partial(subprocess.Popen, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        with piped([sys.executable, *command]) as this, piped([options.other, *command], env=elsewhere) as other:
            print(f"{'ms':19}{'this':>10}{'minimum':>10}{'other':>10}{'minimum':>10}   ratio  middle half     maps")
            for method, scene in product(METHODS, SCENES):
                print(compare((this, other), scene, method, options.turns), flush=True)


if __name__ == "__main__":
    main()
