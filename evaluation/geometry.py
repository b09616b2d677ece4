"""Measure which wrong calibrations and moved images are warned of, and what is said of the others.

    python evaluation/geometry.py [--seed 1] [--calibrated] [--close] [--json FILE]

Four scenes are decoded with the calibration of their bench, and with twelve that contradict it. With a wide camera the
upper and the lower border of the projected light are in view; with --close they are not. With --calibrated, the
calibration records the depths of its boards.
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import numpy as np

import quadfringe as qf
from quadfringe.data import AnyShot, Calibration, Shape
from quadfringe.evaluation.wrong_geometry import CLOSE, FAULTS, WIDE, exposed, with_boards
from quadfringe.files import figures_text


def decoded(shot: AnyShot, calibration: Calibration) -> Shape | str:
    """Give the shape, or the words of the refusal."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", qf.DecodeWarning)
            return qf.decode(shot, qf.Plan(912, calibration=calibration))
    except qf.DecodeError as error:
        return str(error)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--calibrated", action="store_true", help="record depths of boards in the calibration")
    parser.add_argument("--close", action="store_true", help="no border of the light is in view")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    told, noted, alarms = 0, 0, 0
    for case in exposed(CLOSE if options.close else WIDE, seed=options.seed):
        known = with_boards(case.calibration) if options.calibrated else case.calibration
        sound = decoded(case.shot, known)
        assert isinstance(sound, Shape), sound
        print(f"{case.scene}, sound: {sound.warnings or sound.geometry}")
        alarms += bool(sound.warnings)
        assert sound.xyz_mm is not None
        for name, change in FAULTS.items():
            found = decoded(case.shot, change(known))
            if isinstance(found, str):
                told += 1
                print(f"  {name:21s} refused: {found[:110]}")
                continue
            assert found.xyz_mm is not None
            error_mm = np.nanmedian(np.linalg.norm(found.xyz_mm - sound.xyz_mm, axis=2))
            told += bool(found.warnings)
            noted += not found.warnings and found.geometry.startswith("rows not checked")
            words = found.warnings[0] if found.warnings else f"SILENT, {found.geometry}"
            print(f"  {name:21s} {error_mm:6.1f} mm off: {words[:110]}")
    print(f"{told} of {4 * len(FAULTS)} told, {noted} others noted as not checked, {alarms} false alarms")
    if options.json:
        options.json.write_text(figures_text({"told": told, "noted": noted, "false_alarms": alarms}))


if __name__ == "__main__":
    main()
