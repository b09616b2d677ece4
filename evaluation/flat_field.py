"""Effect of vignetting and of uneven pixels on uncorrected shots, as one table.

    python evaluation/flat_field.py

Shots of the virtual bench are attenuated towards the corners, or pixel by pixel, and decoded without correction.
"""

from __future__ import annotations

import numpy as np

import quadfringe as qf
from quadfringe.decoding.compare import compare

SURFACES = ("peaks", "face", "steps")
NOISE = 0.01
FALL = 0.2  # share lost at the middle of an edge, twice that in a corner
PIXELS = (0.01, 0.02)  # standard deviation of the gain of single pixels


def main() -> None:
    """Print depth RMS, wrong orders and returned pixels of each surface under each unevenness."""
    print("surface  light               depth_rms_mm  wrong_order_percent  returned_percent")
    for surface in SURFACES:
        with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface=surface, noise=NOISE, bit_depth=12))) as scanner:
            shot = scanner.grab()
        for name, gain in gains(*shot.ir.shape).items():
            uneven = {channel: (image / 4095 * gain).astype(np.float32) for channel, image in shot.channels.items()}
            shape = qf.decode(qf.Shot(**uneven, full_scale=1.0), qf.Plan(912, calibration=scanner.calibration))
            found = compare(shape, shot.truth, causes=False)
            figures = (found.overall.rms, found.wrong_order_percent, found.returned_percent)
            print(f"{surface:8} {name:19}", *(f"{figure:13.4f}" for figure in figures))


def gains(rows: int, columns: int) -> dict[str, np.ndarray]:
    """Give the gain of every pixel by name."""
    y, x = np.mgrid[-1 : 1 : rows * 1j, -1 : 1 : columns * 1j]
    random = np.random.default_rng(0)
    even = np.full((rows, columns), 0.9)
    uneven = {f"pixels of {sd:.0%}": even * (1 + sd * random.standard_normal(even.shape)) for sd in PIXELS}
    return {"even": even, "vignetting of 40 %": even * (1 - FALL * (x**2 + y**2)), **uneven}


if __name__ == "__main__":
    main()
