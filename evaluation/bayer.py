"""A Bayer chip against full sampling: pure fringes, and whole shots of the virtual bench.

    python evaluation/bayer.py [--json FILE]

Fringes: two-step phase error of red and blue on slanted fringes of one period, with the interpolation of the decoder
and with that of OpenCV, and the share of white noise that remains. Shots: 1024 x 768, 16 bit without noise, 8 bit with
3 %, fixed seeds; full sampling, mosaic, and planes interpolated by the camera (bilinear). Phase errors are over pixels
more than a fringe away from edges and border, wrong orders over returned lit pixels; pixels returned in shadow, next
to lit ones, are counted apart.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe import _core
from quadfringe.evaluation import scoring
from quadfringe.files import figures_text

SURFACES = ("steps", "face", "peaks")
NOISES = (0.0, 0.03)
METHODS = ("joint", "published")
WAYS: dict[str, dict[str, str]] = {
    "full": {},
    "mosaic": {"bayer": "rggb"},
    "bilinear": {"bayer": "rggb", "demosaic": "bilinear"},
}
FRINGE_PX = 28
PERIODS_PX = (28, 20, 14, 10)
SHAPE = (256, 512)
RIM_PX = 8
Image = NDArray[Any]


def sampled(red: Image, green: Image, blue: Image) -> Image:
    """Give what an RGGB chip sees, 16 bit."""
    raw = green.copy()
    raw[0::2, 0::2], raw[1::2, 1::2] = red[0::2, 0::2], blue[1::2, 1::2]
    return np.round(65535 * np.clip(raw, 0, 1)).astype(np.uint16)


def developed(raw: Image) -> tuple[Image, Image]:
    """Give red and blue by this library."""
    light = _core.linear_light_bayer(raw, "rggb", np.zeros_like(raw))
    return light["red"], light["blue"]


def by_opencv(raw: Image) -> tuple[Image, Image]:
    """Give red and blue by OpenCV's bilinear interpolation."""
    colour = cv2.cvtColor(raw, cv2.COLOR_BayerRGGB2RGB) / 65535
    return colour[:, :, 0], colour[:, :, 2]


INTERPOLATIONS = {"mosaic": developed, "opencv": by_opencv}


def fringe_figures() -> Iterator[tuple[str, float]]:
    inner = (slice(RIM_PX, -RIM_PX),) * 2
    rows, columns = np.indices(SHAPE)
    for period in PERIODS_PX:
        phase = 2 * np.pi / period * (columns + 0.1 * rows)
        red, green, blue = (0.5 + 0.4 * np.cos(phase + shift) for shift in (0.0, 0.3, np.pi / 2))
        for name, interpolate in INTERPOLATIONS.items():
            red_light, blue_light = interpolate(sampled(red, green, blue))
            error = np.angle(np.exp(1j * (np.arctan2(0.5 - blue_light, red_light - 0.5) - phase)))
            yield f"fringes_{period}_px_{name}_phase_rms_rad", scoring.rms(error[inner])
    noise = np.random.default_rng(1).normal(0.5, 0.05, (3, *SHAPE))
    for name, interpolate in INTERPOLATIONS.items():
        red_light, _ = interpolate(sampled(*noise))
        yield f"noise_left_{name}", float(np.std(red_light[inner]) / 0.05)


def shot_figures(surface: str, noise: float) -> Iterator[tuple[str, float]]:
    for way, chip in WAYS.items():
        light = {"noise": noise, "bit_depth": 8 if noise else 16, "seed": 4, **chip}
        scene = qf.SceneConfig.model_validate({"surface": surface, **light})
        with qf.open(qf.SystemConfig(scene=scene)) as scanner:
            shot, calibration = scanner.grab(), scanner.calibration
        assert shot.truth is not None
        truth = 2 * np.pi * 36 * shot.truth.column_px.astype(np.float64) / calibration.projector.width_px
        lit = np.isfinite(truth) & ~shot.truth.shadow
        smooth = scoring.inside(lit & ~shot.truth.edge, FRINGE_PX)
        for method in METHODS:
            settings = qf.DecodeConfig.model_validate({"method": method})
            shape = qf.decode(shot, qf.Plan(912, calibration=calibration, decode=settings))
            error = np.abs(shape.phase_rad - truth)
            right = shape.returned & (error < np.pi)
            name = f"{surface}_noise_{100 * noise:.0f}_percent_{method}_{way}"
            yield f"{name}_phase_rms_rad", scoring.rms(error[right & smooth])
            yield f"{name}_wrong_pixels", int(np.count_nonzero(shape.returned & lit & ~right))
            yield f"{name}_in_shadow_pixels", int(np.count_nonzero(shape.returned & ~lit))
            yield f"{name}_returned_percent", 100 * float(np.count_nonzero(shape.returned & lit) / lit.sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    figures = dict(fringe_figures())
    for surface in SURFACES:
        for noise in NOISES:
            figures |= shot_figures(surface, noise)
    for name, value in figures.items():
        print(f"{name:64}{value:12.5g}")
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
