"""Measure how often the doctor names the cause of a planted fault first, and how often it finds fault with sound shots.

    python evaluation/diagnosis.py [--seed 7] [--only CAUSE ...] [--without-calibration] [--figures] [--json FILE]

Thirty shots of the virtual bench, 1024 x 768, have one fault each: ten causes of three strengths. Thirty shots have
none. The first finding that is not good counts. The numbers of the tests were chosen on seeds 1 to 4; report others.
With all causes and the calibration, the counts are held against their bars; the exit status is 1 when one is missed.
"""

from __future__ import annotations

import argparse
import sys
from itertools import chain
from pathlib import Path

import quadfringe as qf
from quadfringe.decoding import detail
from quadfringe.decoding.closures import closure_of
from quadfringe.doctor import Finding, examine_shot
from quadfringe.evaluation import broken
from quadfringe.evaluation._ledger import bars
from quadfringe.files import figures_text


def first(found: list[Finding]) -> Finding | None:
    """Give the first finding that is a warning or a fault; notes say what no shot can check."""
    return next((one for one in found if one.grade in ("warning", "fault")), None)


def named(case: broken.Case, plan: qf.Plan) -> tuple[bool, str]:
    """Tell whether the diagnosis of a case is right, and give it in words."""
    told = first(examine_shot(case.shot, plan))
    if told is None:
        return not case.cause, "nothing"
    return bool(case.cause) and case.names(told.name, told.found), f"{told.name}: {told.found}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--only", nargs="*", metavar="CAUSE", help="causes to plant; without a name, none")
    parser.add_argument("--without-calibration", action="store_true")
    parser.add_argument("--figures", action="store_true", help="print the figures that the tests limit")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    with qf.open() as scanner:
        calibration = scanner.calibration
        assert calibration is not None
    causes = tuple(broken.CAUSES) if options.only is None else tuple(options.only)
    right, alarms = 0, 0
    for case in chain(broken.broken(causes, options.seed), broken.sound()):
        plan = qf.Plan(912, calibration=None if options.without_calibration else broken.calibrated(case, calibration))
        good, words = named(case, plan)
        right += bool(case.cause) and good
        alarms += not case.cause and not good
        print(f"{'ok   ' if good else 'WRONG'} {case.cause or 'sound'}, {case.strength}, {case.scene}: {words[:160]}")
        if options.figures:
            print(f"      {closure_of(case.shot, plan)}, sharpness {detail.sharpness(case.shot):.2f}")
    print(f"{right} of {3 * len(causes)} causes are named first, {alarms} false alarms on sound shots")
    figures = {"causes_named_first": float(right), "false_alarms": float(alarms)}
    if options.json:
        options.json.write_text(figures_text(figures))
    limits = {name: bars()[f"diagnosis.{name}"] for name in figures}
    missed = [
        f"missed: {name} {figures[name]:g}, bar {bar.text}"
        for name, bar in limits.items()
        if not bar.holds(figures[name])
    ]
    if missed and options.only is None and not options.without_calibration:
        sys.exit("\n".join(missed))


if __name__ == "__main__":
    main()
