"""Multiply every tuned number of the joint method by a half and by two, and list what changes.

    python evaluation/sensitivity.py [--only WORD ...] [--markdown FILE]

The kernel is compiled once, which needs cargo, from a copy of its sources in which the numbers are read when a process
starts. One process for each number and factor decodes the shots of `quadfringe.evaluation._sensitivity`: scenes of
`quadfringe.evaluation.world` with a seed for tuning, objects on black, and captures. Compared are the means of a group:
the RMS of the phase errors of right orders, the share of returned pixels, and the share of wrong orders in these. A
change is listed if it exceeds `LEAST` and what chance makes of that figure. Chance is measured: the greatest change of
the figure by a factor of `CHANCE` on any of `CHANCES` numbers. It takes three quarters of an hour on two cores.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from quadfringe.evaluation import _tunable as tunable
from quadfringe.evaluation._report import table
from quadfringe.evaluation._sensitivity import MOTION, Figures, figures_of, rows, shots

WORDS = """# Sensitivity of the tuned numbers

`python evaluation/sensitivity.py --markdown docs/method/sensitivity.md` measured and wrote this page. Every tuned
number of the joint method was multiplied by a half and by two; whole numbers are rounded up. What a larger and a
smaller value trade stands in the comment of the number. The table lists the changes that chance does not explain, at
most three for each factor: of the RMS phase error of a group of shots in percent of it, of its returned pixels and of
wrong orders among them in percentage points. "None" is no such change: the number is not critical in this range.
"Fails" means that a shot cannot be decoded. "Not varied" is the length of an array. Numbers of step 7 (motion) have
no shot here; `cargo test --test motion -- --nocapture` measures them. "Small" are white objects of one or two
fringes.

"""
TIMEOUT_S = 300.0


def measured(change: str, package: Path, given: Path) -> Figures | None:
    """Decode all shots in a process with a changed number; None if it fails, or does not end."""
    there = os.environ | {"PYTHONPATH": str(package), "RAYON_NUM_THREADS": "1", tunable.VARIABLE: change}
    command = [sys.executable, __file__, "--decode", given]
    try:
        done = subprocess.run(command, env=there, capture_output=True, text=True, check=True, timeout=TIMEOUT_S)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
        return None
    return {(group, figure): value for group, figure, value in json.loads(done.stdout)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="WORD", default=[""], help="numbers that contain one of the words")
    parser.add_argument("--markdown", type=Path, help="write the table here")
    parser.add_argument("--decode", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.decode:
        found = figures_of(pickle.loads(options.decode.read_bytes()))
        print(json.dumps([(*key, value) for key, value in found.items()]))
        return
    with TemporaryDirectory(prefix="quadfringe-") as name:
        given = Path(name) / "shots.pickle"
        given.write_bytes(pickle.dumps(list(shots())))
        measure = partial(measured, package=tunable.build(Path(name)), given=given)
        numbers = (number for number in tunable.numbers(tunable.PARAMS) if number.file != MOTION)
        chosen = (number for number in numbers if any(word in number.key for word in options.only))
        text = WORDS + table(("number", "value", "what it is", "half", "twice"), rows(chosen, measure))
    print(text)
    if options.markdown:
        options.markdown.write_text(text)


if __name__ == "__main__":
    main()
