"""Registration of the two chips of a 2CCD camera: an affine map fitted to points that both chips see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import (
    REGISTRATION_OUTLIER_SD,
    REGISTRATION_POINTS_MIN,
    REGISTRATION_RMS_MAX_PX,
    REGISTRATION_SPREAD_MIN,
)
from quadfringe.calibration.detect import View
from quadfringe.config import Affine
from quadfringe.errors import DecodeError, InputError

__all__ = ["Registration", "register_infrared", "register_views"]

Array = NDArray[np.float64]
MEDIAN_TO_RMS = 1.2  # RMS length over median length of a Gaussian in the plane: sqrt(2) / 1.1774


@dataclass(frozen=True)
class Registration:
    """The affine map from visible pixel (x, y, 1) to infrared pixel (x, y), and the RMS distances before and after, px.

    `shift_px` is the shift at the centroid of the points; `scale` and `rotation_deg` belong to the nearest similarity.
    """

    ir_registration: Affine
    points: int
    left_out: int
    before_rms_px: float
    after_rms_px: float
    shift_px: tuple[float, float]
    scale: float
    rotation_deg: float
    residuals_px: Array

    @property
    def figures(self) -> dict[str, float]:
        """The distances and the parameters of the map, by name."""
        names = ("points", "left_out", "before_rms_px", "after_rms_px", "scale", "rotation_deg")
        shift = {"shift_x_px": self.shift_px[0], "shift_y_px": self.shift_px[1]}
        return {name: float(getattr(self, name)) for name in names} | shift


def register_infrared(visible_px: Array, infrared_px: Array) -> Registration:
    """Fit the affine map to points (n, 2), px, that both chips see, in the same order; pairs with NaN are ignored.

    Points more than four robust standard deviations off are left out. Raises `InputError` for fewer than 12 points or
    points nearly on a line, and `DecodeError` when no affine map aligns the two sets.
    """
    visible, infrared = np.asarray(visible_px, float), np.asarray(infrared_px, float)
    if visible.shape != infrared.shape or visible.ndim != 2 or visible.shape[1] != 2:
        raise InputError(f"registration: expected two lists of points (n, 2), got {visible.shape}, {infrared.shape}")
    both = np.isfinite(visible).all(axis=1) & np.isfinite(infrared).all(axis=1)
    visible, infrared = visible[both], infrared[both]
    _check_spread(visible)
    kept = np.ones(len(visible), bool)
    for _ in range(5):
        affine = _fit(visible[kept], infrared[kept])
        missed = infrared - _applied(affine, visible)
        away = np.linalg.norm(missed, axis=1)
        kept = away <= max(REGISTRATION_OUTLIER_SD * MEDIAN_TO_RMS * float(np.median(away[kept])), 1e-6)
    after = float(np.sqrt(np.mean(away[kept] ** 2)))
    if after > REGISTRATION_RMS_MAX_PX or kept.sum() < REGISTRATION_POINTS_MIN:
        raise DecodeError(
            f"registration: the points of the two chips still lie {after:.2f} px apart, at most "
            f"{REGISTRATION_RMS_MAX_PX} are accepted; show both chips the same board, and do not move it in between"
        )
    middle = visible[kept].mean(axis=0)
    scale, rotation = _similarity(affine)
    shift = (_applied(affine, middle[None]) - middle)[0]
    return Registration(
        ir_registration=tuple(tuple(float(v) for v in row) for row in affine),  # type: ignore[arg-type]
        points=int(kept.sum()),
        left_out=int((~kept).sum()),
        before_rms_px=float(np.sqrt(np.mean(np.sum((infrared - visible)[kept] ** 2, axis=1)))),
        after_rms_px=after,
        shift_px=(float(shift[0]), float(shift[1])),
        scale=scale,
        rotation_deg=rotation,
        residuals_px=missed[kept],
    )


def register_views(visible: Sequence[View], infrared: Sequence[View]) -> Registration:
    """Register the chips by boards that both saw in the same poses; errors as `register_infrared`."""
    seen = []
    for views in zip(visible, infrared, strict=True):
        shared = np.intersect1d(views[0].ids, views[1].ids)
        seen.append(np.stack([view.points_px[np.searchsorted(view.ids, shared)] for view in views]))
    points = np.concatenate(seen, axis=1)
    return register_infrared(points[0], points[1])


def _fit(visible: Array, infrared: Array) -> Array:
    middle = visible.mean(axis=0)
    design = np.column_stack([visible - middle, np.ones(len(visible))])
    solved = np.linalg.lstsq(design, infrared, rcond=None)[0].T
    solved[:, 2] -= solved[:, :2] @ middle
    return np.asarray(solved)


def _applied(affine: Array, points: Array) -> Array:
    return np.asarray(points @ affine[:, :2].T + affine[:, 2])


def _similarity(affine: Array) -> tuple[float, float]:
    cos, sin = (affine[0, 0] + affine[1, 1]) / 2, (affine[1, 0] - affine[0, 1]) / 2
    return float(np.hypot(cos, sin)), float(np.degrees(np.arctan2(sin, cos)))


def _check_spread(points: Array) -> None:
    if len(points) < REGISTRATION_POINTS_MIN:
        raise InputError(
            f"registration: {len(points)} points are seen by both chips, {REGISTRATION_POINTS_MIN} are needed; show "
            "the board "
            "in more poses"
        )
    lengths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if lengths[1] < REGISTRATION_SPREAD_MIN * lengths[0]:
        raise InputError("registration: the points lie nearly in a line; show the board over the whole field")
