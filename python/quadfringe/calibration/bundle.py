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

from quadfringe.calibration._adjustment import DEVICES, Adjustment, Sight
from quadfringe.calibration._initial_values import check_distance, first_values
from quadfringe.calibration.detect import View
from quadfringe.calibration.device_fit import DeviceFit, device_fit, pair_fit
from quadfringe.calibration.poses import PoseSpread, check_poses
from quadfringe.calibration.projector import ProjectorPoints
from quadfringe.calibration.projector_pair import PairPose
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError, InputError

__all__ = ["Pose", "RigCalibration", "calibrate_camera", "calibrate_rig"]

Array = NDArray[np.float64]
SIGHT_MIN = 8  # points of a board that a device must see to use a pose
CONDITION_MAX = 1e12  # of the scaled normal equations
LEAST_SD_PX = 1e-4  # rounding: points without noise are no better than this
OUTLIER = 5.0  # standard deviations: one good point in 270 000 is farther off
OFF_MAX = 0.25  # share of a device's points of one pose that may be outliers before it is the pose that is wrong
ROUNDS = 8  # in which the points that count settle


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
    standard deviations (2,) of the points along x and y by device, as their residuals show them. `pair` is None without
    two projectors.
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
    """Calibrate the camera alone; as `calibrate_rig`."""
    return calibrate_rig([Pose(view) for view in views], target, radial3, distance_mm)


def calibrate_rig(
    poses: Sequence[Pose], target: Target, radial3: bool = False, distance_mm: float | None = None
) -> RigCalibration:
    """Calibrate camera and projectors from poses of a board, none, one or both projectors being in them.

    `radial3` adds the third radial coefficient. `distance_mm` is how far the board of the first pose stood from the
    camera, roughly: it is the one thing that shows a wrong size of the board, which scales everything else. Points
    farther off than five standard deviations are left out.

    Raises `DegeneratePosesError` for poses that cannot tell, `CalibrationError` when nothing fits, a pose does not fit
    the others or the distance is wrong, `InputError` for mixed image sizes and for projectors that are missing in some
    poses.
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


def _settled(
    sights: Sequence[Sight], poses: int, radial3: bool, sizes: dict[str, tuple[int, int]]
) -> tuple[Adjustment, Array, Array]:
    """Adjust with the points that count and what they are good for; both are known only from the adjustment.

    The first time large residuals count by their size, not by their square, so that wrong points cannot hide.
    """
    sd_px = {name: np.ones(2) for name in DEVICES}
    adjustment = Adjustment(sights, poses, radial3, sd_px)
    values = first_values(adjustment, sizes)
    for _ in range(2):
        adjustment = Adjustment(sights, poses, radial3, _robust_sd(adjustment, values))
        values, _ = _adjusted(adjustment, values, "soft_l1")
    sd_px = _robust_sd(adjustment, values)
    for _ in range(ROUNDS):
        before = adjustment.kept
        adjustment = Adjustment(sights, poses, radial3, sd_px, _without_outliers(adjustment, values, sd_px))
        values, covariance = _adjusted(adjustment, values)
        sd_px = _point_sd(adjustment, values, covariance)
        if all(np.array_equal(a, b) for a, b in zip(before, adjustment.kept, strict=True)):
            break
    adjustment = Adjustment(sights, poses, radial3, sd_px, adjustment.kept)
    return adjustment, *_adjusted(adjustment, values)


def _robust_sd(adjustment: Adjustment, values: Array) -> dict[str, Array]:
    """Give standard deviations (2,) by device that wrong points do not reach: from the median of the residuals."""
    own, found = adjustment.independent(values), {}
    for device in adjustment.devices:
        mine = np.concatenate([r for r, s in zip(own, adjustment.sights, strict=True) if s.device == device])
        found[device] = np.maximum(1.4826 * np.median(np.abs(mine), axis=0) * adjustment.sd_px[device], LEAST_SD_PX)
    return found


def _without_outliers(adjustment: Adjustment, values: Array, sd_px: dict[str, Array]) -> list[NDArray[np.bool_]]:
    """Mark the points (n,) of each sight that count; what the camera found wrong is wrong for the projectors too."""
    marks, camera = [], {}
    for sight, own in zip(adjustment.sights, adjustment.independent(values), strict=True):
        kept = np.hypot(*(own * adjustment.sd_px[sight.device] / sd_px[sight.device]).T) <= OUTLIER
        if (~kept).sum() > OFF_MAX * len(kept):
            raise CalibrationError(
                "outlying",
                f"{sight.device}: {(~kept).sum()} of {len(kept)} points of pose {sight.pose + 1} do not fit those of "
                "the other poses; did the board move during its capture, or bend? take it again, or leave it out",
            )
        if sight.camera_rows is None:
            camera[sight.pose] = kept
        else:
            kept = kept & camera[sight.pose][sight.camera_rows]
        marks.append(kept)
    return marks


def _adjusted(adjustment: Adjustment, values: Array, loss: str = "linear") -> tuple[Array, Array]:
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
        loss=loss,
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


def _point_sd(adjustment: Adjustment, values: Array, covariance: Array) -> dict[str, Array]:
    """Give the standard deviations (2,) of x and y by device: their residuals over their share of the redundancy."""
    residuals, jacobian = adjustment.residuals(values), adjustment.jacobian(values)
    leverage = np.asarray((jacobian @ covariance * jacobian.toarray()).sum(axis=1)).reshape(-1, 2)
    squared, counts = np.square(residuals).reshape(-1, 2), np.concatenate(adjustment.kept)
    owner = np.concatenate([np.full(len(s.points_px), s.device) for s in adjustment.sights])
    found = {}
    for device in adjustment.devices:
        mine = counts & (owner == device)
        redundancy = mine.sum() - leverage[mine].sum(axis=0)
        scale = np.sqrt(squared[mine].sum(axis=0) / redundancy)
        found[device] = np.maximum(adjustment.sd_px[device] * scale, LEAST_SD_PX)
    return found


def _matrices(adjustment: Adjustment, values: Array) -> Array:
    import cv2

    found = np.tile(np.eye(4), (adjustment.poses, 1, 1))
    for i in range(adjustment.poses):
        motion = adjustment.part(values, f"pose_{i + 1}", "motion")
        found[i, :3, :3], found[i, :3, 3] = cv2.Rodrigues(motion[:3])[0], motion[3:]
    return found
