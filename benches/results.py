"""Measure everything that benches/RESULTS.md says and write it; `make bench` runs this.

    python benches/results.py [--out FILE] [--skip NAME ...] [--repeats 20]

Runs `quadfringe bench --scaling`, benches/first_frame.py, benches/peers.py and benches/accuracy.py one after the other
and writes their numbers, with machine, commit and date. --skip goes to peers.py. Without the test data the rows of real
captures are missing, and the file says so.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from quadfringe.evaluation.machine import described
from quadfringe.files import atomic

HERE = Path(__file__).resolve().parent
Record = dict[str, Any]
METHODS = ("published", "best")


def measured(*command: str) -> Record:
    """Run a script for its figures; one that misses a bar of its own ends with 1 and has figures all the same."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figures.json"
        done = subprocess.run([sys.executable, *command, "--json", str(file)])
        if not file.is_file():
            raise SystemExit(f"{' '.join(command)}: no figures, exit status {done.returncode}")
        record: Record = json.loads(file.read_text())
    return record


def words(cell: object) -> str:
    if cell is None:
        return ""
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def table(head: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    rows = [head, ["---"] * len(head), *([words(cell) for cell in line] for line in lines)]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + "\n"


def columns(entries: list[Record], heads: dict[str, str]) -> str:
    """Give a table of some keys of records; the words of its head by key."""
    return table(list(heads.values()), ([entry.get(key) for key in heads] for entry in entries))


def head_of(machine: Record) -> str:
    date = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    lines = [(name, value) for name, value in (machine | {"date": date}).items() if value is not None]
    return (
        "# Results\n\nMeasured and written by `make bench` (benches/results.py); nothing here is typed by hand.\n\n"
        + table(("", ""), lines)
    )


def times(bench: Record, on_print: Record, first_frame: Record) -> str:
    case = {"method": "method", "threads": "threads", "width_px": "width", "height_px": "height"}
    spent = {"median_ms": "median ms", "minimum_ms": "minimum ms"}
    rest = {"verdict_ms": "of it verdict ms", "shots_per_s": "shots/s", "busy_cores": "busy cores"}
    grown = {"ns_per_pixel": "ns/pixel", "busy_cores": "busy cores", "repeats": "repeats"}
    line = {
        "method": "method",
        "fixed_ms": "every shot, ms",
        "ns_per_pixel": "a pixel, ns",
        "off_percent": "furthest from the line, %",
        "spread_percent": "dearest pixel over cheapest, all included, %",
    }
    weight = {"held_mb": "held, results included, MB"}
    return "\n".join(
        [
            "## Time of a decode\n",
            f"`quadfringe bench --scaling`: {bench['surface']}, 8 bit, {bench['noise']:.0%} noise, to X, Y, Z and the "
            "verdict. Busy cores well below the number of threads tell that the machine had other work.\n",
            columns(bench["timings"], case | spent | rest),
            f"First frame, from process start to X, Y, Z: {first_frame['figures']['first_frame_s']:.3g} s "
            "(`python benches/first_frame.py`).\n",
            f"The same with coloured squares of {on_print['patch_mm']:.0f} mm on it "
            f"(`quadfringe bench --patch-mm {on_print['patch_mm']:.0f}`):\n",
            columns(on_print["timings"], case | spent | rest),
            "## Memory of a decoder\n",
            columns(bench["memory"], case | weight),
            "The same with the coloured squares:\n",
            columns(on_print["memory"], case | weight),
            "## Cost against pixels\n",
            "The same field of view at every size, and the straight line through the times: what every shot costs "
            "whatever its size, what a pixel costs on top of it, and how far the furthest time is from that.\n",
            columns(bench["cost"], line),
            columns(bench["scaling"], case | spent | grown),
        ]
    )


def peers(found: Record) -> str:
    reference = found["reference"]
    heads = {
        "name": "who",
        "images": "images",
        "gives": "gives",
        "threads": "threads",
        "median_ms": "median ms",
        "minimum_ms": "minimum ms",
        f"times_as_fast_as_{reference}": f"times as fast as {reference}",
        "times_floor": "times the floor",
        "phase_rms_rad": "phase RMS, rad",
        "wrong_orders_percent": "wrong orders, %",
    }
    return "\n".join(
        [
            "## Peers\n",
            "`python benches/peers.py`: peaks, 1024 x 768, 8 bit, 3 % noise, all in turns in one run. They do not all "
            "do the same job; the head of the script says who does what. The floor is that of the same number of "
            "threads: the bytes and the row transforms alone.\n",
            columns(found["peers"], heads),
        ]
    )


def accuracy(found: Record) -> str:
    figures: dict[str, float] = found["figures"]
    names = dict.fromkeys(key.partition("_")[2] for key in figures)
    lines = [(name, *(figures.get(f"{method}_{name}") for method in METHODS)) for name in names]
    missing = "" if any("capture" in name for name in names) else "\nReal captures: no test data here.\n"
    return "\n".join(
        [
            "## Accuracy\n",
            "`python benches/accuracy.py`: its head says what each name means, benches/efficiency.py what the "
            "efficiency is.\n",
            table(("figure", *METHODS), lines) + missing,
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=HERE / "RESULTS.md")
    parser.add_argument("--skip", action="append", default=[], help="a peer to leave out; may be repeated")
    parser.add_argument("--repeats", type=int, default=20)
    options = parser.parse_args()
    head = head_of(described())
    skip = [part for name in options.skip for part in ("--skip", name)]
    repeats = ("--repeats", str(options.repeats))
    # Those that a wrong option or a missing peer can stop come first.
    beside = peers(measured(str(HERE / "peers.py"), *skip, *repeats))
    bench = ("-m", "quadfringe", "bench", *repeats)
    on_print = measured(*bench, "--patch-mm", "20")
    own = times(measured(*bench, "--scaling"), on_print, measured(str(HERE / "first_frame.py")))
    exact = accuracy(measured(str(HERE / "accuracy.py")))
    with atomic(options.out) as temporary:
        temporary.write_text("\n".join([head, own, beside, exact]))


if __name__ == "__main__":
    main()
