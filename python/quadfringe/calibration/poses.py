"""Check that the poses of a board determine a calibration, before anything is fitted.

The check needs no focal length. The homography of each view gives the relative depth gradient across the board, that
is its tilt, and the scale of the board, that is its inverse distance. Parallel planes add no constraint: Zhang,
"A flexible new technique for camera calibration", IEEE TPAMI 22, 1330 (2000).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._grid import homography, jacobians
from quadfringe.calibration._params import AXIS_MIN, DEPTH_RANGE_MIN, POSES_MIN, TILT_MIN
from quadfringe.calibration.detect import View
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError, InputError

__all__ = ["DegeneratePosesError", "PoseSpread", "check_poses", "pose_spread"]


class DegeneratePosesError(CalibrationError):
    """Poses that leave parameters undetermined; `reason` is too_few, fronto_parallel, one_axis or one_depth."""


@dataclass(frozen=True)
class PoseSpread:
    """How much poses differ, as shares of the depth (dimensionless).

    `tilt` (P, 2) is the change of depth across each board along x and y of the image; `depth` (P,) is its distance
    relative to the mean; `spread` are the standard deviations of the tilts along the directions in which they differ
    most and least; `depth_range` is the largest minus the smallest distance.
    """

    tilt: NDArray[np.float64]
    depth: NDArray[np.float64]
    spread: tuple[float, float]
    depth_range: float


def pose_spread(views: Sequence[View], target: Target) -> PoseSpread:
    """Measure how much the poses of views differ; raises `InputError` for mixed image sizes."""
    sizes = sorted({view.size_px for view in views})
    if len(sizes) > 1:
        names = ", ".join(f"{w} x {h}" for w, h in sizes)
        raise InputError(f"views: images of {names} pixels; all images of a calibration must have one size")
    measured = [_look_at(view, target) for view in views]
    tilt = np.array([m.tilt for m in measured]).reshape(-1, 2)
    depth = 1 / np.array([m.scale_px_per_mm for m in measured])
    depth = depth / depth.mean() if len(depth) else depth
    spread = np.linalg.svd(tilt - tilt.mean(axis=0), compute_uv=False) / np.sqrt(len(tilt)) if len(tilt) > 1 else (0, 0)
    return PoseSpread(tilt, depth, (float(spread[0]), float(spread[1])), float(np.ptp(depth)) if len(depth) else 0.0)


class _Look(NamedTuple):
    """Relative change of depth across a board along x and y of the image, (2,), and the scale at its middle."""

    tilt: NDArray[np.float64]
    scale_px_per_mm: float


def _look_at(view: View, target: Target) -> _Look:
    points = target.points_mm[:, :2]
    matrix = homography(points[view.ids], view.points_px)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    slope = jacobians(matrix, middle)
    # The third homogeneous coordinate is the depth up to a factor; rotate its gradient from the board into the image.
    gradient = matrix[2, :2] / (matrix[2, :2] @ middle + matrix[2, 2])
    turn, stretch, back = np.linalg.svd(slope)
    return _Look(turn @ back @ gradient * float(np.linalg.norm(np.ptp(points, axis=0))), float(stretch[0]))


def check_poses(views: Sequence[View], target: Target) -> PoseSpread:
    """Return the spread of the poses; raise `DegeneratePosesError` naming what is missing and which poses to add."""
    if len(views) < POSES_MIN:
        raise DegeneratePosesError(
            "too_few", f"{len(views)} poses; at least {POSES_MIN} are needed and 9 to 15 are good: capture more"
        )
    found = pose_spread(views, target)
    largest, least = found.spread
    if largest < TILT_MIN:
        raise DegeneratePosesError(
            "fronto_parallel",
            f"all boards are parallel: the depth across them varies by {100 * largest:.1f} % from pose to pose, "
            f"{100 * TILT_MIN:.0f} % are needed; tilt the board by 20 to 40 degrees to the left, right, up and down",
        )
    if least < AXIS_MIN:
        raise DegeneratePosesError(
            "one_axis",
            "all boards are tilted about one axis; tilt the board to the left and right, and up and down",
        )
    if found.depth_range < DEPTH_RANGE_MIN:
        raise DegeneratePosesError(
            "one_depth",
            f"all boards are near one depth: distances differ by {100 * found.depth_range:.1f} %, "
            f"{100 * DEPTH_RANGE_MIN:.0f} % are needed; hold some nearer and some farther, over the whole depth range",
        )
    return found
