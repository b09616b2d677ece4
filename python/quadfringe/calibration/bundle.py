"""Bundle adjustment: camera, both projectors and all board poses in one least-squares fit, with its covariance.

>>> from quadfringe.calibration.bundle import calibrate_rig  # doctest: +SKIP
>>> found = calibrate_rig(poses, ring_board())  # doctest: +SKIP
>>> found.visible.device.focal_px, found.visible.sd.focal_px  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._adjustment import DEVICES, Adjustment, Sight
from quadfringe.calibration._initial_values import check_distance, first_values
from quadfringe.calibration._params import (
    CONDITION_MAX,
    OUTLIER_ROUNDS,
    OUTLIER_SD,
    OUTLIER_SHARE_MAX,
    POINT_SD_MIN_PX,
    SIGHT_MIN,
)
from quadfringe.calibration.detect import View
from quadfringe.calibration.device_fit import DeviceFit, device_fit, pair_fit
from quadfringe.calibration.poses import PoseSpread, check_poses
from quadfringe.calibration.projector import ProjectorPoints
from quadfringe.calibration.projector_pair import PairPose
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError, InputError

__all__ = ["Pose", "RigCalibration", "calibrate_camera", "calibrate_rig"]

Array = NDArray[np.float64]
MAD_TO_SD = 1.4826  # standard deviation of a Gaussian over its median absolute value


@dataclass(frozen=True)
class Pose:
    """One pose of the board: its points in the camera image, and the projector pixels that light them."""

    view: View
    visible: ProjectorPoints | None = None
    infrared: ProjectorPoints | None = None


@dataclass(frozen=True)
class RigCalibration:
    """The calibrated devices and board poses, with their uncertainty.

    `T_camera_board` (P, 4, 4) are the poses of the board, mm. `names`, `values` (n,) and `covariance` (n, n) hold every
    parameter, such as "visible.focal_x_px" or "pose_3.rotation_y_rad" (a component of a rotation vector).
    `point_sd_px` maps each device to the standard deviations (2,) of its points along x and y, px, estimated from the
    residuals. `visible`, `infrared` and `pair` are None for projectors that the poses do not contain.
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
    point_sd_px: dict[str, Array]


def calibrate_camera(
    views: Sequence[View], target: Target, radial3: bool = False, distance_mm: float | None = None
) -> RigCalibration:
    """Calibrate the camera alone; arguments and errors as `calibrate_rig`."""
    return calibrate_rig([Pose(view) for view in views], target, radial3, distance_mm)


def calibrate_rig(
    poses: Sequence[Pose], target: Target, radial3: bool = False, distance_mm: float | None = None
) -> RigCalibration:
    """Calibrate the camera and the projectors that the poses contain: none, one or both.

    `radial3` adds the third radial distortion coefficient k3. `distance_mm` is the approximate distance of the first
    board from the camera; it is the only check of the stated board size, which scales every length. Points more than
    five standard deviations off are left out.

    Raises `DegeneratePosesError` for poses that leave parameters undetermined, `CalibrationError` when the adjustment
    does not converge, when a pose contradicts the others or when the distance is wrong, and `InputError` for mixed
    image sizes and for a projector that some poses lack.
    """
    spread = check_poses([pose.view for pose in poses], target)
    sights = _sights(poses, target)
    sizes = _sizes(poses)
    adjustment, values, covariance = _settled(sights, len(poses), radial3, sizes)
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
        point_sd_px=adjustment.sd_px,
    )


def _sizes(poses: Sequence[Pose]) -> dict[str, tuple[int, int]]:
    sizes = {"camera": poses[0].view.size_px}
    for name in DEVICES[1:]:
        found = {points.size_px for pose in poses if (points := getattr(pose, name)) is not None}
        if len(found) > 1:
            raise InputError(
                f"{name}: expected one projector size in all poses, got {sorted(found)}; capture all poses with one "
                "projector"
            )
        sizes |= dict.fromkeys([name] if found else [], next(iter(found), (0, 0)))
    return sizes


