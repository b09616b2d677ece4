"""Measure the times in benches/RESULTS.md and write it; `make bench` runs this.

    python benches/results.py [--out FILE] [--skip NAME ...] [--repeats 20]

Runs `quadfringe bench --scaling`, benches/first_frame.py and benches/peers.py one after the other and writes their
figures, with machine, commit and date. --skip goes to peers.py.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from quadfringe.evaluation._report import Record, columns, head_of, measured
from quadfringe.evaluation.machine import described
from quadfringe.files import atomic

HERE = Path(__file__).resolve().parent


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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=HERE / "RESULTS.md")
    parser.add_argument("--skip", action="append", default=[], help="a peer to leave out; may be repeated")
    parser.add_argument("--repeats", type=int, default=20)
    options = parser.parse_args()
    head = head_of(described(), "make bench", "benches/results.py")
    skip = [part for name in options.skip for part in ("--skip", name)]
    repeats = ("--repeats", str(options.repeats))
    # The script that a wrong option or a missing package can stop runs first.
    others = peers(measured(str(HERE / "peers.py"), *skip, *repeats))
    bench = ("-m", "quadfringe", "bench", *repeats)
    on_print = measured(*bench, "--patch-mm", "20")
    own = times(measured(*bench, "--scaling"), on_print, measured(str(HERE / "first_frame.py")))
    with atomic(options.out) as temporary:
        temporary.write_text("\n".join([head, own, others]))


if __name__ == "__main__":
    main()
