"""Measure how far print bends the phase of the twelve images to which the real captures are compared.

    python evaluation/print_relief.py [--data FOLDER]

A pixel sees a spot of the surface. Where the albedo a changes across the spot, its brighter side counts more, and the
phase of the pixel is that of this side: with a Gaussian spot of the standard deviation s, phase-shifted images have the
phase Phi + s^2 grad(ln a) grad(Phi), to first order. So print looks like relief in the twelve images. A single shot
that follows the smooth surface then differs from them by this relief. The script fits s to the difference between the
twelve images and the single shot, and prints which part of its square the fit explains. Only pixels are counted whose
truth is sure, away from rims and holes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation._print_relief import relief


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=scenes.data_folder(), help="folder of the captures")
    options = parser.parse_args()
    print(f"{'':16}{'pixels':>8}{'spot px':>9}{'explained %':>13}{'RMS rad':>9}{'rest rad':>10}")
    for name in scenes.CAPTURES:
        for where, found in relief(options.data, name).items():
            print(
                f"{name + ', ' + where:16}{found.pixels:8}{found.spot_px:9.2f}{100 * found.explained:13.1f}"
                f"{found.rms_rad:9.4f}{found.rest_rad:10.4f}"
            )


if __name__ == "__main__":
    main()
