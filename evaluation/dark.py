"""Accuracy on dark surfaces, which a camera of 12 bits sees in a few of its steps, as one table.

    python evaluation/dark.py [--modulation-min SHARE]

The albedo of scenes of the virtual bench is multiplied by a share. Returned and wrong are shares of the lit pixels that
do not mix two sides of an edge; unlit is the share of the pixels in shadow that come back, which is always wrong.
"""

from __future__ import annotations

import argparse

import numpy as np

import quadfringe as qf
from quadfringe.evaluation._dark import dark
from quadfringe.evaluation.world import judge

# Scene, share of its albedo, noise as a share of full scale.
SHOTS = (
    ("steps", 0.04, 0.0005),
    ("steps", 0.04, 0.002),
    ("face", 0.02, 0.0005),
    ("face", 0.1, 0.005),
    ("clutter", 0.1, 0.0005),
    ("clutter", 0.1, 0.002),
    ("painted_face", 0.1, 0.001),
)
SEED = 2


def main() -> None:
    """Print depth RMS, returned, wrong and unlit pixels of each dark scene."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--modulation-min", type=float, metavar="SHARE", help="instead of the noise of the shot")
    least = parser.parse_args().modulation_min
    with qf.open(qf.SystemConfig()) as scanner:
        calibration = scanner.calibration
    print("scene         share of albedo  noise   rms_mm  returned_percent  wrong_percent  unlit_percent")
    for name, share, noise in SHOTS:
        take = dark(name, share, noise, SEED)
        plan = qf.Plan(
            calibration.projector.width_px,
            calibration=calibration,
            fringes=qf.Fringes(numbers=take.fringe_numbers),
            response="linear",
            decode=qf.DecodeConfig(modulation_min=least),
        )
        shape = qf.Decoder(take.shot, plan).decode_without_verdict(take.shot)
        returned = np.isfinite(shape.phase_rad)
        if not returned[take.counted].any():
            print(f"{name:13} {share:15.2f} {noise:6.4f} nothing returned")
            continue
        found = judge(shape, take)
        unlit = 100 * returned[~take.lit].mean() if (~take.lit).any() else 0.0
        print(
            f"{name:13} {share:15.2f} {noise:6.4f} {found.rms_mm:8.4f} {found.returned_percent:17.2f} "
            f"{found.wrong_percent:14.4f} {unlit:14.3f}"
        )


if __name__ == "__main__":
    main()
