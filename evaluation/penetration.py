"""Measure the stated uncertainty on materials that green and infrared light penetrate deeper than red and blue.

    python evaluation/penetration.py [--seed 2] [--json FILE]

The offset grows from shot to shot, in a spot of 140 px and everywhere. Stated: RMS of the stated standard deviation of
the phase; inside: share of the errors within one. An offset by what one order makes of green and infrared is the same
light as another order.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from quadfringe.evaluation.penetration import GREEN_AND_IR, ONE_ORDER, judged
from quadfringe.files import figures_text

SCALES = (0.0, 0.25, 0.5, 1.0, 2.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    cases = {f"{scale:g}": tuple(scale * one for one in GREEN_AND_IR) for scale in SCALES} | {"one order": ONE_ORDER}
    figures: dict[str, float] = {}
    print(f"{'':26}{'returned %':>11}{'wrong %':>9}{'RMS rad':>9}{'stated':>9}{'inside':>8}  reasons, %")
    for everywhere in (False, True):
        for surface in ("face", "peaks"):
            for name, offsets in cases.items():
                a, b, c, d = offsets
                one = judged(surface, (a, b, c, d), options.seed, everywhere=everywhere)
                label = f"{surface}{', everywhere' if everywhere else ''}, {name}"
                listed = ", ".join(f"{reason} {share:.1f}" for reason, share in one.reasons.items())
                print(
                    f"{label:26}{one.returned:11.1f}{one.wrong:9.1f}{one.rms_rad:9.4f}{one.stated_rad:9.4f}"
                    f"{one.inside:8.2f}  {listed}"
                )
                key = label.replace(", ", "_").replace(" ", "_")
                figures |= {f"{key}_rms_rad": one.rms_rad, f"{key}_stated_rad": one.stated_rad}
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
