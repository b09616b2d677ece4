"""Results of an adjustment as people use them: a device, the pair of projectors, each with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.model import Adjustment
from quadfringe.config import DeviceModel

__all__ = ["DeviceFit", "DeviceSd", "PairFit", "device_fit", "pair_fit"]

Array = NDArray[np.float64]
NORMAL_95 = 1.959964  # standard deviations that hold 95 % of a normal distribution
STEP = 1e-6  # of the derivative of the pair, in rad and mm


@dataclass(frozen=True)
class DeviceSd:
    """One standard deviation of the parameters of a device; zero for what was not adjusted."""

    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    rotation_deg: tuple[float, float, float]
    translation_mm: tuple[float, float, float]


@dataclass(frozen=True)
class DeviceFit:
    """A calibrated device, what its parameters are good for, and what is left of each point.

    `device` holds T_device_camera, no motion for the camera. `residuals_px` are (n, 2) for each pose that the device
    sees: predicted less found. `mean_px`, `rms_px` and `max_px` are of their lengths; the mean is the reprojection
    error as published.
    """

    device: DeviceModel
    sd: DeviceSd
    residuals_px: tuple[Array, ...]
    mean_px: float
    rms_px: float
    max_px: float


@dataclass(frozen=True)
class PairFit:
    """The infrared projector seen from the visible one, T_infrared_visible: R12 and T12 of (S10).

    A rotation vector in degrees and a translation in mm, as six numbers in `covariance` (6, 6) and `sd` (6,);
    `interval95` (6, 2) are the bounds that hold the truth in 95 of 100 calibrations, each number on its own.
    """

    rotation_deg: tuple[float, float, float]
    translation_mm: tuple[float, float, float]
    covariance: Array
    sd: Array
    interval95: Array


def device_fit(
    adjustment: Adjustment, values: Array, covariance: Array, name: str, size_px: tuple[int, int]
) -> DeviceFit:
    """Give one device of an adjustment."""
    import cv2

    sd = np.sqrt(np.diag(covariance))
    lens = _padded(adjustment.part(values, name, "lens"))
    lens_sd = _padded(adjustment.part(sd, name, "lens"))
    motion = motion_sd = np.zeros(6)
    if name != "camera":
        motion, motion_sd = (adjustment.part(v, name, "motion") for v in (values, sd))
    fx, fy, cx, cy, *distortion = lens.tolist()
    device = DeviceModel(
        width_px=size_px[0],
        height_px=size_px[1],
        focal_px=(fx, fy),
        centre_px=(cx, cy),
        distortion=tuple(distortion),
        rotation=tuple(tuple(row) for row in cv2.Rodrigues(motion[:3])[0].tolist()),
        translation_mm=tuple(motion[3:].tolist()),
    )
    found = DeviceSd(
        tuple(lens_sd[:2].tolist()),
        tuple(lens_sd[2:4].tolist()),
        tuple(lens_sd[4:].tolist()),
        tuple(np.degrees(motion_sd[:3]).tolist()),
        tuple(motion_sd[3:].tolist()),
    )
    raw = [r for r, s in zip(adjustment.raw(values), adjustment.sights, strict=True) if s.device == name]
    lengths = np.linalg.norm(np.concatenate(raw), axis=1)
    rms = float(np.sqrt(np.square(lengths).mean()))
    return DeviceFit(device, found, tuple(raw), float(lengths.mean()), rms, float(lengths.max()))


def _padded(lens: Array) -> Array:
    return np.concatenate([lens, np.zeros(9 - len(lens))])


def pair_fit(adjustment: Adjustment, values: Array, covariance: Array) -> PairFit:
    """Give the motion between the projectors: R12 = R2 R1^-1, T12 = T2 - R12 T1 (S10), with its covariance."""
    places = [adjustment.places[name, "motion"] for name in ("visible", "infrared")]
    chosen = np.concatenate([np.arange(p.start, p.stop) for p in places])
    at = values[chosen]
    steps = STEP * np.eye(12)
    slope = np.stack([(_between(at + s) - _between(at - s)) / (2 * STEP) for s in steps], axis=1)
    found = _between(at)
    spread = slope @ covariance[np.ix_(chosen, chosen)] @ slope.T
    sd = np.sqrt(np.diag(spread))
    bounds = np.stack([found - NORMAL_95 * sd, found + NORMAL_95 * sd], axis=1)
    rx, ry, rz, tx, ty, tz = found.tolist()
    return PairFit((rx, ry, rz), (tx, ty, tz), spread, sd, bounds)


def _between(motions: Array) -> Array:
    """Motion from the first (6) to the second (6): rotation vector in degrees and translation in mm."""
    import cv2

    first, second = (cv2.Rodrigues(motions[i : i + 3])[0] for i in (0, 6))
    turn = second @ first.T
    return np.concatenate([np.degrees(cv2.Rodrigues(turn)[0].ravel()), motions[9:] - turn @ motions[3:6]])
