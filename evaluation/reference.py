"""Measure the reference measurement: orders on the captures, and noise on the virtual bench against its least value.

    python evaluation/reference.py [--data FOLDER] [--json FILE]

Tune on the plate, report the bottle. Figures: docs of quadfringe.evaluation.reference.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import reference
from quadfringe.files import figures_text

BENCH = [("peaks", 12, 0.01), ("peaks", 4, 0.03), ("steps", 12, 0.01), ("face", 8, 0.02)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--data", type=Path, default=scenes.data_folder())
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    figures: dict[str, float] = {}
    found = {name: reference.capture_figures(options.data, name) for name in scenes.CAPTURES}
    for surface, steps, noise in BENCH:
        found[f"{surface}_{steps}_steps"] = reference.virtual_figures(surface, steps, noise, seed=1)
    for label, values in found.items():
        print(f"{label}: " + ", ".join(f"{name} {value:.5g}" for name, value in values.items()), flush=True)
        figures |= {f"{label}_{name}": value for name, value in values.items()}
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
