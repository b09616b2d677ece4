"""Time of a mesh and of normals against that of a joint decode of the same shot, in one run.

    python benches/mesh.py [--json FILE] [--repeats 15] [--surface face]

1024 x 768 px, 8 bit, 3 % noise, on all cores. The three take turns, so that other load on the machine affects all of
them; the median counts. Ends with status 1 when a mesh takes longer than a decode.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import quadfringe as qf
from quadfringe.files import figures_text


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    arguments.add_argument("--json", type=Path)
    arguments.add_argument("--repeats", type=int, default=15)
    arguments.add_argument("--surface", default="face")
    given = arguments.parse_args()
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface=given.surface, noise=0.03))) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
        work: dict[str, Callable[[], object]] = {
            "decode": lambda: scanner.decode(shot),
            "mesh": shape.mesh,
            "normals": shape.normals,
        }
        times_ms: dict[str, list[float]] = {name: [] for name in work}
        for _ in range(given.repeats):
            for name, run in work.items():
                start = time.perf_counter()
                run()
                times_ms[name].append(1e3 * (time.perf_counter() - start))
    figures = {f"{name}_ms": float(np.median(times)) for name, times in times_ms.items()}
    figures["mesh_over_decode"] = figures["mesh_ms"] / figures["decode_ms"]
    print(shape.mesh(), ", ".join(f"{name} {value:.3g}" for name, value in figures.items()))
    if given.json:
        given.json.write_text(figures_text(figures))
    if figures["mesh_over_decode"] > 1:
        raise SystemExit("a mesh takes longer than a decode")


if __name__ == "__main__":
    main()
