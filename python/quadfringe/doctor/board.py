"""The points of a calibration board as a shot measures them, compared with the board and with the camera alone."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.detect import View, find_target
from quadfringe.calibration.targets import Target
from quadfringe.config import Device
from quadfringe.data import AnyShot, Shape, xyz_mm_of
from quadfringe.decoding import Plan
from quadfringe.decoding.stages import linear_light
from quadfringe.doctor._params import AROUND, AROUND_PIXELS_MIN, FULL_RATIO, POINTS_MIN
from quadfringe.doctor.flatness import Flatness, flatness_of, robust_fit
from quadfringe.errors import InputError

__all__ = ["BoardPoints", "board_image", "measure_board"]

Array = NDArray[np.float64]
FREE = 11  # parameters of quadratic residuals (3 x 6) that a motion and a scale (7) do not take


@dataclass(frozen=True)
class BoardPoints:
    """The decoded points of a board against its known points.

    reprojection_px: RMS distance in the image between the points that were found and those of the board, in the pose
    that fits them best with the camera alone.
    scale_percent, scale_sd_percent: decoded over known lengths less 1, and its standard deviation.
    form_mm, form_sd_mm: RMS of the smooth part of what a motion and a scale leave, and what chance makes of it.
    scatter_mm: RMS of the rest. nearer_percent: how much nearer the decoded points are than the pose of the camera.
    points: those that were compared. plate: the board as a flat plate.
    """

    reprojection_px: float
    scale_percent: float
    scale_sd_percent: float
    form_mm: float
    form_sd_mm: float
    scatter_mm: float
    nearer_percent: float
    points: int
    plate: Flatness


def measure_board(shot: AnyShot, shape: Shape, plan: Plan, target: Target) -> BoardPoints:
    """Find the board in a decoded shot and compare its points.

    Raises `TargetNotFoundError` with the reason, and `InputError` without a calibration or when too little of the board
    is decoded.
    """
    view = find_target(board_image(shot, shape, plan), target, 1.0)
    board_mm = target.points_mm[view.ids]
    plate = flatness_of(shape, _inside(view, shape.phase_rad.shape))
    seen_mm = _points(np.where(plate.displaced[:, :, None], np.nan, xyz_mm_of(shape)), view)
    known = np.isfinite(seen_mm).all(axis=1)
    if (count := int(known.sum())) < POINTS_MIN:
        raise InputError(f"board: {count} of its points are decoded, {POINTS_MIN} are needed; light it better")
    assert shape.calibration is not None, "a shape with points has a calibration"
    posed = _posed(view, board_mm, shape.calibration.camera)
    fitted = _fitted(board_mm[known], seen_mm[known])
    depth = posed.points_mm[known, 2]
    return BoardPoints(
        reprojection_px=posed.rms_px,
        scale_percent=100 * (fitted.scale - 1),
        scale_sd_percent=100 * fitted.scale_sd,
        form_mm=fitted.form_mm,
        form_sd_mm=fitted.scatter_mm * float(np.sqrt(FREE / count)),
        scatter_mm=fitted.scatter_mm,
        nearer_percent=100 * float(np.median(1 - seen_mm[known, 2] / depth)),
        points=count,
        plate=plate,
    )


def board_image(shot: AnyShot, shape: Shape, plan: Plan) -> NDArray[np.float32]:
    """Give the board without fringes, (H, W) float32, paper near 1: the light over that of paper at the same column.

    The light of paper is fitted to the decoded pixels, and the column of each pixel comes from a smooth surface through
    them, so that ink, which is not decoded, has a value too.
    """
    column = _smooth_column(shape)
    light = linear_light(shot, plan.calibration)
    ratio, weight = np.zeros(column.shape), np.zeros(column.shape)
    for name, number in zip(light, plan.fringes.channel_numbers, strict=True):
        turns = 2 * np.pi * number * column / plan.projector_width_px
        place = 2 * column / plan.projector_width_px - 1
        terms = [np.ones_like(turns), place, place**2]
        terms += [wave(k * turns) for k in (1, 2) for wave in (np.cos, np.sin)]
        stacked = np.stack(terms, axis=-1)
        seen = np.nan_to_num(light[name].astype(np.float64))
        paper = stacked @ robust_fit(*_sample(stacked, seen, shape.returned & np.isfinite(light[name])))
        paper = np.maximum(paper, 0)
        ratio, weight = ratio + seen * paper, weight + paper**2
    return np.clip(ratio / np.maximum(weight, 1e-9), 0, FULL_RATIO).astype(np.float32)


def _sample(terms: Array, values: Array, chosen: NDArray[np.bool_]) -> tuple[Array, Array]:
    step = max(1, int(chosen.sum()) // 20_000)
    return terms[chosen][::step], values[chosen][::step]


def _smooth_column(shape: Shape) -> Array:
    """Give the projector column of every pixel, (H, W), by a cubic surface through those of the plate."""
    rows, columns = (np.linspace(-1, 1, size) for size in shape.phase_rad.shape)
    x, y = np.meshgrid(columns, rows)
    terms = np.stack([x**i * y**j for i in range(4) for j in range(4 - i)], axis=-1)
    known = shape.returned
    if int(known.sum()) < POINTS_MIN:
        raise InputError("board: the shot has no decoded pixels; examine it without --board first")
    found = robust_fit(*_sample(terms, shape.column_px.astype(np.float64), known))
    return np.asarray(terms @ found)


def _inside(view: View, size: tuple[int, ...]) -> NDArray[np.bool_]:
    """Mark the pixels (H, W) between the outer points of the board."""
    hull = cv2.convexHull(view.points_px.astype(np.float32)).round().astype(np.int32)
    mask = np.zeros(size, np.uint8)
    cv2.fillConvexPoly(mask, hull, 1)
    return mask.astype(bool)


def _points(xyz_mm: NDArray[np.floating], view: View) -> Array:
    """Give the decoded place (n, 3) of each point of the board, mm, by a plane through the decoded pixels around it."""
    nearest = np.sort(np.linalg.norm(view.points_px[:, None] - view.points_px, axis=2), axis=1)[:, 1]
    found = np.full((len(view.points_px), 3), np.nan)
    for i, (place, reach) in enumerate(zip(view.points_px, AROUND * nearest, strict=True)):
        low = np.maximum(np.floor(place - reach).astype(int), 0)
        high = np.ceil(place + reach).astype(int) + 1
        patch = np.asarray(xyz_mm[low[1] : high[1], low[0] : high[0]], np.float64)
        y, x = np.nonzero(np.isfinite(patch).all(axis=2))
        if len(x) < AROUND_PIXELS_MIN:
            continue
        points = patch[y, x]
        # Over a plane, 1 / z, x / z and y / z are linear in the image, but for the distortion of the lens nearby.
        terms = np.stack([np.ones(len(x)), x + low[0] - place[0], y + low[1] - place[1]], axis=1)
        inverse = robust_fit(terms, 1 / points[:, 2])[0]
        rays = np.linalg.lstsq(terms, points[:, :2] / points[:, 2:], rcond=None)[0][0]
        found[i] = (rays[0] / inverse, rays[1] / inverse, 1 / inverse)
    return found


@dataclass(frozen=True)
class _Posed:
    """Points of the board (n, 3) where the camera alone puts them, mm, and the RMS distance in the image, px."""

    points_mm: Array
    rms_px: float


def _posed(view: View, board_mm: Array, camera: Device) -> _Posed:
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    lens = np.array(camera.distortion)
    _, turn, move = cv2.solvePnP(board_mm, view.points_px, matrix, lens)
    seen = cv2.projectPoints(board_mm, turn, move, matrix, lens)[0].reshape(-1, 2)
    off = np.linalg.norm(seen - view.points_px, axis=1)
    return _Posed(board_mm @ cv2.Rodrigues(turn)[0].T + move.ravel(), float(np.sqrt(np.mean(off**2))))


@dataclass(frozen=True)
class _Fitted:
    """A motion with scale from the board to the decoded points, and what it leaves, smooth and scattered: RMS, mm."""

    scale: float
    scale_sd: float
    form_mm: float
    scatter_mm: float


def _fitted(board_mm: Array, seen_mm: Array) -> _Fitted:
    """Fit by least squares (Umeyama's closed form), and split what is left into a quadratic surface and the rest."""
    centred, seen = board_mm - board_mm.mean(axis=0), seen_mm - seen_mm.mean(axis=0)
    left, _, right = np.linalg.svd(seen.T @ centred)
    turn = left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right
    spread = float((centred**2).sum())
    scale = float(np.sum((centred @ turn.T) * seen)) / spread
    rest = seen - scale * centred @ turn.T
    u, v = centred[:, 0] / np.abs(centred).max(), centred[:, 1] / np.abs(centred).max()
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)
    smooth = terms @ np.linalg.lstsq(terms, rest, rcond=None)[0]
    degrees = max(3 * len(rest) - 7 - FREE, 1)
    scatter = float(np.sqrt(((rest - smooth) ** 2).sum() / degrees))  # of one coordinate
    return _Fitted(scale, scatter / np.sqrt(spread), float(np.sqrt((smooth**2).sum(axis=1).mean())), scatter)
