"""Where the projected light ends: the one place in a shot that shows whether images and calibration fit along y.

Fringes give the projector column of a pixel and not its row. A calibration predicts the row, and light must end at the
first and at the last one. Nothing else in a shot shows images that have moved along y, or a projector that was turned;
and nothing at all shows a distance of the devices that is wrong, which only changes the size of everything.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Calibration, Shape
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.fringe_fit import pixels_of

__all__ = ["BY_HAND", "LightBorder", "borders_of", "checked_rows", "moved_border"]

BY_HAND = (
    "once for a bench, show a flat board (quadfringe doctor --board) or a surface on which the upper or the lower "
    "border of the projected light is in view; quadfringe accept measures size too"
)
FIX = "check that no rows are cut off or moved (OffsetY of the camera), and that nothing was turned since the bench "
FIX += "was calibrated; then calibrate again: quadfringe calibrate"


@dataclass(frozen=True)
class LightBorder:
    """A straight border of the light: its name, and the projector row at which it lies.

    `inside_px` is the distance from the nearer border of the image of the projector, positive inside and negative
    outside of it. `goes_on` says that the border ends at its left and right where the view or the light ends; that of
    an object does not.
    """

    name: str
    row_px: float
    inside_px: float
    goes_on: bool


def borders_of(shape: Shape) -> list[LightBorder]:
    """Find the upper and the lower border of the light in a shape, those of them that are in view.

    A border counts when it lies at one projector row in a good part of the image columns; objects end elsewhere.

    >>> import quadfringe as qf
    >>> wide = qf.Device(width_px=512, height_px=384, focal_px=(560, 560), centre_px=(255.5, 191.5))
    >>> with qf.open(qf.SystemConfig(camera=wide, scene=qf.SceneConfig(surface="plane"))) as scanner:
    ...     shape = scanner.measure()
    >>> [(border.name, abs(border.inside_px) < 8) for border in borders_of(shape)]
    [('upper', True), ('lower', True)]
    """
    if shape.calibration is None or shape.xyz_mm is None:
        return []
    phase_rad = shape.phase_rad[:, :: _stride(shape)]
    ways = {"upper": np.s_[:], "lower": np.s_[::-1]}
    # Most benches light the whole view, and the first rows tell it: the other ones are not read then.
    ways = {name: way for name, way in ways.items() if _dark_above(phase_rad[way])}
    if not ways:
        return []
    returned = np.ascontiguousarray(np.isfinite(phase_rad).T)
    found = [_border(shape, shape.calibration, name, way, returned[:, way]) for name, way in ways.items()]
    return [border for border in found if border is not None]


def _stride(shape: Shape) -> int:
    """Give the step between columns; a few hundred tell where the light ends, in a tenth of the time of all of them."""
    columns: int = shape.phase_rad.shape[1]
    return max(1, columns // params.BORDER_COLUMNS)


def _dark_above(phase_rad: NDArray[np.float32]) -> bool:
    """Say whether enough columns have no light in their first rows."""
    lit = np.isfinite(phase_rad[: params.BORDER_DARK_PX]).any(axis=0)
    return bool(np.mean(~lit) >= params.BORDER_SHARE)


def _border(
    shape: Shape, known: Calibration, name: str, downwards: slice, returned: NDArray[np.bool_]
) -> LightBorder | None:
    """Find the border above the light in an image whose rows are read in this direction.

    `returned` (columns, rows) are some of the columns, their rows in this direction.
    """
    assert shape.xyz_mm is not None
    stride, wide = _stride(shape), params.BORDER_SHARE * len(returned)
    first = returned.argmax(axis=1)
    at = np.flatnonzero(returned[np.arange(len(first)), first] & (first >= params.BORDER_DARK_PX))
    rows = pixels_of(shape.xyz_mm[downwards][first[at], stride * at], known.projector)[:, 1]
    at, rows = at[np.isfinite(rows)], rows[np.isfinite(rows)]
    if at.size < wide:
        return None
    near = np.abs(rows - _densest(rows, params.BORDER_ROWS_PX)) <= params.BORDER_ROWS_PX
    if near.sum() < wide:
        return None
    row_px, outermost = float(np.median(rows[near])), at[near][[0, -1]]
    inside_px = min(row_px + 0.5, known.projector.height_px - 0.5 - row_px)
    goes_on = all(
        _ends_there(shape, stride * int(x), int(first[x]), float(shape.column_px[downwards][first[x], stride * x]))
        for x in outermost
    )
    return LightBorder(name, row_px, inside_px, goes_on)


def _ends_there(shape: Shape, x: int, y: int, column_px: float) -> bool:
    """Say whether the view or the light of the projector ends near a pixel; y counts from the border's side."""
    assert shape.calibration is not None
    share = params.BORDER_END_SHARE
    width, columns = shape.phase_rad.shape[1], shape.calibration.projector.width_px
    in_view = share * width <= x < (1 - share) * width and y >= share * shape.phase_rad.shape[0]
    return not in_view or not share * columns <= column_px < (1 - share) * columns


