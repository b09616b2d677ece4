"""Where the points of a board are seen in an image, or in plain words why they are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._centres import refined_centres
from quadfringe.calibration._grid import blobs, homography, in_grid_order, jacobians, symmetries, through
from quadfringe.calibration.targets import Target
from quadfringe.errors import CalibrationError, InputError
from quadfringe.io.images import full_scale as full_scale_of

__all__ = ["TargetNotFoundError", "View", "find_target"]

Points = NDArray[np.float64]
CORNERS_MIN = 8  # of a ChArUco board: less says little about a pose
DARK, FLAT = 0.06, 0.05  # shares of full scale
SATURATED, FULL = 0.25, 0.999  # share of the image that has this share of full scale
SMOOTHING_PX = (1.0, 2.0, 0.5)
SHARP = 0.08  # steepest edges, as a share of the contrast per pixel
MARK_MIN = 0.35  # darkness of a mark, where solid ink has 1


class TargetNotFoundError(CalibrationError):
    """A view without a usable board.

    `reason` is dark, saturated, low_contrast, blurred, partial, mirrored or not_found.
    """


@dataclass(frozen=True)
class View:
    """Points of a target in one image.

    `points_px` (n, 2) float64 are the images (x, y) of the points themselves, free of what perspective does to the
    middles of rings; `ids` (n,) are their indices in `target.points_mm`; `size_px` is (width, height).
    """

    points_px: Points
    ids: NDArray[np.intp]
    size_px: tuple[int, int]


def find_target(image: NDArray[Any], target: Target, full_scale: float | None = None) -> View:
    """Find the points of a target in an image (H, W), or (H, W, 3) whose mean is taken; uint8, uint16 or float32.

    `full_scale` is the value of a full pixel; when absent it is 255, 65535 or 1 by dtype. Ring and circle boards must
    be seen whole, a ChArUco board may be seen in part. Raises `TargetNotFoundError` with the reason and the cure, and
    `InputError` for an array that is no image.

    >>> from quadfringe.calibration.targets import raster, ring_board
    >>> board = ring_board()
    >>> view = find_target(0.9 - 0.8 * raster(board, texel_mm=0.3), board)
    >>> view.points_px.shape
    (108, 2)
    """
    grey = _grey(image, full_scale)
    _exposed(grey)
    low, high = np.percentile(grey, (0.5, 99.5))
    stretched = np.clip((grey - low) * (255 / (high - low)), 0, 255).astype(np.uint8)
    if target.kind == "charuco":
        return _charuco(grey, stretched, target)
    ordered = _ordered(grey, stretched, target)
    if not _is_sharp(stretched):
        raise TargetNotFoundError("blurred", f"all points are found, but {BLURRED}")
    centres = refined_centres(grey, target, _turned(grey, target, ordered))
    if not np.isfinite(centres).all():
        lost = int((~np.isfinite(centres).all(axis=1)).sum())
        raise TargetNotFoundError("partial", f"{lost} of {len(centres)} points touch the border of the image; {WHOLE}")
    return View(centres, np.arange(len(centres)), (grey.shape[1], grey.shape[0]))


WHOLE = "the whole board must be in the picture, with its white border, and nothing may cover it"


def _grey(image: NDArray[Any], full_scale: float | None) -> NDArray[np.float32]:
    if image.ndim not in (2, 3) or image.dtype.name not in ("uint8", "uint16", "float32") or image.size == 0:
        raise InputError(
            f"expected an image (H, W) or (H, W, 3), uint8, uint16 or float32, got {image.dtype} {image.shape}"
        )
    top = float(full_scale_of(image)) if full_scale is None else full_scale
    grey = image.astype(np.float32) if image.ndim == 2 else image.mean(axis=2, dtype=np.float32)
    if not np.isfinite(grey).all():
        raise InputError("the image has values that are not finite; give an image, not a map")
    return grey / np.float32(top)


def _exposed(grey: NDArray[np.float32]) -> None:
    """Refuse images in which no board can be seen, whatever is in them."""
    low, high = np.percentile(grey, (0.5, 99.5))
    if high < DARK:
        raise TargetNotFoundError(
            "dark", f"the image is dark: its bright parts have {100 * high:.0f} % of full scale; expose longer"
        )
    if high - low < FLAT:
        raise TargetNotFoundError(
            "low_contrast",
            f"bright and dark differ by {100 * (high - low):.0f} % of full scale; more light on the board",
        )


def _ordered(grey: NDArray[np.float32], stretched: NDArray[np.uint8], target: Target) -> Points:
    """Give the blobs in grid order; noise is smoothed as far as needed and no farther, for small holes close."""
    import cv2

    most = 0
    for sigma_px in SMOOTHING_PX:
        places = blobs(cv2.GaussianBlur(stretched, (0, 0), sigma_px), target)
        ordered, count = in_grid_order(places, target)
        if ordered is not None:
            return ordered
        most = max(most, count)
    raise _diagnosed(grey, stretched, target, most)


def _diagnosed(
    grey: NDArray[np.float32], stretched: NDArray[np.uint8], target: Target, count: int
) -> TargetNotFoundError:
    """Say why no grid was found."""
    share = float((grey >= FULL).mean())
    if share > SATURATED:
        return TargetNotFoundError(
            "saturated",
            f"{100 * share:.0f} % of the image is saturated; expose shorter, or turn the board out of glare",
        )
    expected, name = target.rows * target.columns, "rings" if target.kind == "rings" else "discs"
    if not _is_sharp(stretched):
        return TargetNotFoundError("blurred", f"{count} of {expected} {name} found, and {BLURRED}")
    if count >= expected // 4:
        return TargetNotFoundError("partial", f"{count} of {expected} {name} found; {WHOLE}")
    return TargetNotFoundError(
        "not_found",
        f"{count} of {expected} {name} found; is it this board ({_named(target)}), flat and in the picture?",
    )


BLURRED = "no edge is sharp; focus the lens, hold the board still"


def _is_sharp(stretched: NDArray[np.uint8]) -> bool:
    """Tell whether any edges rise within some five pixels."""
    import cv2

    soft = cv2.GaussianBlur(stretched, (0, 0), 1.0).astype(np.float32) / 255
    slope = np.hypot(cv2.Sobel(soft, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(soft, cv2.CV_32F, 0, 1, scale=1 / 8))
    return bool(np.quantile(slope, 0.995) >= SHARP)


def _named(target: Target) -> str:
    return f"{target.rows} x {target.columns} {target.kind}"


def _turned(grey: NDArray[np.float32], target: Target, places: Points) -> Points:
    """Give the places in the target's own order, chosen among its symmetries by its marks.

    Without marks a turn by 180 degrees cannot be told: rows are then taken to run to the right.
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
            "the two marks in the first cells of the board are not seen; free them, or state that it has none",
        )
    if not upright[best]:
        raise TargetNotFoundError(
            "mirrored",
            "the board is seen mirrored; switch off the mirroring of the camera, or print it the right way round",
        )
    return choices[best]


