"""The relief that print has in phase-shifted images of a camera whose pixels see a spot of the surface."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import DecodeWarning
from quadfringe.evaluation import _scenes as scenes

__all__ = ["Relief", "bent", "fitted", "relief"]

STEEP = 0.05  # change of ln(albedo) per px from which a pixel lies at print
RIM_PX = 5  # pixels nearer to a rim or a hole are not counted
CLIPPED = 0.98  # share of full scale from which a sample counts as saturated
RIGHT_RAD = 1.0  # larger differences are wrong orders or other surfaces

Map = NDArray[np.float64]


@dataclass(frozen=True)
class Relief:
    """Relief of print: the spot, the share of the squared difference that it explains, and the RMS before and after."""

    pixels: int
    spot_px: float
    explained: float
    rms_rad: float
    rest_rad: float


def bent(albedo: Map, phase: Map) -> tuple[Map, Map]:
    """Give by how much an albedo bends a phase for a spot of 1 px, rad, and how steep its logarithm is, 1/px."""
    print_y, print_x = np.gradient(np.log(cv2.GaussianBlur(np.maximum(albedo, 1e-3), (0, 0), 0.7)))
    phase_y, phase_x = np.gradient(cv2.GaussianBlur(phase, (0, 0), 1.0))
    return print_y * phase_y + print_x * phase_x, np.hypot(print_x, print_y)


def fitted(bend: Map, difference: Map) -> Relief:
    """Fit the spot to differences in rad; `bend` is their part for a spot of 1 px, rad."""
    square = max(float((bend * difference).sum() / (bend * bend).sum()), 0.0)
    rest = difference - square * bend
    explained = 1 - float((rest**2).sum() / (difference**2).sum())
    rms, left = (float(np.sqrt(np.mean(each**2))) for each in (difference, rest))
    return Relief(difference.size, float(np.sqrt(square)), explained, rms, left)


def relief(data: Path, name: str) -> dict[str, Relief]:
    """Compare a capture with its twelve images, on all counted pixels and on those at print."""
    scene = scenes.capture(data, name)
    files = scenes.step_files(data, name)
    images = np.stack([np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)) for file in files]) / 255.0
    wave = np.exp(2j * np.pi * np.arange(len(files)) / len(files))
    modulation = np.abs(np.tensordot(wave, images, 1)) * 2 / len(files)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DecodeWarning)
        phase = scenes.shape_of(scene, response=scenes.response_of(data, name)).phase_rad.astype(np.float64)
    seen = np.isfinite(phase) & scene.scored
    inner = cv2.erode(seen.astype(np.uint8), np.ones((2 * RIM_PX + 1,) * 2, np.uint8)) > 0
    assert scene.sure is not None
    difference = scene.phase_rad - phase
    counted = inner & scene.sure & (np.abs(difference) < RIGHT_RAD) & (images.max(0) < CLIPPED)
    bend, steep = bent(modulation, np.where(seen, phase, 0.0))
    printed = counted & (steep > STEEP)
    return {where: fitted(bend[mask], difference[mask]) for where, mask in (("all", counted), ("print", printed))}