def _sights(poses: Sequence[Pose], target: Target) -> list[Sight]:
    """Return the sights of all devices; those of the camera come first, because the projectors refer to them."""
    board = target.points_mm
    sights = [Sight("camera", i, board[pose.view.ids], pose.view.points_px) for i, pose in enumerate(poses)]
    for name in DEVICES[1:]:
        given = [getattr(pose, name) for pose in poses]
        if any(points is None for points in given):
            missing = [i + 1 for i, points in enumerate(given) if points is None]
            if len(missing) < len(poses):
                raise InputError(f"{name}: no points in poses {missing}; capture its fringes in every pose, or in none")
            continue
        for i, (pose, points) in enumerate(zip(poses, given, strict=True)):
            if not np.array_equal(points.ids, pose.view.ids):
                raise InputError(
                    f"{name}: the point ids of pose {i + 1} differ from those of its view; compute both from the same "
                    "view"
                )
            lit = np.flatnonzero(np.isfinite(points.points_px).all(axis=1))
            if len(lit) < SIGHT_MIN:
                raise CalibrationError(
                    "unlit",
                    f"{name}: {len(lit)} of {len(points.ids)} points of pose {i + 1} are lit, at least {SIGHT_MIN} "
                    "are needed; move the board into the "
                    "light of this projector, or leave the pose out",
                )
            _not_mirrored(name, points, lit)
            sights.append(Sight(name, i, board[points.ids[lit]], points.points_px[lit], points.slope[lit], lit))
    return sights


def _not_mirrored(name: str, points: ProjectorPoints, lit: NDArray[np.intp]) -> None:
    if np.median(np.linalg.det(points.slope[lit])) < 0:
        raise CalibrationError(
            "mirrored",
            f"{name}: the camera sees the projector image mirrored; set flip_long_axis or flip_short_axis of this "
            "projector (a beam splitter mirrors its image), or switch off the mirroring of the camera",
        )


class _Settled(NamedTuple):
    """The final adjustment, its parameters (n,) and their covariance (n, n)."""

    adjustment: Adjustment
    values: Array
    covariance: Array


def _settled(sights: Sequence[Sight], poses: int, radial3: bool, sizes: dict[str, tuple[int, int]]) -> _Settled:
    """Adjust until the set of outliers and the standard deviations of the points no longer change.

    The first adjustments use a robust loss, so that outliers cannot hide behind the parameters that they distort.
    """
    sd_px = {name: np.ones(2) for name in DEVICES}
    adjustment = Adjustment(sights, poses, radial3, sd_px)
    values = first_values(adjustment, sizes)
    for _ in range(2):
        adjustment = Adjustment(sights, poses, radial3, _robust_sd(adjustment, values))
        values, _ = _adjusted(adjustment, values, "soft_l1")
    sd_px = _robust_sd(adjustment, values)
    for _ in range(OUTLIER_ROUNDS):
        before = adjustment.kept
        adjustment = Adjustment(sights, poses, radial3, sd_px, _without_outliers(adjustment, values, sd_px))
        values, covariance = _adjusted(adjustment, values)
        sd_px = _point_sd(adjustment, values, covariance)
        if all(np.array_equal(a, b) for a, b in zip(before, adjustment.kept, strict=True)):
            break
    adjustment = Adjustment(sights, poses, radial3, sd_px, adjustment.kept)
    return _Settled(adjustment, *_adjusted(adjustment, values))


def _robust_sd(adjustment: Adjustment, values: Array) -> dict[str, Array]:
    """Return robust standard deviations (2,) by device, px, from the median absolute residuals."""
    residuals, found = adjustment.independent(values), {}
    for device in adjustment.devices:
        scaled = np.concatenate([r for r, s in zip(residuals, adjustment.sights, strict=True) if s.device == device])
        sd = MAD_TO_SD * np.median(np.abs(scaled), axis=0)
        found[device] = np.maximum(sd * adjustment.sd_px[device], POINT_SD_MIN_PX)
    return found


