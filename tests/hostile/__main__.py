"""`python -m hostile` in the folder tests attacks the readers of files, and with `--shots N` the decoder.

A fault is printed with its kind and seed; `--kind K --seed N --count 1 --keep DIR` repeats it and keeps the file.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from hostile.files import KINDS, attack, originals
from hostile.shots import CASES, METHODS, hostile_shots


def attack_files(kinds: tuple[str, ...], seeds: range, keep: Path | None) -> int:
    """Print what became of damaged files; return the number of faults."""
    faults = 0
    with tempfile.TemporaryDirectory() as folder:
        made = originals(Path(folder))
        for kind in kinds:
            outcomes = list(attack(kind, made[kind], seeds, keep))
            counts = Counter(outcome.found for outcome in outcomes)
            print(f"{kind}: {len(outcomes)} damaged files: " + ", ".join(f"{n} {what}" for what, n in counts.items()))
            for outcome in (one for one in outcomes if one.fault):
                faults += 1
                print(f"  {outcome.found}: {outcome.name}, seed {outcome.seed}: {outcome.words}", flush=True)
    return faults


def attack_decoder(seeds: range) -> int:
    """Print what became of spoilt shots; return the number of faults."""
    faults = 0
    for case in CASES:
        for method in METHODS:
            outcomes = list(hostile_shots(case, method, seeds))
            counts = Counter(outcome.reason for outcome in outcomes)
            named, worst = sum(outcome.named for outcome in outcomes), max(outcome.wrong for outcome in outcomes)
            words = ", ".join(f"{n} {what}" for what, n in counts.items())
            print(f"{case}, {method}: {words}; cause named {named} times, wrong orders at most {worst:.2%}", flush=True)
            for outcome in (one for one in outcomes if one.fault):
                faults += 1
                print(
                    f"  {outcome.reason}, seed {outcome.seed}: {outcome.wrong:.2%} wrong: {outcome.words}", flush=True
                )
    return faults


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kind", choices=tuple(KINDS), action="append", help="default: all")
    options.add_argument("--count", type=int, default=1000, help="damaged files of each kind")
    options.add_argument("--shots", type=int, help="spoilt shots of each case, in place of files")
    options.add_argument("--seed", type=int, default=0, help="seed of the first one")
    options.add_argument("--keep", type=Path, help="folder that keeps the damaged files")
    given = options.parse_args()
    if given.shots is not None:
        return min(1, attack_decoder(range(given.seed, given.seed + given.shots)))
    kinds = tuple(given.kind or KINDS)
    return min(1, attack_files(kinds, range(given.seed, given.seed + given.count), given.keep))


if __name__ == "__main__":
    sys.exit(main())
