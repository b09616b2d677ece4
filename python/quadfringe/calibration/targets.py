"""Calibration boards: rings as in the paper, circle grids and ChArUco; their points and their print.

The frame of a board has x to the right, y down and z away from the viewer, in mm; the origin is its first point.

>>> from quadfringe.calibration.targets import ring_board
>>> ring_board().points_mm.shape
(108, 3)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from quadfringe.config import Model, Positive, checked

__all__ = [
    "Disc",
    "Rectangle",
    "Target",
    "asymmetric_grid",
    "charuco_board",
    "circle_grid",
    "drawing",
    "raster",
    "ring_board",
]

Count = Annotated[int, Field(ge=3, le=100)]
MARK_DIAMETER = 0.22  # of the pitch: well below the smallest ring or disc, so that no mark is taken for a point
MARGIN = 0.75  # of the pitch, from the outer points to the border of the print: white that detection needs
DICTIONARIES = ("DICT_4X4_250", "DICT_5X5_250", "DICT_6X6_250", "DICT_7X7_250")


@dataclass(frozen=True)
class Disc:
    """A filled circle on a board, mm; without ink (paper) when `ink` is false."""

    x_mm: float
    y_mm: float
    diameter_mm: float
    ink: bool = True


@dataclass(frozen=True)
class Rectangle:
    """A filled rectangle on a board, placed by its upper left corner, mm; without ink (paper) when `ink` is false."""

    x_mm: float
    y_mm: float
    width_mm: float
    height_mm: float
    ink: bool = True


class Target(Model):
    """A calibration board.

    `rows` and `columns` count rings or discs, or the squares of a ChArUco board; in an asymmetric grid every second
    row is offset by half a pitch. `pitch_mm` is the distance of neighbours in a row, or the side of a square. `marks`
    prints two dots in the first two cells, which show the orientation of the board and whether it is mirrored.
    """

    kind: Literal["rings", "circles", "asymmetric", "charuco"]
    rows: Count
    columns: Count
    pitch_mm: Positive
    diameter_mm: Positive | None = None
    hole_mm: Positive | None = None
    marker_mm: Positive | None = None
    dictionary: Literal["DICT_4X4_250", "DICT_5X5_250", "DICT_6X6_250", "DICT_7X7_250"] = "DICT_4X4_250"
    marks: bool = True

    @model_validator(mode="after")
    def _is_drawable(self) -> Self:
        given = {name for name in ("diameter_mm", "hole_mm", "marker_mm") if getattr(self, name) is not None}
        needed = {"rings": {"diameter_mm", "hole_mm"}, "charuco": {"marker_mm"}}.get(self.kind, {"diameter_mm"})
        if given != needed:
            raise ValueError(
                f"{self.kind}: expected {', '.join(sorted(needed))}, got {', '.join(sorted(given)) or 'none'}"
            )
        limit_mm = self.pitch_mm if self.kind == "charuco" else 0.7 * self.pitch_mm
        outer_mm = self.diameter_mm or self.marker_mm or 0.0
        if outer_mm >= limit_mm:
            raise ValueError(f"{self.kind}: expected less than {limit_mm:g} mm at this pitch, got {outer_mm:g} mm")
        if self.hole_mm is not None and self.hole_mm > 0.8 * outer_mm:
            raise ValueError(
                f"rings: expected a hole of at most 0.8 of the ring, got {self.hole_mm:g} of {outer_mm:g} mm"
            )
        return self

    @cached_property
    def points_mm(self) -> NDArray[np.float64]:
        """Points of the board, (N, 3), mm, row by row."""
        if self.kind == "charuco":
            x, y = np.meshgrid(np.arange(self.columns - 1.0), np.arange(self.rows - 1.0))
        else:
            x, y = np.meshgrid(np.arange(float(self.columns)), np.arange(float(self.rows)))
        if self.kind == "asymmetric":
            x, y = x + 0.5 * (y % 2), 0.5 * y
        return self.pitch_mm * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)

    @cached_property
    def area_mm(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Upper left and lower right corner (x, y), mm, of the print with its white border."""
        margin = (1.5 if self.kind == "charuco" else MARGIN) * self.pitch_mm
        low, high = self.points_mm[:, :2].min(axis=0) - margin, self.points_mm[:, :2].max(axis=0) + margin
        return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the print, mm."""
        (left, top), (right, bottom) = self.area_mm
        return right - left, bottom - top

    @property
    def mark_points_mm(self) -> NDArray[np.float64]:
        """Centres of the two marks in the first two cells, (2, 2), mm."""
        half = 0.5 * self.pitch_mm
        if self.kind == "asymmetric":
            return np.array([[half, 0.0], [half + self.pitch_mm, 0.0]])
        return np.array([[half, half], [half + self.pitch_mm, half]])

    @property
    def mark_mm(self) -> float:
        """Diameter of a mark, mm."""
        return MARK_DIAMETER * self.pitch_mm * (0.6 if self.kind == "asymmetric" else 1.0)

    def charuco(self) -> Any:
        """Return the OpenCV board of a ChArUco target."""
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        size = (self.columns, self.rows)
        return cv2.aruco.CharucoBoard(size, float(self.pitch_mm), float(self.marker_mm or 0.0), dictionary)


def ring_board(
    rows: int = 9,
    columns: int = 12,
    pitch_mm: float = 20.0,
    diameter_mm: float | None = None,
    hole_mm: float | None = None,
    marks: bool = True,
) -> Target:
    """Return a ring board, by default that of the paper, 9 x 12 rings; default diameters: 0.6 and 0.3 of the pitch."""
    outer_mm = 0.6 * pitch_mm if diameter_mm is None else diameter_mm
    hole_mm = 0.5 * outer_mm if hole_mm is None else hole_mm
    return _target(
        kind="rings", rows=rows, columns=columns, pitch_mm=pitch_mm, diameter_mm=outer_mm, hole_mm=hole_mm, marks=marks
    )


def circle_grid(
    rows: int = 9, columns: int = 12, pitch_mm: float = 20.0, diameter_mm: float | None = None, marks: bool = True
) -> Target:
    """Return a symmetric grid of discs; default diameter: half the pitch."""
    diameter_mm = 0.5 * pitch_mm if diameter_mm is None else diameter_mm
    return _target(kind="circles", rows=rows, columns=columns, pitch_mm=pitch_mm, diameter_mm=diameter_mm, marks=marks)


def asymmetric_grid(
    rows: int = 11, columns: int = 6, pitch_mm: float = 32.0, diameter_mm: float | None = None, marks: bool = True
) -> Target:
    """Return a grid of discs whose odd rows are offset by half a pitch; default diameter: 0.36 of the pitch.

    Rows are half a pitch apart. The pattern size of OpenCV for this board is (columns, rows).
    """
    diameter_mm = 0.36 * pitch_mm if diameter_mm is None else diameter_mm
    return _target(
        kind="asymmetric", rows=rows, columns=columns, pitch_mm=pitch_mm, diameter_mm=diameter_mm, marks=marks
    )


def charuco_board(
    rows: int = 9,
    columns: int = 12,
    pitch_mm: float = 20.0,
    marker_mm: float | None = None,
    dictionary: str = "DICT_4X4_250",
) -> Target:
    """Return a ChArUco board, which may be partly out of view; default marker: 0.75 of a square."""
    marker_mm = 0.75 * pitch_mm if marker_mm is None else marker_mm
    return _target(
        kind="charuco", rows=rows, columns=columns, pitch_mm=pitch_mm, marker_mm=marker_mm, dictionary=dictionary
    )


def _target(**values: Any) -> Target:
    return checked(Target, values, "target")


def drawing(target: Target) -> list[Disc | Rectangle]:
    """Return the printed shapes in drawing order."""
    if target.kind == "charuco":
        return [*_squares(target), *_markers(target)]
    outer = [Disc(float(x), float(y), target.diameter_mm or 0.0) for x, y, _ in target.points_mm]
    holes = [Disc(d.x_mm, d.y_mm, target.hole_mm, ink=False) for d in outer if target.hole_mm is not None]
    marks = [Disc(float(x), float(y), target.mark_mm) for x, y in target.mark_points_mm] if target.marks else []
    return [*outer, *holes, *marks]


def _squares(target: Target) -> list[Disc | Rectangle]:
    """Return the black squares; the first point lies at the inner corner of the first square, which is black."""
    side = target.pitch_mm
    places = ((c, r) for r in range(target.rows) for c in range(target.columns) if (r + c) % 2 == 0)
    return [Rectangle((c - 1) * side, (r - 1) * side, side, side) for c, r in places]


def _markers(target: Target) -> list[Disc | Rectangle]:
    board = target.charuco()
    dictionary = board.getDictionary()
    cells = dictionary.markerSize + 2
    found: list[Disc | Rectangle] = []
    for number, corners in zip(board.getIds().ravel(), board.getObjPoints(), strict=True):
        left, top = (float(v) - target.pitch_mm for v in corners[:, :2].min(axis=0))
        side = target.marker_mm or 0.0
        found.append(Rectangle(left, top, side, side))
        bits = dictionary.generateImageMarker(int(number), cells, borderBits=1) > 0
        for row, column, length in _runs(bits):
            cell = side / cells
            found.append(Rectangle(left + column * cell, top + row * cell, length * cell, cell, ink=False))
    return found


def _runs(bits: NDArray[np.bool_]) -> list[tuple[int, int, int]]:
    """Return row, first column and length of each run of set bits."""
    padded = np.pad(bits.astype(np.int8), ((0, 0), (1, 1)))
    change = np.diff(padded, axis=1)
    starts, ends = np.argwhere(change == 1), np.argwhere(change == -1)
    return [(int(r), int(c), int(e - c)) for (r, c), (_, e) in zip(starts, ends, strict=True)]


def raster(target: Target, texel_mm: float = 0.1) -> NDArray[np.float32]:
    """Return the ink coverage of each texel, (rows, columns) float32, 0 to 1, over `target.area_mm`.

    The centre of the first texel lies half a texel inside the upper left corner. Edges are anti-aliased, which places
    them to a small fraction of a texel.
    """
    (left, top), _ = target.area_mm
    width, height = (round(s / texel_mm) for s in target.size_mm)
    image = np.zeros((height, width), np.float32)
    for item in drawing(target):
        low, high = _extent(item)
        c0, r0 = (max(int((v - o) / texel_mm) - 1, 0) for v, o in zip(low, (left, top), strict=True))
        c1, r1 = (int((v - o) / texel_mm) + 2 for v, o in zip(high, (left, top), strict=True))
        patch = image[r0:r1, c0:c1]
        x = left + (np.arange(c0, c0 + patch.shape[1]) + 0.5) * texel_mm
        y = top + (np.arange(r0, r0 + patch.shape[0]) + 0.5) * texel_mm
        share = _covered(item, x, y, texel_mm)
        patch += share * (float(item.ink) - patch)
    return image


def _extent(item: Disc | Rectangle) -> tuple[tuple[float, float], tuple[float, float]]:
    if isinstance(item, Disc):
        r = 0.5 * item.diameter_mm
        return (item.x_mm - r, item.y_mm - r), (item.x_mm + r, item.y_mm + r)
    return (item.x_mm, item.y_mm), (item.x_mm + item.width_mm, item.y_mm + item.height_mm)


def _covered(
    item: Disc | Rectangle, x: NDArray[np.float64], y: NDArray[np.float64], texel_mm: float
) -> NDArray[np.float32]:
    """Return the share of each texel that the item covers, (rows, columns)."""
    if isinstance(item, Disc):
        distance = np.hypot(x - item.x_mm, (y - item.y_mm)[:, None])
        covered = np.clip(0.5 + (0.5 * item.diameter_mm - distance) / texel_mm, 0, 1)
    else:
        low, high = _extent(item)
        along = [
            np.clip(np.minimum(b, v + 0.5 * texel_mm) - np.maximum(a, v - 0.5 * texel_mm), 0, texel_mm) / texel_mm
            for a, b, v in ((low[0], high[0], x), (low[1], high[1], y))
        ]
        covered = along[1][:, None] * along[0]
    return covered.astype(np.float32)
