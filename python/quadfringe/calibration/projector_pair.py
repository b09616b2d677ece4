"""The pose of the infrared projector relative to the visible one, and its uncertainty (S10).

The functions take plain arrays, so that they also serve projectors that another program calibrated.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadfringe.calibration._params import DIFFERENCE_STEP
from quadfringe.config import Device
from quadfringe.errors import InputError

__all__ = ["AXES", "PairPose", "deviated", "pair_pose"]

Vector = NDArray[np.float64]
AXES = ("rx_deg", "ry_deg", "rz_deg", "tx_mm", "ty_mm", "tz_mm")


@dataclass(frozen=True)
class PairPose:
    """The transform T_infrared_visible, P_infrared = R P_visible + T; `rotation_deg` (3,) is the rotation vector of R.

    `covariance` (6, 6) belongs to the rotation vector, deg, and the translation, mm; it is NaN when none was given.
    """

    rotation_deg: Vector
    translation_mm: Vector
    covariance: Vector

    @property
    def values(self) -> Vector:
        """Rotation vector, deg, and translation, mm, (6,), in the order of `AXES`."""
        return np.concatenate([self.rotation_deg, self.translation_mm])

    @property
    def sd(self) -> Vector:
        """Standard deviations of `values`, (6,)."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, confidence: float = 0.95) -> Vector:
        """Return lower and upper limits (6, 2) that contain all six values jointly with this confidence.

        Uses Bonferroni's inequality, which does not need independent values. Raises `InputError` unless
        0 < confidence < 1.
        """
        if not 0 < confidence < 1:
            raise InputError(f"confidence: expected a number between 0 and 1, such as 0.95, got {confidence}")
        reach = NormalDist().inv_cdf(1 - (1 - confidence) / (2 * len(AXES))) * self.sd
        return np.stack([self.values - reach, self.values + reach], axis=1)


def pair_pose(
    rotation_visible: ArrayLike,
    translation_visible_mm: ArrayLike,
    rotation_infrared: ArrayLike,
    translation_infrared_mm: ArrayLike,
    covariance: ArrayLike | None = None,
) -> PairPose:
    """Return R12 = R2 R1^-1 and T12 = T2 - R12 T1 of two projectors posed in one frame (S10).

    Rotations (3, 3) and translations (3,), mm, are those of T_projector_camera. `covariance` (12, 12) belongs to the
    rotation vector, rad, and the translation, mm, of the visible projector, then of the infrared one; it is propagated
    to first order. Raises `InputError` for other shapes, for matrices that are no rotations, and for a covariance that
    is not symmetric and positive semidefinite.

    >>> from quadfringe.calibration.projector_pair import pair_pose
    >>> import numpy as np
    >>> sd = np.array([1e-4, 1e-4, 1e-4, 0.1, 0.1, 0.1] * 2)  # rad and mm
    >>> pose = pair_pose(np.eye(3), [-200, 0, 0], np.eye(3), [-199.5, 0, 0], np.diag(sd**2))
    >>> pose.translation_mm.tolist(), pose.sd[3:].round(3).tolist()
    ([0.5, 0.0, 0.0], [0.141, 0.144, 0.144])
    """
    posed = [
        np.concatenate([_vector(_array(name, rotation, (3, 3))), _array("translation_mm", translation_mm, (3,))])
        for name, rotation, translation_mm in (
            ("rotation_visible", rotation_visible, translation_visible_mm),
            ("rotation_infrared", rotation_infrared, translation_infrared_mm),
        )
    ]
    given = np.concatenate(posed)
    values = _relative(given)
    spread = np.full((6, 6), np.nan) if covariance is None else _propagated(given, covariance)
    return PairPose(values[:3], values[3:], spread)


def _propagated(given: Vector, covariance: ArrayLike) -> Vector:
    """Propagate the covariance (12, 12) of both poses to that of their relative pose (6, 6), to first order."""
    known = _array("covariance", covariance, (12, 12))
    symmetric = np.allclose(known, known.T, rtol=1e-6, atol=1e-15)
    if not symmetric or np.linalg.eigvalsh(known)[0] < -1e-9 * np.trace(known):
        raise InputError("covariance: expected a symmetric positive semidefinite matrix (12, 12)")
    steps = DIFFERENCE_STEP * np.eye(12)
    slopes = np.stack([(_relative(given + s) - _relative(given - s)) / (2 * DIFFERENCE_STEP) for s in steps], axis=1)
    return np.asarray(slopes @ known @ slopes.T)


def deviated(device: Device, rotation_deg: ArrayLike, translation_mm: ArrayLike) -> Device:
    """Return the device rotated by a rotation vector, deg, and then moved, mm, in the frame of the device.

    `pair_pose` of the device and the result gives both back. Raises `InputError` unless both are three finite numbers.
    """
    turn = cv2.Rodrigues(np.radians(_array("rotation_deg", rotation_deg, (3,))))[0]
    moved = turn @ np.asarray(device.translation_mm) + _array("translation_mm", translation_mm, (3,))
    pose = {"rotation": (turn @ np.asarray(device.rotation)).tolist(), "translation_mm": moved.tolist()}
    return Device.model_validate(device.model_dump() | pose)


def _relative(posed: Vector) -> Vector:
    """Return rotation vector, deg, and translation, mm, of T_infrared_visible, (6,), from both poses (12,)."""
    first, second = cv2.Rodrigues(posed[:3])[0], cv2.Rodrigues(posed[6:9])[0]
    turn = second @ first.T
    return np.concatenate([np.degrees(_vector(turn)), posed[9:] - turn @ posed[3:6]])


def _vector(rotation: Vector) -> Vector:
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0:
        raise InputError(
            f"rotation: expected a proper rotation (orthonormal rows, determinant +1), got {rotation.tolist()}"
        )
    return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64).ravel()


def _array(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Vector:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise InputError(f"{name}: expected finite numbers of shape {shape}, got shape {array.shape}")
    return array
