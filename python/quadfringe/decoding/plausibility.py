"""Plausibility of a shape: whether its calibration allows what was decoded.

An opaque surface that camera and projector both see shows its front to both. From that follows the direction in which
projector columns grow in the image, whatever the surface. Points must lie before the camera, and inside the image of
the projector. A few thousand samples decide, so that the time of a decode hardly changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Calibration, Reason, Shape
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.column_direction import samples_of, unusual_direction
from quadfringe.decoding.device_limits import impossible_devices
from quadfringe.decoding.fringe_fit import pixels_of
from quadfringe.decoding.light_border import LightBorder, moved_border
from quadfringe.decoding.pair_numbers import ambiguous_pair

__all__ = ["Geometry", "calibrated_depths_mm", "geometry_of", "implausible", "mirrored", "within_depths"]

# Maps without data outside the range; quality and modulation are known wherever there is light.
BOUNDED = ("phase_rad", "column_px", "xyz_mm", "wrong_order_probability", "uncertainty_mm", "albedo")
FAR_MM = 1e9  # longer than any distance, and a number that float takes
CALIBRATE = "decode with the calibration of this bench, or calibrate again: quadfringe calibrate"
FLIP = (
    "switch off mirroring and rotation in the camera's settings, or flip the images back; if they are as the camera "
    "sees them, " + CALIBRATE
)


@dataclass(frozen=True)
class Geometry:
    """Shares of the samples of a shape that contradict its calibration, and where its points lie.

    `backwards`: columns run against the direction that the calibration demands. `nowhere`: rays do not meet before the
    camera. `across`: columns grow along the other axis of the image. `outside`: points above or below the image of the
    projector. `far`: points at several times the median depth. `tilt_deg`: angle between the normal of the surface as a
    whole and the line of sight. `depth_mm`: median.
    """

    backwards: float
    nowhere: float
    across: float
    outside: float
    far: float
    tilt_deg: float
    depth_mm: float


def geometry_of(shape: Shape) -> Geometry | None:
    """Measure a shape against its calibration; None without one, or with too few samples."""
    if shape.calibration is None or shape.xyz_mm is None:
        return None
    samples = samples_of(shape.column_px)
    if samples is None:
        return None
    returned = np.isfinite(shape.column_px[samples.here])
    points = shape.xyz_mm[samples.here]
    met = returned & np.isfinite(points[..., 2])
    along_x, along_y = samples.growth(shape.column_px)
    depth_mm = float(np.median(points[..., 2][met])) if met.sum() >= params.SAMPLES_MIN else float("nan")
    expected = _growth(np.nan_to_num(depth_mm, nan=FAR_MM), shape.calibration)
    across = _across(along_x, along_y, expected)
    if met.sum() < params.SAMPLES_MIN:
        return Geometry(0.0, 1.0, across, 0.0, 0.0, float("nan"), float("nan"))
    direction = 1.0 if expected[0] >= 0 else -1.0
    growth = along_x[met] * direction
    turns = _turns(shape.phase_rad, samples.stride)[met] * direction
    rows = pixels_of(points, shape.calibration.projector)[..., 1]
    off = np.maximum(-0.5 - rows, rows - (shape.calibration.projector.height_px - 0.5))
    tilt = _tilt_deg(points, shape.xyz_mm[samples.right], shape.xyz_mm[samples.below])
    return Geometry(
        backwards=_most_backwards(growth, turns),
        nowhere=1 - float(met.sum()) / float(returned.sum()),
        across=across,
        outside=_share(off > params.ROWS_PX, met),
        far=float(np.mean(points[..., 2][met] > params.FAR_MEDIANS * depth_mm)),
        tilt_deg=tilt,
        depth_mm=depth_mm,
    )


def _across(along_x: NDArray[np.float32], along_y: NDArray[np.float32], expected: tuple[float, float]) -> float:
    """Give the share of columns that grow along the other axis of the image than expected."""
    other = (np.abs(along_x) < np.abs(along_y)) != (abs(expected[0]) < abs(expected[1]))
    return _share(other, np.isfinite(along_x) & np.isfinite(along_y))


def _most_backwards(growth: NDArray[np.float32], turns: NDArray[np.float32]) -> float:
    """Give the share of columns that run backwards; that of their phase where most of it does, behind wrong orders."""
    columns, phase = (_share(values < 0, np.isfinite(values)) for values in (growth, turns))
    return max(columns, phase) if phase > params.REFUSED_SHARE else columns


def _turns(phase_rad: NDArray[np.float32], stride: int) -> NDArray[np.float32]:
    """Give the phase at the samples of a shape to the right of them, over a quarter of a fringe, without whole turns.

    Wrong orders, as the published method makes them of images that are mirrored, hide the direction of the columns.
    """
    reach, width = params.REACH_PX, phase_rad.shape[1]

    def step(length: int) -> NDArray[np.float32]:
        rows = np.s_[:-reach:stride]
        here, there = (
            phase_rad[rows, : width - reach : stride],
            phase_rad[rows, length : width - reach + length : stride],
        )
        turns = (there - here) / (2 * np.pi)
        return np.asarray(turns - np.round(turns), np.float32)

    one = step(1)
    one = np.abs(one[np.isfinite(one)])
    rate = float(np.median(one)) if one.size else 0.0
    return step(int(np.clip(0.25 / max(rate, 1e-6), 1, reach)))


def implausible(shape: Shape, borders: list[LightBorder]) -> list[Cause]:
    """Name what the calibration contradicts in a shape, the likeliest first; empty when nothing does.

    Without a calibration an unusual direction of the columns is all that can be named. `borders` are those of the light
    in the shape.
    """
    if shape.calibration is None or shape.xyz_mm is None:
        unusual = unusual_direction(shape)
        return [] if unusual is None else [unusual]
    devices = impossible_devices(shape.calibration, coaxial=_coaxial(shape))
    if any(cause.fatal for cause in devices):
        return devices
    doubtful = ambiguous_pair(shape)
    return [*devices, *_contradicted(shape, shape.calibration, borders), *([] if doubtful is None else [doubtful])]


def mirrored(shape: Shape) -> Cause | None:
    """Find images that are mirrored or turned; the direction of the columns shows it even where orders are wrong."""
    found = geometry_of(shape)
    return None if found is None else _backwards(found)


def _backwards(found: Geometry) -> Cause | None:
    if found.across > params.REFUSED_SHARE:
        words = f"the images are turned by 90 degrees: in {found.across:.0%} of the image the projector columns grow "
        words += "along the other axis of the image than the calibration says"
        return Cause("mirrored or rotated", words, FLIP)
    if found.backwards <= params.REFUSED_SHARE:
        return None
    words = f"fringes run backwards in {found.backwards:.0%} of the image: the calibration says that the projector "
    words += "columns grow the other way, so the images are mirrored left to right or turned by 180 degrees"
    return Cause("mirrored or rotated", words, FLIP)


def _coaxial(shape: Shape) -> bool:
    """Say whether the shape was decoded with the infrared projector as coaxial with the visible one."""
    predeformed = shape.config.get("fringes", {}).get("predeformed_z_mm") is not None
    return not predeformed and shape.config.get("decode", {}).get("unwrapping") != "pair"


def _contradicted(shape: Shape, calibration: Calibration, borders: list[LightBorder]) -> list[Cause]:
    found = geometry_of(shape)
    if found is None:
        return []
    if backwards := _backwards(found):
        return [backwards]
    if impossible := _impossible(found):
        return [*impossible, *_doubtful(found, calibration)]
    moved = moved_border(shape, borders)
    return [*([] if moved is None else [moved]), *_doubtful(found, calibration)]


def within_depths(shape: Shape, range_mm: tuple[float, float] | None) -> list[Cause]:
    """Make no data of the points of a shape outside a range of depths, in place; name it when most of them are.

    Quality and modulation are kept, as at every pixel that is not returned.
    """
    depth_mm = shape.depth_mm
    if range_mm is None or depth_mm is None:
        return []
    seen_mm = float(np.nanmedian(depth_mm[::4, ::4])) if np.isfinite(depth_mm[::4, ::4]).any() else float("nan")
    out = shape.returned & ~((depth_mm >= range_mm[0]) & (depth_mm <= range_mm[1]))
    share = _share(out, shape.returned)
    for values in (getattr(shape, name) for name in BOUNDED):
        if values is not None:
            values[out] = np.nan
    if shape.reason is not None:
        shape.reason[out] = Reason.OUT_OF_RANGE
    if share <= params.REFUSED_SHARE:
        return []
    words = f"{share:.0%} of the points lie outside the stated depths of {range_mm[0]:g} to {range_mm[1]:g} mm, at a "
    words += f"median of {seen_mm:.0f} mm, and are no data"
    return [Cause("depth range", words, f"correct depth_range_mm; or {CALIBRATE}", fatal=False)]


def calibrated_depths_mm(calibration: Calibration) -> tuple[float, float] | None:
    """Give the least and largest depth of the boards that a calibration was made from, if its record holds them."""
    steps = () if calibration.record is None else calibration.record.steps
    poses = [pose for step in steps if step.name == "poses" for pose in step.settings.values()]
    placed: list[Any] = [pose.get("T_camera_board") for pose in poses if isinstance(pose, dict)]
    depths = [float(pose[2][3]) for pose in placed if _is_pose(pose)]
    return (min(depths), max(depths)) if depths else None


def _is_pose(value: Any) -> bool:
    """Say whether this is a matrix of 4 x 4 numbers; a record may hold anything, as other programs write it too."""
    if not (isinstance(value, (list, tuple)) and len(value) == 4):
        return False
    rows = [row for row in value if isinstance(row, (list, tuple)) and len(row) == 4]
    return len(rows) == 4 and all(isinstance(one, (int, float)) and abs(one) < FAR_MM for row in rows for one in row)


def _impossible(found: Geometry) -> list[Cause]:
    shares = {
        "rays of camera and projector do not meet before the camera": found.nowhere,
        "points lie above or below the image of the projector": found.outside,
    }
    words = [f"{what} in {share:.0%} of the image" for what, share in shares.items() if share > params.WARNED_SHARE]
    if not words:
        return []
    fix = f"check that the images are not flipped and that no rows are cut off or moved; {CALIBRATE}"
    fatal = max(shares.values()) > params.REFUSED_SHARE
    return [Cause("calibration or image rows", " and ".join(words), fix, fatal)]


def _doubtful(found: Geometry, calibration: Calibration) -> list[Cause]:
    if found.tilt_deg > params.TILT_DEG:
        words = f"the surface as a whole is seen at {found.tilt_deg:.0f} degrees from its normal, which no camera sees "
        words += "well: the calibration seems to be of another bench"
        return [Cause("calibration", words, CALIBRATE, fatal=False)]
    if found.far > params.WARNED_SHARE:
        words = f"{found.far:.0%} of the points are farther than {params.FAR_MEDIANS:g} times the median depth of "
        words += f"{found.depth_mm:.0f} mm, where there is a ninth of the light"
        return [Cause("far points", words, f"state depth_range_mm (--depth-range-mm), or {CALIBRATE}", fatal=False)]
    depths = calibrated_depths_mm(calibration)
    if depths is None:
        return []
    low, high = depths[0] / params.CALIBRATED_FACTOR, depths[1] * params.CALIBRATED_FACTOR
    if low <= found.depth_mm <= high:
        return []
    words = f"the median depth is {found.depth_mm:.0f} mm, and the calibration was made at {depths[0]:.0f} to "
    words += f"{depths[1]:.0f} mm"
    return [Cause("calibration", words, f"move the object there; or {CALIBRATE}", fatal=False)]


def _growth(depth_mm: float, calibration: Calibration) -> tuple[float, float]:
    """Give by how much columns must grow along the rows and the columns of the image: a plane that faces the camera."""
    along = depth_mm * np.array([[0.0, 0.0, 1.0], [1e-3, 0.0, 1.0], [0.0, 1e-3, 1.0]])
    here, right, below = pixels_of(along, calibration.projector)[:, 0]
    return float(right - here), float(below - here)


def _tilt_deg(points: NDArray[np.float32], right: NDArray[np.float32], below: NDArray[np.float32]) -> float:
    """Give the angle between the line of sight and the normal of the plane with the median slopes of the surface.

    Noise tilts every part of a surface in another direction, and a wrong calibration all of it in the same one.
    """
    first, *others = (np.moveaxis(each, -1, 0).reshape(3, -1) for each in (points, right, below))
    slopes = np.concatenate([first, *(other - first for other in others)])
    slopes = slopes[:, np.isfinite(slopes.sum(axis=0))]
    if slopes.shape[1] == 0:
        return float("nan")
    # Every decode waits for it: several times as fast as np.median.
    middle = slopes.shape[1] // 2
    sight, along, down = np.partition(slopes, middle, axis=1)[:, middle].reshape(3, 3)
    normal = np.cross(along, down)
    cos = abs(float(normal @ sight)) / max(float(np.linalg.norm(normal) * np.linalg.norm(sight)), 1e-30)
    return float(np.degrees(np.arccos(min(cos, 1.0))))


def _share(hits: NDArray[np.bool_], known: NDArray[np.bool_]) -> float:
    return float(hits[known].mean()) if known.any() else 0.0
