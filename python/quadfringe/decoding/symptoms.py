"""Figures of a shot that need no decoding: bits in use, light, sharpness, and shifts of the infrared image along y."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot
from quadfringe.decoding import params
from quadfringe.decoding.given import saturated_from
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.stages import carrier, linear_light

__all__ = [
    "Bits",
    "bits_in_use",
    "brightness",
    "linear_light_of",
    "rows_match",
    "saturation",
]

Map = NDArray[np.float32]
DEPTHS = (8, 10, 12, 14)  # bits that cameras deliver in 16-bit files


@dataclass(frozen=True)
class Bits:
    """The bits that 16-bit data hold, whether less light would not explain it as well, and the largest value.

    `exact` if crests are cut off there; else a brighter shot of the same camera may need more bits.
    """

    held: int
    sure: bool
    top: int
    exact: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class RowsMatch:
    """Shift of the infrared image along y, px, and its correlation with the visible one, moved along x and not."""

    shift_px: float
    moved: float
    still: float


def bits_in_use(shot: AnyShot) -> Bits | None:
    """Give the bits of the camera when 16-bit data have fewer and count as 16; None when nothing is wrong.

    Crests cut off at the largest value of some bits show these. Else it is the fewest bits of a camera that hold all
    values; 14 are not sure, because a quarter of the light looks the same.
    """
    if shot.first.dtype != np.uint16 or shot.full_scale_value < np.iinfo(np.uint16).max:
        return None
    top = max(int(image.max()) for image in shot.images.values())
    width = top.bit_length()
    if 8 <= width < 16 and top == 2**width - 1 and sum(np.count_nonzero(i == top) for i in shot.images.values()) > 1:
        return Bits(width, True, top, exact=True)
    held = next((bits for bits in DEPTHS if 0 < top < 2**bits), None)
    return None if held is None else Bits(held, held <= params.SURE_BITS, top)


def brightness(shot: AnyShot) -> dict[str, float]:
    """Give the brightest hundredth of what is lit of each channel, share of full scale.

    Of a dark frame, a hundredth may be half of the object. A mean over a fringe leaves out noise and single hot pixels.
    """
    import cv2

    found = {}
    for name, image in shot.channels.items():
        sample = image[::4, ::4].astype(np.float32)
        mean = cv2.GaussianBlur(sample, (0, 0), params.MEAN_PX / 4)
        lit = mean > params.LIT_SHARE * np.quantile(mean, 0.99)
        found[name] = float(np.quantile(sample[lit], 0.99)) / shot.full_scale_value
    return found


def saturation(shot: AnyShot) -> dict[str, float]:
    """Give the share of saturated pixels of each channel, in some of the rows."""
    level = saturated_from(shot)
    rows = {name: image[:: params.SATURATED_ROWS] for name, image in shot.channels.items()}
    return {name: np.count_nonzero(image >= level) / image.size for name, image in rows.items()}


def rows_match(shot: AnyShot, plan: Plan, columns_px: float) -> RowsMatch | None:
    """Compare infrared with visible rows, once infrared is moved back by `columns_px`, from detail along y.

    A mean over a fringe along x takes the fringes out and keeps detail along y. None when there is none in common.
    """
    import cv2

    light = linear_light_of(shot, plan)
    period_px, _ = carrier(np.nan_to_num(light["red"]))
    reach = params.SHIFT_MAX_PX
    if not np.isfinite(period_px) or min(light["ir"].shape) <= 4 * reach:
        return None
    visible, infrared = (
        _detail_along_y(np.nan_to_num(image), float(period_px))
        for image in (light["red"] + light["green"] + light["blue"], light["ir"])
    )
    inner = visible[reach:-reach, reach:-reach]
    moved, still = (
        cv2.matchTemplate(np.roll(infrared, -columns, axis=1)[:, reach:-reach], inner, cv2.TM_CCOEFF_NORMED)[:, 0]
        for columns in (round(columns_px), 0)
    )
    best = int(moved.argmax())
    if max(moved.max(), still.max()) < params.CORRELATION_MIN or not 0 < best < 2 * reach:
        return None
    return RowsMatch(best - reach + _peak(moved[best - 1 : best + 2]), float(moved.max()), float(still.max()))


def linear_light_of(shot: AnyShot, plan: Plan) -> dict[str, Map]:
    """Give the linear light of a shot by the response that the plan states; linear where it states none."""
    return linear_light(shot, plan.calibration, "calibration" if plan.response == "auto" else plan.response)


def _detail_along_y(image: Map, period_px: float) -> Map:
    """Give the relative brightness of detail of a few px along y, in means over about a fringe along x."""
    import cv2

    fine = cv2.GaussianBlur(image, (0, 0), sigmaX=0.6 * period_px, sigmaY=1.0)
    coarse = cv2.GaussianBlur(image, (0, 0), sigmaX=0.6 * period_px, sigmaY=5.0)
    relative: Map = (fine / np.maximum(coarse, 1e-3)).astype(np.float32)
    return relative


def _peak(three: NDArray[np.float32]) -> float:
    """Give the place of the maximum of a parabola through three values, from the middle one."""
    before, middle, after = (float(value) for value in three)
    bend = before - 2 * middle + after
    return 0.0 if bend >= 0 else 0.5 * (before - after) / bend
