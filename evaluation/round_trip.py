"""Decoding simulated shots without noise, and the identity of the virtual bench, as figures.

    python evaluation/round_trip.py [--json FILE]

Shots of the reference bench, 1024 x 768, 16 bit. Phase errors are over pixels more than a fringe away from edges,
wrong orders over all returned pixels. Identity: camera and projector are the same device before a plane at 800 mm; the
captured image must be the projected one.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import quadfringe as qf
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation.reproduce.identity import identity_shot
from quadfringe.files import figures_text

SURFACES = ("plane", "peaks", "steps", "sphere")
FRINGE_PX = 28


def round_trip(surface: str) -> dict[str, float]:
    config = qf.SystemConfig(scene=qf.SceneConfig(surface=surface, bit_depth=16))
    with qf.open(config) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    scene = scenes.scene_from(shot, config, scanner.calibration.projector.width_px)
    lit = np.isfinite(scene.phase_rad)
    whole = scoring.score(scene, shape.phase_rad, mask=lit)
    smooth = scoring.score(scene, shape.phase_rad, mask=scoring.inside(scene.scored, FRINGE_PX))
    assert whole.in_shadow_pixels is not None
    return {
        f"{surface}_phase_rms_rad": smooth.right_phase_rms_rad,
        f"{surface}_wrong_pixels": whole.wrong_pixels + int(np.count_nonzero(shape.returned & ~lit)),
        f"{surface}_in_shadow_pixels": whole.in_shadow_pixels,
        f"{surface}_returned_percent": whole.returned_percent,
    }


def identity() -> float:
    """Give the greatest difference between captured and projected images, as a share of full scale."""
    projected, captured = identity_shot()
    return max(float(np.abs(captured[name] - projected[name]).max()) for name in projected)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    figures = {"identity_max_difference": identity()}
    for surface in SURFACES:
        figures |= round_trip(surface)
    for name, value in figures.items():
        print(f"{name:32}{value:12.5g}")
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