def _mark_darkness(grey: NDArray[np.float32], target: Target, matrix: Points) -> float:
    """Darkness of the lighter mark, between 0 for paper and 1 for ink, as this homography places the marks."""
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
    """Median of the image at points of the board."""
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
                "mirrored", "the board is seen mirrored; switch off the mirroring of the camera, or print it again"
            )
        seen = (0 if ids is None else len(ids), 0 if markers is None else len(markers))
        raise TargetNotFoundError(
            "partial" if seen[1] else "not_found",
            f"{seen[0]} corners and {seen[1]} markers of a ChArUco board of {_named(target)} found, at least "
            f"{CORNERS_MIN} corners are needed; show more of it, nearer, sharper, or check its dictionary",
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
        raise TargetNotFoundError("partial", "all corners found lie on one line; show more of the board")


def _corner_window_px(target: Target, chosen: NDArray[np.intp], places: Points) -> int:
    """Half window around a corner: most of the way to the markers beside it, at the smallest scale of the view."""
    matrix = homography(target.points_mm[chosen, :2], places)
    slopes = jacobians(matrix, target.points_mm[chosen, :2])
    scale = float(np.linalg.svd(slopes, compute_uv=False)[:, 1].min())
    gap_mm = 0.5 * (target.pitch_mm - (target.marker_mm or 0.0))
    return int(np.clip(0.9 * scale * gap_mm, 2, 12))
