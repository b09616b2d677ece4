"""Camera, both projectors and all poses of the board in one least-squares fit, with a covariance of everything.

>>> from quadfringe.calibration.bundle import calibrate_rig  # doctest: +SKIP
>>> found = calibrate_rig(poses, ring_board())  # doctest: +SKIP
>>> found.visible.device.focal_px, found.visible.sd.focal_px  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.detect import View
from quadfringe.calibration.fits import DeviceFit, device_fit, pair_fit
from quadfringe.calibration.model import DEVICES, Adjustment, Sight
from quadfringe.calibration.pair import PairPose
from quadfringe.calibration.poses import PoseSpread, check_poses
from quadfringe.calibration.projector import ProjectorPoints
from quadfringe.calibration.start import check_distance, first_values
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError, InputError

__all__ = ["Pose", "RigCalibration", "calibrate_camera", "calibrate_rig"]

Array = NDArray[np.float64]
SIGHT_MIN = 8  # points of a board that a device must see to use a pose
CONDITION_MAX = 1e12  # of the scaled normal equations
FOUND_SD_PX = 0.02  # what points are taken to be good for until their residuals are known


@dataclass(frozen=True)
class Pose:
    """One pose of the board: where the camera sees its points, and which projector pixels light them."""

    view: View
    visible: ProjectorPoints | None = None
    infrared: ProjectorPoints | None = None


@dataclass(frozen=True)
class RigCalibration:
    """Devices, poses and their uncertainty.

    `T_camera_board` (P, 4, 4) are the poses of the board, mm. `names`, `values` (n,) and `covariance` (n, n) hold every
    parameter, such as "visible.focal_x_px" or "pose_3.rotation_y_rad" (a rotation vector). `point_sd_px` are the
    standard deviations of the points by device, as their residuals show them. `pair` is None without two projectors.
    """

    camera: DeviceFit
    visible: DeviceFit | None
    infrared: DeviceFit | None
    pair: PairPose | None
    T_camera_board: Array
    spread: PoseSpread
    names: tuple[str, ...]
    values: Array
    covariance: Array
    point_sd_px: dict[str, float]


def calibrate_camera(
    views: Sequence[View], target: Target, radial3: bool = False, distance_mm: float | None = None
) -> RigCalibration:
    """Calibrate the camera alone; as `calibrate_rig`."""
    return calibrate_rig([Pose(view) for view in views], target, radial3, distance_mm)


def calibrate_rig(
    poses: Sequence[Pose], target: Target, radial3: bool = False, distance_mm: float | None = None
) -> RigCalibration:
    """Calibrate camera and projectors from poses of a board, none, one or both projectors being in them.

    `radial3` adds the third radial coefficient. `distance_mm` is how far the board of the first pose stood from the
    camera, roughly: it is the one thing that shows a wrong size of the board, which scales everything else.

    Raises `DegeneratePosesError` for poses that cannot tell, `CalibrationError` when nothing fits or the distance is
    wrong, `InputError` for mixed image sizes and for projectors that are missing in some poses.
    """
    spread = check_poses([pose.view for pose in poses], target)
    sights = _sights(poses, target)
    sizes = _sizes(poses)
    sd_px = dict.fromkeys(DEVICES, FOUND_SD_PX)
    values = first_values(Adjustment(sights, len(poses), radial3, sd_px), sizes)
    for _ in range(2):
        adjustment = Adjustment(sights, len(poses), radial3, sd_px)
        values, covariance = _adjusted(adjustment, values)
        sd_px = _point_sd(adjustment, values, covariance)
    adjustment = Adjustment(sights, len(poses), radial3, sd_px)
    values, covariance = _adjusted(adjustment, values)
    check_distance(adjustment, values, target, distance_mm)
    fits = {name: device_fit(adjustment, values, covariance, name, sizes[name]) for name in adjustment.devices}
    both = "visible" in fits and "infrared" in fits
    return RigCalibration(
        camera=fits["camera"],
        visible=fits.get("visible"),
        infrared=fits.get("infrared"),
        pair=pair_fit(adjustment, values, covariance) if both else None,
        T_camera_board=_matrices(adjustment, values),
        spread=spread,
        names=adjustment.names,
        values=values,
        covariance=covariance,
        point_sd_px=sd_px,
    )


def _sizes(poses: Sequence[Pose]) -> dict[str, tuple[int, int]]:
    sizes = {"camera": poses[0].view.size_px}
    for name in DEVICES[1:]:
        found = {points.size_px for pose in poses if (points := getattr(pose, name)) is not None}
        if len(found) > 1:
            raise InputError(f"{name}: projector sizes {sorted(found)} are mixed; a projector has one")
        sizes |= dict.fromkeys([name] if found else [], next(iter(found), (0, 0)))
    return sizes


def _sights(poses: Sequence[Pose], target: Target) -> list[Sight]:
    """Camera sights first, since those of the projectors refer to them."""
    board = target.points_mm
    sights = [Sight("camera", i, board[pose.view.ids], pose.view.points_px) for i, pose in enumerate(poses)]
    for name in DEVICES[1:]:
        given = [getattr(pose, name) for pose in poses]
        if any(points is None for points in given):
            missing = [i + 1 for i, points in enumerate(given) if points is None]
            if len(missing) < len(poses):
                raise InputError(f"{name}: no points in the poses {missing}; capture its fringes at every pose")
            continue
        for i, (pose, points) in enumerate(zip(poses, given, strict=True)):
            if not np.array_equal(points.ids, pose.view.ids):
                raise InputError(f"{name}: the points of pose {i + 1} are not those of its view")
            lit = np.flatnonzero(np.isfinite(points.points_px).all(axis=1))
            if len(lit) < SIGHT_MIN:
                raise CalibrationError(
                    "unlit",
                    f"{name}: {len(lit)} of {len(points.ids)} points of pose {i + 1} are lit; move the board into the "
                    "light of the projector, or leave the pose out",
                )
            _not_mirrored(name, points, lit)
            sights.append(Sight(name, i, board[points.ids[lit]], points.points_px[lit], points.slope[lit], lit))
    return sights


def _not_mirrored(name: str, points: ProjectorPoints, lit: NDArray[np.intp]) -> None:
    if np.median(np.linalg.det(points.slope[lit])) < 0:
        raise CalibrationError(
            "mirrored",
            f"{name}: columns and rows of the projector run against each other as the camera sees them; the projector "
            "or the camera shows a mirrored image (a beam splitter mirrors: set flip_long_axis or flip_short_axis)",
        )


def _adjusted(adjustment: Adjustment, values: Array) -> tuple[Array, Array]:
    """Minimise, and give parameters and covariance for points of the stated standard deviations.

    Focal lengths and distances, centres and turns nearly stand for each other, along which the iterative solver of the
    sparse method crawls. So it moves in coordinates that are independent and of unit variance at the start.
    """
    from scipy.optimize import least_squares

    start, spread = values, np.linalg.cholesky(_covariance(adjustment.jacobian(values)))
    found = least_squares(
        lambda moved: adjustment.residuals(start + spread @ moved),
        np.zeros(len(values)),
        lambda moved: adjustment.jacobian(start + spread @ moved) @ spread,
        method="trf",
        tr_solver="lsmr",
        ftol=1e-10,
        xtol=1e-10,
        max_nfev=60,
    )
    values = start + spread @ found.x
    if not found.success:
        raise CalibrationError("not_fitted", "the adjustment does not settle; are the boards of all poses the same?")
    return values, _covariance(adjustment.jacobian(values))


def _covariance(jacobian: Any) -> Array:
    """Inverse of the normal equations; raises `CalibrationError` when they have none."""
    scale = 1 / np.sqrt(np.asarray(jacobian.multiply(jacobian).sum(axis=0)).ravel())
    normal = (jacobian.T @ jacobian).toarray() * scale * scale[:, None]
    if not np.isfinite(normal).all() or np.linalg.cond(normal) > CONDITION_MAX:
        raise CalibrationError(
            "not_determined", "the poses leave parameters open; add boards tilted to other sides, nearer and farther"
        )
    inverse = np.linalg.inv(normal) * scale * scale[:, None]
    return np.asarray(0.5 * (inverse + inverse.T), np.float64)


def _point_sd(adjustment: Adjustment, values: Array, covariance: Array) -> dict[str, float]:
    """Give the standard deviation of a coordinate by device: its residuals over its share of the redundancy."""
    residuals, jacobian = adjustment.residuals(values), adjustment.jacobian(values)
    leverage = np.asarray((jacobian @ covariance * jacobian.toarray()).sum(axis=1)).ravel()
    found = {}
    for device in adjustment.devices:
        rows = np.concatenate(
            [
                np.arange(r.start, r.stop)
                for r, s in zip(adjustment.rows, adjustment.sights, strict=True)
                if s.device == device
            ]
        )
        redundancy = len(rows) - leverage[rows].sum()
        found[device] = float(adjustment.sd_px[device] * np.sqrt(np.square(residuals[rows]).sum() / redundancy))
    return found


def _matrices(adjustment: Adjustment, values: Array) -> Array:
    import cv2

    found = np.tile(np.eye(4), (adjustment.poses, 1, 1))
    for i in range(adjustment.poses):
        motion = adjustment.part(values, f"pose_{i + 1}", "motion")
        found[i, :3, :3], found[i, :3, 3] = cv2.Rodrigues(motion[:3])[0], motion[3:]
    return found
