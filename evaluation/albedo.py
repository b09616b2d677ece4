"""Compare the albedo of decoded shots with that of the scenes of the virtual bench.

    python evaluation/albedo.py [--half tune|report] [--only WORD ...] [--json FILE]

1024 x 768, 8 bit, 3 % noise; the mean over the two seeds of a half. For each scene: root mean square of the error
relative to the mean albedo, amplitude of what is left of the fringes, and noise of a pixel relative to the mean light,
all in %. The photographs need scikit-image, which the extra `test` installs.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from statistics import fmean

import quadfringe as qf
from quadfringe.evaluation import world
from quadfringe.evaluation.albedo_truth import AlbedoFigures, judge_albedo, true_albedo
from quadfringe.files import figures_text

HALVES = {"tune": world.TUNE, "report": world.REPORT}
SCENES = ("face", "steps", "face_patches_20", "face_patches_12", "peaks_patches_20", "painted_face", "photographs_face")


def judged(name: str, seed: int) -> AlbedoFigures:
    """Decode a shot of a scene and judge its albedo."""
    taken = world.take(name, seed)
    plan = qf.Plan(912, fringes=qf.Fringes(numbers=taken.fringe_numbers), response="linear")
    shape = qf.Decoder(taken.shot, plan).decode_without_verdict(taken.shot)
    assert shape.albedo is not None
    return judge_albedo(shape.albedo, taken, true_albedo(name, seed))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--half", choices=HALVES, default="report")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="scenes whose name contains one of these words")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    figures: dict[str, float] = {}
    print(f"{'':20}{'error %':>10}{'fringes %':>11}{'noise %':>9}")
    for name in SCENES:
        if options.only is None or any(word in name for word in options.only):
            found = [judged(name, seed) for seed in HALVES[options.half]]
            rms, fringes = fmean(one.rms_percent for one in found), fmean(one.fringe_percent for one in found)
            noise = fmean(one.noise_percent for one in found)
            figures |= {f"{name}_albedo_rms_percent": rms, f"{name}_fringes_percent": fringes}
            print(f"{name:20}{rms:10.2f}{fringes:11.3f}{noise:9.1f}")
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
