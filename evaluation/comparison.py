"""Causes that a comparison names, on shots with one fault each and on sound ones, as one table.

    python evaluation/comparison.py [--tune] [--scenes NAME ...] [--seeds N ...]

A shot with the fault is compared with one without it: other noise, the same scene. The limits of the comparison were
chosen with `--tune`, on half of the scenes and seeds; without it the other half reports.
"""

from __future__ import annotations

import argparse

from quadfringe.evaluation.comparing import CAUSES, REPORT, TUNE, Case, Half, compared, faults_of


def main() -> None:
    """Print one line for each pair, and the share of right names."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--tune", action="store_true", help="the half on which the limits were chosen")
    options.add_argument("--scenes", nargs="+", help="other scenes")
    options.add_argument("--seeds", type=int, nargs="+", help="other seeds")
    chosen = options.parse_args()
    half = TUNE if chosen.tune else REPORT
    half = Half(tuple(chosen.scenes or half.scenes), tuple(chosen.seeds or half.seeds))
    cases: dict[str, list[Case]] = {cause: [] for cause in CAUSES}
    print("cause      strength            scene         seed  named")
    for cause in CAUSES:
        for fault in faults_of(cause):
            for case in compared(fault, half):
                named = ", ".join(f"{one.name} {one.share:.2f} ({one.size:.3g})" for one in case.found.causes)
                mark = "" if case.right else "   WRONG"
                print(
                    f"{cause or 'none':10} {fault.strength:19} {case.scene:13} {case.seed:4}  {named}{mark}", flush=True
                )
                cases[cause].append(case)
    for cause, found in cases.items():
        right, alone = (sum(getattr(case, name) for case in found) for name in ("right", "alone"))
        print(f"{cause or 'none'}: {right} of {len(found)} right, {alone} of them alone")


if __name__ == "__main__":
    main()