def _densest(values: NDArray[np.float32], reach: float) -> float:
    """Give the median of the window of twice `reach` that holds most values."""
    ordered = np.sort(values)
    counts = np.searchsorted(ordered, ordered + 2 * reach, "right") - np.arange(ordered.size)
    start = int(counts.argmax())
    return float(np.median(ordered[start : start + int(counts[start])]))


def checked_rows(shape: Shape, borders: list[LightBorder]) -> str:
    """Say in words whether the borders show that images and calibration fit along y; empty without a calibration."""
    if shape.calibration is None or shape.xyz_mm is None:
        return ""
    there = [border for border in borders if abs(border.inside_px) <= params.ROWS_PX]
    if not there:
        words = "rows not checked: neither the upper nor the lower border of the projected light is seen at its place, "
        return words + "and nothing else in a shot shows images that moved, or a projector that was turned"
    names = " and the ".join(border.name for border in there)
    off = max(abs(border.inside_px) for border in there)
    verb = "lie" if len(there) > 1 else "lies"
    return (
        f"rows checked: the {names} border of the projected light {verb} within {off:.0f} projector rows of its place"
    )


def moved_border(shape: Shape, borders: list[LightBorder]) -> Cause | None:
    """Name a calibration whose projector has its upper or lower border elsewhere than the light, if it is in view.

    `borders` are those of the shape.
    """
    if shape.calibration is None or shape.xyz_mm is None:
        return None
    beyond = _beyond(shape.xyz_mm, shape.calibration)
    if beyond > params.BEYOND_SHARE:
        words = f"in {beyond:.0%} of the image columns light reaches beyond the upper or the lower border of the image "
        return Cause("calibration or image rows", f"{words}of the projector, as the calibration has it", FIX, False)
    for border in borders:
        if border.goes_on and border.inside_px > params.ROWS_PX:
            words = f"the {border.name} border of the light lies {border.inside_px:.0f} rows inside the image of the "
            return Cause("calibration or image rows", f"{words}projector, as the calibration has it", FIX, False)
    return None


def _beyond(xyz_mm: NDArray[np.float32], known: Calibration) -> float:
    """Give the share of the image columns in which several pixels lie beyond the rows of the projector."""
    columns = np.s_[:: max(1, min(xyz_mm.shape[:2]) // params.SAMPLES)]
    rows = pixels_of(xyz_mm[:: params.BEYOND_STRIDE, columns], known.projector)[..., 1]
    beyond = np.maximum(-0.5 - rows, rows - (known.projector.height_px - 0.5)) > params.ROWS_PX
    return float(np.mean(beyond.sum(axis=0) >= params.BEYOND_PIXELS / params.BEYOND_STRIDE))
