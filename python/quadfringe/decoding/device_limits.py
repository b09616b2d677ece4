"""Whether the numbers of a calibration can be those of a camera and a projector, before any shape is looked at.

A number that is too large, too small or in another unit gives depths that look sound. What lenses and benches allow
is known: fields of view, principal points, lens distortion, and the distance between the devices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Device, brief
from quadfringe.data import Calibration
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause

__all__ = ["PairOffset", "impossible_devices", "pair_offset"]

CORRECT = "correct the calibration, or calibrate again: quadfringe calibrate"
MILLIMETRES = "give translation_mm in mm: multiply it by {factor} if it is in {unit}"
FARTHEST = 1e6  # focal lengths from the principal point; farther ones, of a wrong calibration, would overflow
DEVICES_KEPT = 64  # whose findings are kept: every decode asks for those of two or three
RADII = 33  # radii at which a lens model is evaluated: it is a polynomial of degree 7


@dataclass(frozen=True)
class PairOffset:
    """Pose of the infrared relative to the visible projector: angle in degrees, distance in mm."""

    angle_deg: float
    shift_mm: float


@lru_cache(maxsize=DEVICES_KEPT)
def pair_offset(visible: Device, infrared: Device) -> PairOffset:
    """Give the rotation and the translation between two projectors."""
    turn = np.array(infrared.rotation) @ np.array(visible.rotation).T
    shift = np.array(infrared.translation_mm) - turn @ np.array(visible.translation_mm)
    cos = np.clip((np.trace(turn) - 1) / 2, -1, 1)
    return PairOffset(float(np.degrees(np.arccos(cos))), _length(shift))


def impossible_devices(calibration: Calibration, *, coaxial: bool) -> list[Cause]:
    """Name numbers of a calibration that no bench has, those that refuse a shape first.

    `coaxial` says that the infrared projector is taken as coaxial with the visible one.
    """
    devices = {"camera": calibration.camera, "projector": calibration.projector, "infrared": calibration.infrared}
    found = [cause for name, device in devices.items() if device is not None for cause in _impossible(name, device)]
    found += [*_distance(calibration), *(_apart(calibration) if coaxial else ())]
    return sorted(found, key=lambda cause: not cause.fatal)


@lru_cache(maxsize=DEVICES_KEPT)
def _impossible(name: str, device: Device) -> tuple[Cause, ...]:
    return (*_focal(name, device), *_centre(name, device), *_lens(name, device))


def _focal(name: str, device: Device) -> list[Cause]:
    size, (along_x, along_y) = max(device.width_px, device.height_px), device.focal_px
    low, high = (limit * size for limit in params.FOCAL_SIZES)
    found = []
    if not low <= min(device.focal_px) <= max(device.focal_px) <= high:
        words = f"{name}.focal_px is {along_x:.6g}, {along_y:.6g}; lenses for {size} px have {low:.0f} to {high:.0f} px"
        fix = f"give it in pixels: the focal length in mm divided by the pixel size in mm; {CORRECT}"
        found.append(Cause("calibration focal length", words, fix))
    elif max(along_x / along_y, along_y / along_x) > params.FOCAL_ASPECT:
        words = f"{name}.focal_px is {along_x:.6g} along x and {along_y:.6g} along y, which no lens has"
        found.append(Cause("calibration focal length", words, CORRECT))
    return found


def _centre(name: str, device: Device) -> list[Cause]:
    column, row = device.centre_px
    halves = np.array((device.width_px, device.height_px)) / 2
    away, exchanged = (
        np.abs((np.array(centre) - (halves - 0.5)) / halves) for centre in ((column, row), (row, column))
    )
    if away.max() > params.CENTRE_HALVES:
        words = (
            f"{name}.centre_px is {column:.6g}, {row:.6g}, far outside the {device.width_px} x {device.height_px} px"
        )
        return [Cause("calibration principal point", words, CORRECT)]
    # Projectors that shine upwards have it anywhere along y.
    if away[0] > params.CENTRE_ASIDE and exchanged[0] < params.CENTRE_EXCHANGED * away[0]:
        words = f"{name}.centre_px is {column:.6g}, {row:.6g}; {row:.6g}, {column:.6g} would be in the middle of the "
        words += f"{device.width_px} columns: x and y seem to be exchanged"
        return [Cause("calibration principal point", words, f"give the column first; {CORRECT}", fatal=False)]
    return []


def _lens(name: str, device: Device) -> list[Cause]:
    """Find a lens model that folds the image over, or bends it more than any lens does."""
    r, area = _radii(device)
    k1, k2, p1, p2, k3 = device.distortion
    with np.errstate(over="ignore", invalid="ignore"):
        moved = np.abs(k1 * r**2 + k2 * r**4 + k3 * r**6) + 3 * r * np.hypot(p1, p2)
        growth = 1 + 3 * k1 * r**2 + 5 * k2 * r**4 + 7 * k3 * r**6
    folded = float(area[~((growth > 0) & (moved < 1))].sum())
    bent = float(area[~(moved <= params.BENT_ALL + params.BENT_WIDE * r**2)].sum())
    if max(folded, bent) <= params.WARNED_SHARE:
        return []
    shares = {
        f"folds over, or more than doubles, {folded:.0%} of the image": folded,
        f"bends {bent:.0%} of the image more than a fisheye lens": bent,
    }
    told = " and ".join(words for words, share in shares.items() if share > params.WARNED_SHARE)
    words = f"{name}.distortion {brief(device.distortion)} {told}"
    return [Cause("calibration distortion", words, CORRECT, fatal=folded > params.REFUSED_SHARE)]


def _radii(device: Device) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give radii from the principal point to the farthest corner, in focal lengths, and the share of each in area."""
    last, centre = np.array((device.width_px, device.height_px)) - 1.0, np.array(device.centre_px)
    reach = np.hypot(*(np.maximum(np.abs(centre), np.abs(last - centre)) / np.array(device.focal_px)))
    r = np.linspace(0, min(float(reach), FARTHEST), RADII)
    return r, r / max(r.sum(), 1e-300)


