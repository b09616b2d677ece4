"""Where the adjustment starts: each device on its own by OpenCV, and what its result is checked against."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._adjustment import Adjustment, Sight
from quadfringe.calibration._grid import through
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError

__all__ = ["check_distance", "first_values"]

Array = NDArray[np.float64]
GROSS = 20.0  # medians of what a homography misses: lenses bend the corners of a board by less
SCALE_OFF = 0.1  # share by which a distance by tape may differ


def first_values(adjustment: Adjustment, sizes_px: Mapping[str, tuple[int, int]]) -> Array:
    """Give parameters from which the adjustment converges; raises `CalibrationError` when a device fits nothing."""
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
    """Calibrate one device as a camera: lens parameters, and the motion (4, 4) of the board in each sight."""
    import cv2

    whole = [_not_grossly_wrong(s) for s in sights]
    boards = [s.board_mm[kept].astype(np.float32) for s, kept in zip(sights, whole, strict=True)]
    points = [s.points_px[kept].astype(np.float32) for s, kept in zip(sights, whole, strict=True)]
    try:
        _, matrix, distortion, turns, moves = cv2.calibrateCamera(
            boards, points, size_px, None, None, flags=cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
        )
    except cv2.error as error:
        raise CalibrationError("not_fitted", f"{device}: no lens fits the points ({error.err})") from error
    lens = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion.ravel()[:5]])
    if not np.isfinite(lens).all() or not (lens[:2] > 0).all():
        raise CalibrationError(
            "not_fitted", f"{device}: no lens fits the points; are the boards of all poses the same?"
        )
    motions = []
    for turn, move in zip(turns, moves, strict=True):
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = cv2.Rodrigues(turn)[0], np.ravel(move)
        motions.append(motion)
    return lens, motions


def _not_grossly_wrong(sight: Sight) -> NDArray[np.bool_]:
    """Mark the points (n,) that a homography through most of them explains about as well as the others."""
    import cv2

    matrix, _ = cv2.findHomography(sight.board_mm[:, :2], sight.points_px, cv2.LMEDS)
    if matrix is None:
        return np.ones(len(sight.points_px), bool)
    missed = np.linalg.norm(through(matrix, sight.board_mm[:, :2]) - sight.points_px, axis=1)
    return np.asarray(missed <= GROSS * np.median(missed) + 1e-6)


def _vector(motion: Array) -> Array:
    import cv2

    return np.concatenate([cv2.Rodrigues(motion[:3, :3])[0].ravel(), motion[:3, 3]])


def _typical(motions: list[Array]) -> Array:
    """Give the motion in the middle: the mean rotation, and the median translation."""
    found = np.eye(4)
    left, _, right = np.linalg.svd(np.mean([m[:3, :3] for m in motions], axis=0))
    found[:3, :3] = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    found[:3, 3] = np.median([m[:3, 3] for m in motions], axis=0)
    return found


def check_distance(adjustment: Adjustment, values: Array, target: Target, distance_mm: float | None) -> None:
    """Compare the distance of the first board with the one that was measured, when there is one."""
    if distance_mm is None:
        return
    import cv2

    motion = adjustment.part(values, "pose_1", "motion")
    middle = cv2.Rodrigues(motion[:3])[0] @ target.points_mm.mean(axis=0) + motion[3:]
    found_mm = float(np.linalg.norm(middle))
    if abs(found_mm / distance_mm - 1) > SCALE_OFF:
        size_mm = target.pitch_mm * distance_mm / found_mm
        raise CalibrationError(
            "wrong_size",
            f"the board of the first pose would stand {found_mm:.0f} mm from the camera, {distance_mm:.0f} mm were "
            f"measured: its pitch is nearer to {size_mm:.3g} mm than to {target.pitch_mm:g} mm; measure the print",
        )
