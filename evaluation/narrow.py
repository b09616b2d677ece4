"""Count sound objects on black with which the doctor finds fault, and those whose crosstalk it names.

    python evaluation/narrow.py [--seeds 61 62 63] [--scene-seed 31]

Objects of 4 to 20 % of the frame are cut out of four scenes: sound ones, and with a fifth of the light of infrared in
green or of green in red. Across them 36, 35 and 30 fringes are nearly alike.
"""

from __future__ import annotations

import argparse
from collections import Counter
from itertools import product

import quadfringe as qf
from quadfringe.doctor import examine_shot
from quadfringe.evaluation import broken

SCENES = ("face", "sphere", "painted_face", "peaks")
FILLS = (0.04, 0.06, 0.08, 0.12, 0.2)
KINDS: dict[str, dict[tuple[int, int], float]] = {
    "sound": {},
    "infrared in green": {(1, 3): 0.2},
    "green in red": {(0, 1): 0.2},
}


def counts(shot: qf.Shot, plan: qf.Plan) -> dict[str, bool]:
    """List what the doctor reports for a shot."""
    found = examine_shot(shot, plan)
    grade = next((one.grade for one in found if one.name == "crosstalk"), "")
    return {
        "shots": True,
        "with a fault": any(one.grade == "fault" for one in found),
        "with crosstalk named": grade in ("warning", "fault"),
        "whose crosstalk cannot be measured": grade in ("", "note"),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seeds", type=int, nargs="*", default=[61, 62, 63])
    parser.add_argument("--scene-seed", type=int, default=31)
    options = parser.parse_args()
    with qf.open() as scanner:
        plan = qf.Plan(912, calibration=scanner.calibration)
    for kind, pairs in KINDS.items():
        total: Counter[str] = Counter()
        for scene in SCENES:
            shot = broken.exposed(scene, options.scene_seed, broken.Fault(kind, broken.stray(pairs)))
            for fill, seed in product(FILLS, options.seeds):
                total.update(counts(broken.cut_out(shot, fill, seed), plan))
        print(f"{kind}: " + ", ".join(f"{count} {name}" for name, count in total.items()))


if __name__ == "__main__":
    main()
