"""Initial values of the adjustment, each device calibrated alone by OpenCV; and the check of its scale."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._adjustment import Adjustment, Sight
from quadfringe.calibration._grid import through
from quadfringe.calibration._params import DISTANCE_OFF_MAX, GROSS_MEDIANS
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError

__all__ = ["check_distance", "first_values"]

Array = NDArray[np.float64]


def first_values(adjustment: Adjustment, sizes_px: Mapping[str, tuple[int, int]]) -> Array:
    """Return initial parameters of the adjustment; raises `CalibrationError` when a device cannot be fitted."""
    values = np.zeros(len(adjustment.names))
    boards: dict[int, Array] = {}
    for device in adjustment.devices:
        sights = [s for s in adjustment.sights if s.device == device]
        lens, motions = _alone(device, sights, sizes_px[device])
        place = adjustment.places[device, "lens"]
        values[place] = lens[: place.stop - place.start]
        if device == "camera":
            boards = dict(zip((s.pose for s in sights), motions, strict=True))
            for pose, motion in boards.items():
                values[adjustment.places[f"pose_{pose + 1}", "motion"]] = _vector(motion)
        else:
            between = [m @ np.linalg.inv(boards[s.pose]) for s, m in zip(sights, motions, strict=True)]
            values[adjustment.places[device, "motion"]] = _vector(_typical(between))
    return values


def _alone(device: str, sights: list[Sight], size_px: tuple[int, int]) -> tuple[Array, list[Array]]:
    """Calibrate one device as a camera; return the lens parameters (9,) and the board pose (4, 4) of each sight."""
    import cv2

    whole = [_not_grossly_wrong(s) for s in sights]
    boards = [s.board_mm[kept].astype(np.float32) for s, kept in zip(sights, whole, strict=True)]
    points = [s.points_px[kept].astype(np.float32) for s, kept in zip(sights, whole, strict=True)]
    try:
        _, matrix, distortion, turns, moves = cv2.calibrateCamera(
            boards, points, size_px, None, None, flags=cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
        )
    except cv2.error as error:
        raise CalibrationError("not_fitted", f"{device}: no lens model fits the points ({error.err})") from error
    lens = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion.ravel()[:5]])
    if not np.isfinite(lens).all() or not (lens[:2] > 0).all():
        raise CalibrationError(
            "not_fitted", f"{device}: no lens model fits the points; use the same board in all poses"
        )
    motions = []
    for turn, move in zip(turns, moves, strict=True):
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = cv2.Rodrigues(turn)[0], np.ravel(move)
        motions.append(motion)
    return lens, motions


def _not_grossly_wrong(sight: Sight) -> NDArray[np.bool_]:
    """Mark the points (n,) without gross errors, by a homography through most of them (least median of squares)."""
    import cv2

    matrix, _ = cv2.findHomography(sight.board_mm[:, :2], sight.points_px, cv2.LMEDS)
    if matrix is None:
        return np.ones(len(sight.points_px), bool)
    missed = np.linalg.norm(through(matrix, sight.board_mm[:, :2]) - sight.points_px, axis=1)
    return np.asarray(missed <= GROSS_MEDIANS * np.median(missed) + 1e-6)


def _vector(motion: Array) -> Array:
    import cv2

    return np.concatenate([cv2.Rodrigues(motion[:3, :3])[0].ravel(), motion[:3, 3]])


def _typical(motions: list[Array]) -> Array:
    """Return the typical pose (4, 4): the mean rotation and the median translation."""
    found = np.eye(4)
    left, _, right = np.linalg.svd(np.mean([m[:3, :3] for m in motions], axis=0))
    found[:3, :3] = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    found[:3, 3] = np.median([m[:3, 3] for m in motions], axis=0)
    return found


def check_distance(adjustment: Adjustment, values: Array, target: Target, distance_mm: float | None) -> None:
    """Raise `CalibrationError` when the distance of the first board contradicts the measured `distance_mm`."""
    if distance_mm is None:
        return
    import cv2

    motion = adjustment.part(values, "pose_1", "motion")
    middle = cv2.Rodrigues(motion[:3])[0] @ target.points_mm.mean(axis=0) + motion[3:]
    found_mm = float(np.linalg.norm(middle))
    if abs(found_mm / distance_mm - 1) > DISTANCE_OFF_MAX:
        size_mm = target.pitch_mm * distance_mm / found_mm
        raise CalibrationError(
            "wrong_size",
            f"the first board is {found_mm:.0f} mm from the camera by calibration, but {distance_mm:.0f} mm by "
            f"measurement: its pitch is about {size_mm:.3g} mm, not {target.pitch_mm:g} mm; measure the print",
        )
