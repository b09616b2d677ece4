"""Detection of a calibration board: the image points of the board, or the reason why they were not found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._centres import refined_centres
from quadfringe.calibration._grid import blobs, homography, in_grid_order, jacobians, symmetries, through
from quadfringe.calibration._params import (
    CONTRAST_MIN,
    CORNERS_MIN,
    DARK,
    FULL,
    MARK_MIN,
    SATURATED_SHARE,
    SHARP,
    SMOOTHING_PX,
)
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError, InputError
from quadfringe.io.images import full_scale as full_scale_of

__all__ = ["TargetNotFoundError", "View", "find_target"]

Points = NDArray[np.float64]
WHOLE = "show the whole board with its white border, and leave nothing in front of it"
BLURRED = "no edge is sharp: focus the lens and hold the board still"


class TargetNotFoundError(CalibrationError):
    """The board was not found in a view, or cannot be used.

    `reason` is dark, saturated, low_contrast, blurred, partial, mirrored or not_found.
    """


@dataclass(frozen=True)
class View:
    """The points of a board in one image.

    `points_px` (n, 2) float64 are the positions (x, y) of the board points, corrected for the perspective shift of ring
    centres; `ids` (n,) are their indices in `target.points_mm`; `size_px` is (width, height).
    """

    points_px: Points
    ids: NDArray[np.intp]
    size_px: tuple[int, int]


def find_target(image: NDArray[Any], target: Target, full_scale: float | None = None) -> View:
    """Find the points of a board in an image (H, W), or in the mean of (H, W, 3); uint8, uint16 or float32.

    `full_scale` is the value of a saturated pixel; by default 255, 65535 or 1, after the dtype. Ring and circle boards
    must be visible as a whole, a ChArUco board may be visible in part. Raises `TargetNotFoundError` with the reason and
    the remedy, and `InputError` for an array that is no image.

    >>> from quadfringe.calibration.targets import raster, ring_board
    >>> board = ring_board()
    >>> view = find_target(0.9 - 0.8 * raster(board, texel_mm=0.3), board)
    >>> view.points_px.shape
    (108, 2)
    """
    grey = _grey(image, full_scale)
    _check_exposure(grey)
    low, high = np.percentile(grey, (0.5, 99.5))
    stretched = np.clip((grey - low) * (255 / (high - low)), 0, 255).astype(np.uint8)
    if target.kind == "charuco":
        return _charuco(grey, stretched, target)
    ordered = _ordered(grey, stretched, target)
    if not _is_sharp(stretched):
        raise TargetNotFoundError("blurred", f"all points were found, but {BLURRED}")
    centres = refined_centres(grey, target, _turned(grey, target, ordered))
    if not np.isfinite(centres).all():
        lost = int((~np.isfinite(centres).all(axis=1)).sum())
        raise TargetNotFoundError("partial", f"{lost} of {len(centres)} points touch the border of the image; {WHOLE}")
    return View(centres, np.arange(len(centres)), (grey.shape[1], grey.shape[0]))


def _grey(image: NDArray[Any], full_scale: float | None) -> NDArray[np.float32]:
    if image.ndim not in (2, 3) or image.dtype.name not in ("uint8", "uint16", "float32") or image.size == 0:
        raise InputError(
            f"image: expected (H, W) or (H, W, 3) of uint8, uint16 or float32, got {image.shape} of {image.dtype}"
        )
    top = float(full_scale_of(image)) if full_scale is None else full_scale
    grey = image.astype(np.float32) if image.ndim == 2 else image.mean(axis=2, dtype=np.float32)
    if not np.isfinite(grey).all():
        raise InputError("image: expected finite values, got NaN or infinity; pass a camera image, not a result map")
    return grey / np.float32(top)


def _check_exposure(grey: NDArray[np.float32]) -> None:
    """Raise `TargetNotFoundError` for an image too dark or too flat for any detection."""
    low, high = np.percentile(grey, (0.5, 99.5))
    if high < DARK:
        raise TargetNotFoundError(
            "dark", f"the image is dark: its bright parts reach {100 * high:.0f} % of full scale; expose longer"
        )
    if high - low < CONTRAST_MIN:
        raise TargetNotFoundError(
            "low_contrast",
            f"bright and dark parts differ by {100 * (high - low):.0f} % of full scale only; put more light on the "
            "board",
        )


def _ordered(grey: NDArray[np.float32], stretched: NDArray[np.uint8], target: Target) -> Points:
    """Return the blobs in grid order, with as little smoothing as the noise permits, because it closes small holes."""
    import cv2

    most = 0
    for sigma_px in SMOOTHING_PX:
        places = blobs(cv2.GaussianBlur(stretched, (0, 0), sigma_px), target)
        ordered = in_grid_order(places, target)
        if ordered.places is not None:
            return ordered.places
        most = max(most, ordered.found)
    raise _diagnosed(grey, stretched, target, most)


def _diagnosed(
    grey: NDArray[np.float32], stretched: NDArray[np.uint8], target: Target, count: int
) -> TargetNotFoundError:
    """Return the error that names the likely reason why no grid was found."""
    share = float((grey >= FULL).mean())
    if share > SATURATED_SHARE:
        return TargetNotFoundError(
            "saturated",
            f"{100 * share:.0f} % of the image is saturated; shorten the exposure, or tilt the board out of the glare",
        )
    expected, name = target.rows * target.columns, "rings" if target.kind == "rings" else "discs"
    if not _is_sharp(stretched):
        return TargetNotFoundError("blurred", f"{count} of {expected} {name} found; {BLURRED}")
    if count >= expected // 4:
        return TargetNotFoundError("partial", f"{count} of {expected} {name} found; {WHOLE}")
    return TargetNotFoundError(
        "not_found",
        f"{count} of {expected} {name} found; show this board ({_named(target)}), flat and whole",
    )


def _is_sharp(stretched: NDArray[np.uint8]) -> bool:
    """Return whether the steepest edges are at least as steep as `SHARP`."""
    import cv2

    soft = cv2.GaussianBlur(stretched, (0, 0), 1.0).astype(np.float32) / 255
    slope = np.hypot(cv2.Sobel(soft, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(soft, cv2.CV_32F, 0, 1, scale=1 / 8))
    return bool(np.quantile(slope, 0.995) >= SHARP)


def _named(target: Target) -> str:
    return f"{target.rows} x {target.columns} {target.kind}"


def _turned(grey: NDArray[np.float32], target: Target, places: Points) -> Points:
    """Return the places in the order of the target's points, using its marks to choose among its symmetries.

    Without marks, a rotation by 180 degrees is ambiguous; rows are then assumed to run to the right.
    """
    choices = [places[order] for order in symmetries(target)]
    points = target.points_mm[:, :2]
    matrices = [homography(points, choice) for choice in choices]
    upright = [np.linalg.det(jacobians(m, points.mean(axis=0))) > 0 for m in matrices]
    if not target.marks:
        proper = [choice for choice, up in zip(choices, upright, strict=True) if up]
        return max(proper, key=lambda choice: choice[target.columns - 1, 0] - choice[0, 0])
    darkness = [_mark_darkness(grey, target, m) for m in matrices]
    best = int(np.argmax(darkness))
    if darkness[best] < MARK_MIN:
        raise TargetNotFoundError(
            "not_found",
            "the two marks in the first cells of the board are not visible; uncover them, or set marks to false",
        )
    if not upright[best]:
        raise TargetNotFoundError(
            "mirrored",
            "the board appears mirrored; switch off the mirroring of the camera, or print the board unmirrored",
        )
    return choices[best]


def _mark_darkness(grey: NDArray[np.float32], target: Target, matrix: Points) -> float:
    """Return the darkness of the lighter mark, from 0 for paper to 1 for ink, where this homography puts the marks."""
    outer_mm = 0.5 * (target.diameter_mm or 0.0)
    inked_mm = 0.5 * outer_mm + 0.25 * (target.hole_mm or 0.0)
    found = []
    for mark in target.mark_points_mm:
        level = _level(grey, matrix, mark[None])
        away = target.points_mm[:, :2] - mark
        near = np.argsort(np.linalg.norm(away, axis=1))[:4]
        ink = _level(grey, matrix, mark + away[near] + (inked_mm, 0))
        gap = 0.5 * (1 + (target.mark_mm / 2 - outer_mm) / np.linalg.norm(away[near], axis=1))
        paper = _level(grey, matrix, mark + gap[:, None] * away[near])
        found.append((paper - level) / max(paper - ink, 1e-3))
    return float(min(found))


def _level(grey: NDArray[np.float32], matrix: Points, points: Points) -> float:
    """Return the median of the image at points (n, 2) of the board, mm."""
    import cv2

    places = through(matrix, points).astype(np.float32)
    return float(np.median(cv2.remap(grey, places[None], None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)))


def _charuco(grey: NDArray[np.float32], stretched: NDArray[np.uint8], target: Target) -> View:
    import cv2

    detector = cv2.aruco.CharucoDetector(target.charuco())
    corners, ids, _, markers = detector.detectBoard(stretched)
    if ids is None or len(ids) < CORNERS_MIN:
        _, mirrored, _, _ = detector.detectBoard(np.ascontiguousarray(stretched[:, ::-1]))
        if mirrored is not None and len(mirrored) >= CORNERS_MIN:
            raise TargetNotFoundError(
                "mirrored",
                "the board appears mirrored; switch off the mirroring of the camera, or print the board unmirrored",
            )
        seen = (0 if ids is None else len(ids), 0 if markers is None else len(markers))
        raise TargetNotFoundError(
            "partial" if seen[1] else "not_found",
            f"{seen[0]} corners and {seen[1]} markers of a {_named(target)} board found, at least {CORNERS_MIN} "
            "corners "
            "are needed; show more of the board, move it nearer, focus, or check its dictionary",
        )
    chosen = ids.ravel().astype(np.intp)
    places = np.asarray(corners, np.float32).reshape(-1, 1, 2)
    _not_on_a_line(target.points_mm[chosen, :2])
    ending = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
    half = _corner_window_px(target, chosen, places.reshape(-1, 2).astype(np.float64))
    refined = cv2.cornerSubPix(grey, places, (half, half), (-1, -1), ending)
    return View(refined.reshape(-1, 2).astype(np.float64), chosen, (grey.shape[1], grey.shape[0]))


def _not_on_a_line(points: Points) -> None:
    if np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1] < 1e-6:
        raise TargetNotFoundError("partial", "all corners that were found lie on one line; show more of the board")


def _corner_window_px(target: Target, chosen: NDArray[np.intp], places: Points) -> int:
    """Return the half window around a corner, px: most of the way to the adjacent markers, at the smallest scale."""
    matrix = homography(target.points_mm[chosen, :2], places)
    slopes = jacobians(matrix, target.points_mm[chosen, :2])
    scale = float(np.linalg.svd(slopes, compute_uv=False)[:, 1].min())
    gap_mm = 0.5 * (target.pitch_mm - (target.marker_mm or 0.0))
    return int(np.clip(0.9 * scale * gap_mm, 2, 12))