def _without_outliers(adjustment: Adjustment, values: Array, sd_px: dict[str, Array]) -> list[NDArray[np.bool_]]:
    """Mark the points (n,) of each sight that are kept; an outlier of the camera is one for the projectors too."""
    marks, camera = [], {}
    for sight, scaled in zip(adjustment.sights, adjustment.independent(values), strict=True):
        kept = np.hypot(*(scaled * adjustment.sd_px[sight.device] / sd_px[sight.device]).T) <= OUTLIER_SD
        if (~kept).sum() > OUTLIER_SHARE_MAX * len(kept):
            raise CalibrationError(
                "outlying",
                f"{sight.device}: {(~kept).sum()} of {len(kept)} points of pose {sight.pose + 1} contradict the other "
                "poses; the board moved during the capture, or is bent: take this pose again, or leave it out",
            )
        if sight.camera_rows is None:
            camera[sight.pose] = kept
        else:
            kept = kept & camera[sight.pose][sight.camera_rows]
        marks.append(kept)
    return marks


def _adjusted(adjustment: Adjustment, values: Array, loss: str = "linear") -> tuple[Array, Array]:
    """Minimise the residuals; return the parameters and their covariance.

    Focal length and distance, and principal point and rotation, are strongly correlated, which makes the iterative
    sparse solver slow. It therefore works in coordinates that are uncorrelated with unit variance at the start.
    """
    from scipy.optimize import least_squares

    start, spread = values, np.linalg.cholesky(_covariance(adjustment.jacobian(values)))
    found = least_squares(
        lambda moved: adjustment.residuals(start + spread @ moved),
        np.zeros(len(values)),
        lambda moved: adjustment.jacobian(start + spread @ moved) @ spread,
        method="trf",
        tr_solver="lsmr",
        loss=loss,
        ftol=1e-10,
        xtol=1e-10,
        max_nfev=60,
    )
    values = start + spread @ found.x
    if not found.success:
        raise CalibrationError(
            "not_fitted",
            "the adjustment does not converge; use the same board in all poses, and take poses that moved again",
        )
    return values, _covariance(adjustment.jacobian(values))


def _covariance(jacobian: Any) -> Array:
    """Return the inverse of the normal matrix; raises `CalibrationError` when it is singular."""
    scale = 1 / np.sqrt(np.asarray(jacobian.multiply(jacobian).sum(axis=0)).ravel())
    normal = (jacobian.T @ jacobian).toarray() * scale * scale[:, None]
    if not np.isfinite(normal).all() or np.linalg.cond(normal) > CONDITION_MAX:
        raise CalibrationError(
            "not_determined",
            "the poses leave parameters undetermined; add boards tilted to other sides, nearer and farther",
        )
    inverse = np.linalg.inv(normal) * scale * scale[:, None]
    return np.asarray(0.5 * (inverse + inverse.T), np.float64)


def _point_sd(adjustment: Adjustment, values: Array, covariance: Array) -> dict[str, Array]:
    """Return the standard deviations (2,) of x and y by device, px: residuals over their share of the redundancy."""
    residuals, jacobian = adjustment.residuals(values), adjustment.jacobian(values)
    leverage = np.asarray((jacobian @ covariance * jacobian.toarray()).sum(axis=1)).reshape(-1, 2)
    squared, counts = np.square(residuals).reshape(-1, 2), np.concatenate(adjustment.kept)
    owner = np.concatenate([np.full(len(s.points_px), s.device) for s in adjustment.sights])
    found = {}
    for device in adjustment.devices:
        points = counts & (owner == device)
        redundancy = points.sum() - leverage[points].sum(axis=0)
        scale = np.sqrt(squared[points].sum(axis=0) / redundancy)
        found[device] = np.maximum(adjustment.sd_px[device] * scale, POINT_SD_MIN_PX)
    return found


def _matrices(adjustment: Adjustment, values: Array) -> Array:
    import cv2

    found = np.tile(np.eye(4), (adjustment.poses, 1, 1))
    for i in range(adjustment.poses):
        motion = adjustment.part(values, f"pose_{i + 1}", "motion")
        found[i, :3, :3], found[i, :3, 3] = cv2.Rodrigues(motion[:3])[0], motion[3:]
    return found
