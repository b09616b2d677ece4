"""Whether the poses of a board can tell a calibration anything, judged before anything is fitted.

What is asked needs no focal length. Along a tilted board the scale changes, and by how much and in which direction is
the gradient of the depth, seen in the homography; how large the board appears is its distance. Zhang, "A flexible new
technique for camera calibration", IEEE TPAMI 22, 1330 (2000): parallel planes add nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._grid import homography, jacobians
from quadfringe.calibration.detect import View
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError, InputError

__all__ = ["DegeneratePosesError", "PoseSpread", "check_poses", "pose_spread"]

POSES_MIN = 5
TILT_MIN = 0.03  # change of depth across the board, as a share of the depth, that tilts must differ by
AXIS_MIN = 0.012  # the same along the direction in which they differ least
DEPTH_MIN = 0.04  # range of the distances of the boards, as a share of the distance


class DegeneratePosesError(CalibrationError):
    """Poses that leave parameters open; `reason` is too_few, fronto_parallel, one_axis or one_depth."""


@dataclass(frozen=True)
class PoseSpread:
    """How different poses are: shares of the depth, without unit.

    `tilt` (P, 2) is the change of depth across each board along x and y of the image; `depth` (P,) its distance
    relative to the mean; `spread` are the standard deviations of the tilts along the directions in which they
    differ most and least; `depth_range` is the greatest less the least distance.
    """

    tilt: NDArray[np.float64]
    depth: NDArray[np.float64]
    spread: tuple[float, float]
    depth_range: float


def pose_spread(views: Sequence[View], target: Target) -> PoseSpread:
    """Measure how different the poses of views are; raises `InputError` for mixed image sizes."""
    sizes = sorted({view.size_px for view in views})
    if len(sizes) > 1:
        names = ", ".join(f"{w} x {h}" for w, h in sizes)
        raise InputError(f"the views have images of {names} pixels; all images of a calibration must have one size")
    measured = [_tilt_and_scale(view, target) for view in views]
    tilt = np.array([m[0] for m in measured]).reshape(-1, 2)
    depth = 1 / np.array([m[1] for m in measured])
    depth = depth / depth.mean() if len(depth) else depth
    spread = np.linalg.svd(tilt - tilt.mean(axis=0), compute_uv=False) / np.sqrt(len(tilt)) if len(tilt) > 1 else (0, 0)
    return PoseSpread(tilt, depth, (float(spread[0]), float(spread[1])), float(np.ptp(depth)) if len(depth) else 0.0)


def _tilt_and_scale(view: View, target: Target) -> tuple[NDArray[np.float64], float]:
    """Relative change of depth across the board along x and y of the image, and the scale in the middle, px per mm."""
    points = target.points_mm[:, :2]
    matrix = homography(points[view.ids], view.points_px)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    slope = jacobians(matrix, middle)
    # Depth is the third homogeneous coordinate up to a factor: its gradient on the board, turned into the image.
    gradient = matrix[2, :2] / (matrix[2, :2] @ middle + matrix[2, 2])
    turn, stretch, back = np.linalg.svd(slope)
    return turn @ back @ gradient * float(np.linalg.norm(np.ptp(points, axis=0))), float(stretch[0])


def check_poses(views: Sequence[View], target: Target) -> PoseSpread:
    """Give the spread of the poses, or raise `DegeneratePosesError` that names what is missing and what to do."""
    if len(views) < POSES_MIN:
        raise DegeneratePosesError(
            "too_few", f"{len(views)} poses; at least {POSES_MIN} are needed, 9 to 15 are good: capture more"
        )
    found = pose_spread(views, target)
    largest, least = found.spread
    if largest < TILT_MIN:
        raise DegeneratePosesError(
            "fronto_parallel",
            f"all boards are parallel: depth across them differs by {100 * largest:.1f} % from pose to pose, "
            f"{100 * TILT_MIN:.0f} % are needed; tilt the board by 20 to 40 degrees, to the left, right, up and down",
        )
    if least < AXIS_MIN:
        raise DegeneratePosesError(
            "one_axis",
            "all boards are tilted about one axis; tilt the board to the left and right as well as up and down",
        )
    if found.depth_range < DEPTH_MIN:
        raise DegeneratePosesError(
            "one_depth",
            f"all boards are near one depth: distances differ by {100 * found.depth_range:.1f} %, "
            f"{100 * DEPTH_MIN:.0f} % are needed; hold some nearer and some farther, over all the depth to be measured",
        )
    return found
