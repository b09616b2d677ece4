"""Measure the figures in evaluation/RESULTS.md and write it; `make evaluation` runs this.

    python evaluation/results.py [--out FILE]

Runs evaluation/accuracy.py and evaluation/world.py and writes their figures, with machine, commit and date. Without the
test data the rows of real captures are missing, and the file says so.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from quadfringe.evaluation._report import accuracy_section, head_of, measured, world_section
from quadfringe.evaluation.machine import described
from quadfringe.files import atomic

HERE = Path(__file__).resolve().parent
HALF = "report"  # of the seeds: numbers of the methods are chosen on the other half


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=HERE / "RESULTS.md")
    options = parser.parse_args()
    head = head_of(described(), "make evaluation", "evaluation/results.py")
    sections = [
        accuracy_section(measured(str(HERE / "accuracy.py"))),
        world_section(measured(str(HERE / "world.py"), "--half", HALF), HALF),
    ]
    with atomic(options.out) as temporary:
        temporary.write_text("\n".join([head, *sections]))


if __name__ == "__main__":
    main()
