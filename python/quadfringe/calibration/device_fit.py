"""Devices and the pair of projectors, with their uncertainty, from the parameters of an adjustment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._adjustment import Adjustment
from quadfringe.calibration.projector_pair import PairPose, pair_pose
from quadfringe.config import Device

__all__ = ["DeviceFit", "DeviceSd", "device_fit", "pair_fit"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DeviceSd:
    """One standard deviation of each parameter of a device; zero for parameters that were not adjusted."""

    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    rotation_deg: tuple[float, float, float]
    translation_mm: tuple[float, float, float]


@dataclass(frozen=True)
class DeviceFit:
    """A calibrated device, the standard deviations of its parameters, and its residuals.

    `device` holds T_device_camera, the identity for the camera. `residuals_px` (n, 2), one array for each pose that the
    device sees, are predicted minus observed positions, NaN for the `left_out` outliers. `mean_px`, `rms_px` and
    `max_px` describe their lengths; the mean is the reprojection error as the paper reports it.
    """

    device: Device
    sd: DeviceSd
    residuals_px: tuple[Array, ...]
    mean_px: float
    rms_px: float
    max_px: float
    left_out: int


def device_fit(
    adjustment: Adjustment, values: Array, covariance: Array, name: str, size_px: tuple[int, int]
) -> DeviceFit:
    """Return the device `name` with its uncertainty and residuals; `size_px` is (width, height)."""
    sd = np.sqrt(np.diag(covariance))
    seen = zip(adjustment.raw(values), adjustment.kept, adjustment.sights, strict=True)
    residuals = [np.where(kept[:, None], missed, np.nan) for missed, kept, sight in seen if sight.device == name]
    lengths = np.linalg.norm(np.concatenate(residuals), axis=1)
    outlying = np.isnan(lengths)
    lengths = lengths[~outlying]
    return DeviceFit(
        _device(adjustment, values, name, size_px),
        _device_sd(adjustment, sd, name),
        tuple(residuals),
        mean_px=float(lengths.mean()),
        rms_px=float(np.sqrt(np.square(lengths).mean())),
        max_px=float(lengths.max()),
        left_out=int(outlying.sum()),
    )


def _motion(adjustment: Adjustment, values: Array, name: str) -> Array:
    """Return rotation vector and translation (6,) of a device; zero for the camera, which is the reference frame."""
    return np.zeros(6) if name == "camera" else adjustment.part(values, name, "motion")


def _device(adjustment: Adjustment, values: Array, name: str, size_px: tuple[int, int]) -> Device:
    import cv2

    fx, fy, cx, cy, *distortion = _padded(adjustment.part(values, name, "lens")).tolist()
    motion = _motion(adjustment, values, name)
    return Device(
        width_px=size_px[0],
        height_px=size_px[1],
        focal_px=(fx, fy),
        centre_px=(cx, cy),
        distortion=tuple(distortion),
        rotation=tuple(tuple(row) for row in cv2.Rodrigues(motion[:3])[0].tolist()),
        translation_mm=tuple(motion[3:].tolist()),
    )


def _device_sd(adjustment: Adjustment, sd: Array, name: str) -> DeviceSd:
    lens, motion = _padded(adjustment.part(sd, name, "lens")), _motion(adjustment, sd, name)
    return DeviceSd(
        tuple(lens[:2].tolist()),
        tuple(lens[2:4].tolist()),
        tuple(lens[4:].tolist()),
        tuple(np.degrees(motion[:3]).tolist()),
        tuple(motion[3:].tolist()),
    )


def _padded(lens: Array) -> Array:
    """Append zeros for the distortion coefficients that were not adjusted: (9,)."""
    return np.concatenate([lens, np.zeros(9 - len(lens))])


def pair_fit(adjustment: Adjustment, values: Array, covariance: Array) -> PairPose:
    """Return the pose of the infrared projector relative to the visible one, with its uncertainty (S10)."""
    import cv2

    places = [adjustment.places[name, "motion"] for name in ("visible", "infrared")]
    chosen = np.concatenate([np.arange(p.start, p.stop) for p in places])
    first, second = values[chosen[:6]], values[chosen[6:]]
    return pair_pose(
        cv2.Rodrigues(first[:3])[0],
        first[3:],
        cv2.Rodrigues(second[:3])[0],
        second[3:],
        covariance[np.ix_(chosen, chosen)],
    )