def _distance(calibration: Calibration) -> list[Cause]:
    """Find a unit other than mm; a calibration that records the depths of its boards is judged by those."""
    apart = _length(np.array(calibration.projector.translation_mm))
    low, doubtful, high = params.BASELINES_MM
    words = f"the calibration puts the projector {apart:.3g} mm from the camera"
    if apart > high:
        fix = MILLIMETRES.format(factor="0.001", unit="um")
        return [Cause("calibration units", f"{words}, farther than any bench", fix)]
    if 0 < apart < low:
        fix = MILLIMETRES.format(factor="1000", unit="m")
        return [Cause("calibration units", f"{words}, nearer than their lenses allow", fix)]
    if low <= apart < doubtful and calibration.record is None:
        fix = MILLIMETRES.format(factor="10", unit="cm")
        return [Cause("calibration units", f"{words}, nearer than most lenses allow", fix, fatal=False)]
    return []


def _apart(calibration: Calibration) -> list[Cause]:
    if calibration.infrared is None:
        return []
    offset = pair_offset(calibration.projector, calibration.infrared)
    if offset.angle_deg <= params.PAIR_DEG and offset.shift_mm <= params.PAIR_MM:
        return []
    words = f"the calibration puts the infrared projector {offset.shift_mm:.3g} mm and {offset.angle_deg:.2g} degrees "
    words += "away from the visible one, and the fringe orders of this shot fit a coaxial pair"
    return [Cause("calibration pair", words, CORRECT, fatal=False)]


def _length(vector: NDArray[np.float64]) -> float:
    return float(
        np.hypot(np.hypot(vector[0], vector[1]), vector[2])
    )  # hypot does not overflow, unlike a sum of squares
