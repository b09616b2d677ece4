"""Times and phase errors of quadfringe, of other packages, and of the floor below them, in one run.

    python benches/peers.py [--json FILE] [--repeats 11] [--skip NAME ...]

Scene: peaks on the virtual bench, 1024 x 768, 8 bit, 3 % noise. All contenders take turns; in each turn several runs
precede the timed one. They do not all do the same job, and the table states their inputs and results:

- quadfringe and the published chain in plain NumPy: one shot of four images to absolute phase and X, Y, Z; quadfringe
  through Python, with new maps and a verdict on every shot.
- floor, and kernel: the compiled bench `floor` (crates/quadfringe/benches/floor.rs) on the same shot: the bytes and the
  row transforms without a decoder, and both methods into existing maps, without Python.
- OpenCV structured_light: wrapped phase alone, from one image (FTP) or three (PSP). Its sign and constant offset are
  corrected; its patterns have a whole number of pixels per period, so the bench shows the fringes instead.
- scikit-image unwrap_phase: the wrapped two-step phase to one without jumps; relative, without holes or steps.
- reference, the same likelihood in plain NumPy, and Fringes: the same twelve images, 36, 35 and 30 fringes in four
  steps each, to the projector column; the reference with uncertainty and the probability of a wrong order too.

Errors are RMS in rad of the 36-fringe phase over pixels a fringe away from edges, border and shadow; a wrong order is
an error beyond pi. For a wrapped phase whole periods are left out. A package that is not installed is an error; --skip
leaves it out.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import step_contenders as many
from contenders import (
    NOISE,
    SURFACE,
    Bench,
    Contender,
    bench_shot,
    floor,
    opencv,
    plain_numpy,
    product,
    scikit_image,
)

from quadfringe.evaluation import scoring
from quadfringe.evaluation.machine import described

REFERENCE = "numpy_float64"
SKIPPABLE = ("floor", "opencv", "scikit-image", "fringes")


def judged(contender: Contender, bench: Bench) -> dict[str, float]:
    """Give the phase errors of the inner pixels; none for a contender that returns no phase."""
    if contender.phase_rad is None:
        return {}
    phase_rad, truth_rad = contender.phase_rad()[bench.inner], bench.scene.phase_rad[bench.inner]
    return scoring.phase_errors(phase_rad, truth_rad, contender.kind)


def times_ms(contenders: list[Contender], repeats: int) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Give the first turn of each, in which some compile or plan, and those that count."""
    first: dict[str, float] = {}
    spent: dict[str, list[float]] = {contender.name: [] for contender in contenders}
    for contender in contenders:
        start = time.perf_counter()
        contender.turn()
        first[contender.name] = 1e3 * (time.perf_counter() - start)
    for _ in range(repeats):
        for contender in contenders:
            spent[contender.name].append(contender.turn())
    return first, spent


def records(contenders: list[Contender], bench: Bench, repeats: int) -> list[dict[str, Any]]:
    first, spent = times_ms(contenders, repeats)
    median = {name: float(np.median(values)) for name, values in spent.items()}
    found = []
    for contender in contenders:
        floor_ms = median.get(f"floor_{contender.threads}_threads")
        entry = {
            "name": contender.name,
            "images": contender.images,
            "gives": contender.gives,
            "threads": contender.threads,
            "median_ms": median[contender.name],
            "minimum_ms": min(spent[contender.name]),
            "first_two_runs_ms": first[contender.name],
            f"times_as_fast_as_{REFERENCE}": median[REFERENCE] / median[contender.name],
            "times_floor": None if floor_ms is None else median[contender.name] / floor_ms,
        }
        found.append(entry | judged(contender, bench))
    return found


def figures(found: list[dict[str, Any]]) -> dict[str, float]:
    """Give every number by the name of its contender, for the figures of the documents."""
    return {
        f"{entry['name']}_{key}": value
        for entry in found
        for key, value in entry.items()
        if isinstance(value, float) and key != "first_two_runs_ms"
    }


def show(found: list[dict[str, Any]]) -> None:
    columns = {
        "median_ms": "ms",
        "minimum_ms": "min ms",
        f"times_as_fast_as_{REFERENCE}": "x NumPy",
        "times_floor": "x floor",
        "phase_rms_rad": "rad",
        "wrong_orders_percent": "wrong %",
    }
    print(f"{'':28}{'images':>15}{'gives':>16}{'threads':>9}" + "".join(f"{word:>9}" for word in columns.values()))
    for entry in found:
        cells = [entry.get(key) for key in columns]
        numbers = "".join(f"{'' if cell is None else f'{cell:.4g}':>9}" for cell in cells)
        print(f"{entry['name']:28}{entry['images']:>15}{entry['gives']:>16}{entry['threads']:9}{numbers}")


def peers(bench: Bench, skip: list[str], stack: ExitStack) -> list[Contender]:
    stacks = many.step_stacks(bench)
    makers: dict[str, Callable[[], list[Contender]]] = {
        "floor": lambda: floor(stack),
        "opencv": lambda: opencv(bench),
        "scikit-image": lambda: scikit_image(bench),
        "fringes": lambda: many.fringes(bench, stacks),
    }
    found = [*many.reference(bench, stacks), many.numpy_steps(bench, stacks)]
    for name, make in makers.items():
        if name in skip:
            continue
        try:
            found += make()
        except (ImportError, FileNotFoundError) as error:
            raise SystemExit(f"{name}: {error}; install it by `make peers` (floor: Rust), or --skip {name}") from error
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--repeats", type=int, default=11)
    parser.add_argument("--skip", choices=SKIPPABLE, action="append", default=[], help="leave out; may be repeated")
    options = parser.parse_args()
    bench = bench_shot()
    with ExitStack() as stack:
        contenders = [*plain_numpy(bench), *product(bench), *peers(bench, options.skip, stack)]
        found = records(contenders, bench, options.repeats)
    print(f"{SURFACE}, {bench.shot.red.shape[1]} x {bench.shot.red.shape[0]}, 8 bit, {NOISE:.0%} noise")
    show(found)
    if options.json:
        record = {"machine": described(), "reference": REFERENCE, "peers": found, "figures": figures(found)}
        options.json.write_text(json.dumps(record, indent=2) + "\n")


if __name__ == "__main__":
    sys.exit(main())
