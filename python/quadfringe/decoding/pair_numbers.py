"""Whether the infrared fringe number of a pair of projectors that stand apart tells fringe orders from each other.

Neighbouring orders are neighbouring depths on a camera ray. From one to the next, the infrared phase of coaxial
projectors changes by the ratio of the fringe numbers; that of a projector at another distance from the camera by this
ratio times the ratio of the distances, as if it showed another number of fringes.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Calibration, Shape
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.fringe_fit import pixels_of

__all__ = ["ambiguous_pair", "infrared_along_rays", "order_margin_rad"]

RAYS = 5  # along a side of the image
DEPTHS = (0.95, 1.05)  # of the median depth


def ambiguous_pair(shape: Shape) -> Cause | None:
    """Name an infrared fringe number with which orders are hard to tell apart along the rays of this pair."""
    config, calibration = shape.config, shape.calibration
    fringes, decode = config.get("fringes", {}), config.get("decode", {})
    plain = fringes.get("predeformed_z_mm") is None and "numbers" in fringes
    if calibration is None or shape.xyz_mm is None or decode.get("unwrapping") != "pair" or not plain:
        return None
    stride = max(1, min(shape.phase_rad.shape) // params.SAMPLES)
    depths_mm = shape.xyz_mm[::stride, ::stride, 2]
    if not np.isfinite(depths_mm).any():
        return None
    first, second, third = fringes["numbers"]
    ratio = infrared_along_rays(calibration, float(np.nanmedian(depths_mm)))
    if not np.isfinite(ratio) or order_margin_rad((first, second, ratio * third)) >= params.PAIR_MARGIN_RAD:
        return None
    better = round((first - first**0.5) / ratio)
    words = f"along the camera rays the infrared projector shows {ratio * third:.3g} fringes where red and blue show "
    words += f"{first:g} and green {second:g}, so that some orders are hard to tell apart"
    fix = f"show {better} infrared fringes: the fringe numbers {first:g}, {second:g}, {better}"
    return Cause("fringe numbers of the pair", words, fix, fatal=False)


def infrared_along_rays(calibration: Calibration, depth_mm: float) -> float:
    """Give the columns of the infrared projector for each column of the visible one along camera rays, near a depth.

    It is the median over the image, 1 for coaxial projectors, and NaN without an infrared projector.
    """
    if calibration.infrared is None:
        return float("nan")
    near, far = (_points_mm(calibration, share * depth_mm) for share in DEPTHS)
    visible, infrared = (
        pixels_of(far, device)[:, 0] - pixels_of(near, device)[:, 0]
        for device in (calibration.projector, calibration.infrared)
    )
    return float(np.median(infrared / visible))


def order_margin_rad(numbers: tuple[float, float, float]) -> float:
    """Give the least distance between the phases of two orders, rad, as the ambiguity margin of an encoding.

    Orders that are more than half of the field apart lie at depths that no scene has side by side.
    """
    first, second, third = numbers
    orders = np.arange(1, max(2, int(first / 2)))
    turns = np.stack([orders * second / first, orders * third / first])
    return float(np.hypot(*(2 * np.pi * (turns - np.round(turns)))).min(initial=np.pi))


def _points_mm(calibration: Calibration, depth_mm: float) -> NDArray[np.float64]:
    """Give the points (N, 3) at this depth on some rays of the camera."""
    camera = calibration.camera
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], float)
    columns, rows = (np.linspace(0, size - 1, RAYS) for size in (camera.width_px, camera.height_px))
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels, matrix, np.array(camera.distortion))[:, 0]
    return np.column_stack([rays * depth_mm, np.full(len(rays), depth_mm)])
