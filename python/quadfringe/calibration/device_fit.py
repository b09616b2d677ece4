"""Results of an adjustment as people use them: a device, the pair of projectors, each with its uncertainty."""

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
    sees: predicted less found, NaN for the `left_out` points that were outliers. `mean_px`, `rms_px` and `max_px` are
    of their lengths; the mean is the reprojection error as published.
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
    """Give one device of an adjustment."""
    import cv2

    sd = np.sqrt(np.diag(covariance))
    lens = _padded(adjustment.part(values, name, "lens"))
    lens_sd = _padded(adjustment.part(sd, name, "lens"))
    motion = motion_sd = np.zeros(6)
    if name != "camera":
        motion, motion_sd = (adjustment.part(v, name, "motion") for v in (values, sd))
    fx, fy, cx, cy, *distortion = lens.tolist()
    device = Device(
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
    seen = zip(adjustment.raw(values), adjustment.kept, adjustment.sights, strict=True)
    raw = [np.where(kept[:, None], missed, np.nan) for missed, kept, sight in seen if sight.device == name]
    lengths = np.linalg.norm(np.concatenate(raw), axis=1)
    out = np.isnan(lengths)
    lengths = lengths[~out]
    return DeviceFit(
        device,
        found,
        tuple(raw),
        mean_px=float(lengths.mean()),
        rms_px=float(np.sqrt(np.square(lengths).mean())),
        max_px=float(lengths.max()),
        left_out=int(out.sum()),
    )


def _padded(lens: Array) -> Array:
    return np.concatenate([lens, np.zeros(9 - len(lens))])


def pair_fit(adjustment: Adjustment, values: Array, covariance: Array) -> PairPose:
    """Give the motion between the projectors of an adjustment, with its uncertainty (S10)."""
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
