"""What a file holds, as a page needs it: bodies to draw in any colouring, and spots and sections to measure.

A `Grid` has a point for each pixel, as a saved shape or a shot of a series has. A `Solid` has triangles or points in
any order, as files for other programs have.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.data.points import xyz_mm_of
from quadfringe.errors import InputError
from quadfringe.view._bodies import NO_FACES, Body, body_of, spacing_mm
from quadfringe.view.colours import COLOURINGS, Colouring, Picture, coloured, limits_for
from quadfringe.view.measuring import Ray, Section, Spot, grid_section, hit, nearest, plane_section

__all__ = ["Grid", "Item", "Solid"]

Map = NDArray[np.float32]
SAMPLES = 2000


class Item(Protocol):
    """What a page shows of a file."""

    @property
    def colourings(self) -> tuple[Colouring, ...]:
        """The colourings that it has values for."""

    @property
    def count(self) -> int:
        """Number of points."""

    @property
    def words(self) -> str:
        """Size, for people."""

    def body(self, colouring: Colouring, step: int, *, surface: bool) -> Body:
        """Give every `step`-th pixel of every `step`-th row as surface or points; triangles of a file as they are."""

    def spot(self, ray: Ray) -> Spot | None:
        """Return where a ray first meets the item; None when it passes by."""

    def section(self, first: Spot, last: Spot, view: NDArray[np.float64]) -> Section:
        """Give the profile between two spots, seen along `view`; raises `InputError` when there is nothing to cut."""


class Grid:
    """A shape, in the colours of a picture (H, W, 3), or in those of its albedo."""

    def __init__(self, shape: Shape, picture: Picture | None = None) -> None:
        self._xyz_mm = xyz_mm_of(shape)
        self._valid = np.flatnonzero(np.isfinite(self._xyz_mm).all(axis=2))
        if not self._valid.size:
            raise InputError("the shape has no points: nothing was returned")
        self._shape, self._picture = shape, picture
        self.colourings = tuple(name for name in COLOURINGS if name == "texture" or self._values(name) is not None)
        rows, columns = shape.quality.shape
        self.count = self._valid.size
        self.words = f"{columns} x {rows} pixels, {self.count:,} points"

    @cached_property
    def _colour(self) -> Picture:
        return self._shape.colour if self._picture is None else self._picture

    @cached_property
    def _points_mm(self) -> Map:
        points: Map = self._xyz_mm.reshape(-1, 3)[self._valid]
        return points

    @cached_property
    def _spacing_mm(self) -> float:
        return spacing_mm(self._xyz_mm)

    def _values(self, colouring: Colouring) -> Map | None:
        """Give the map that the colours show; None for one that is not known."""
        if colouring == "height":
            return np.asarray(-self._xyz_mm[:, :, 2], np.float32)
        values = self._shape.quality if colouring == "quality" else self._shape.uncertainty_mm
        return None if values is None or not np.isfinite(values).any() else values

    def body(self, colouring: Colouring, step: int, *, surface: bool) -> Body:
        """Give every `step`-th pixel of every `step`-th row, as surface or points."""
        values = None if colouring == "texture" else self._values(colouring)
        if values is None:
            picture = self._colour[::step, ::step]
        else:
            picture = coloured(values[::step, ::step], limits_for(colouring, values))
        return body_of(self._shape, step, picture, surface=surface)

    def spot(self, ray: Ray) -> Spot | None:
        """Return the point that a ray meets first."""
        index = nearest(self._points_mm, ray, self._spacing_mm)
        if index is None:
            return None
        row, column = divmod(int(self._valid[index]), self._xyz_mm.shape[1])
        x, y, z = (float(value) for value in self._points_mm[index])
        sigma = self._shape.uncertainty_mm
        known = None if sigma is None or not np.isfinite(sigma[row, column]) else float(sigma[row, column])
        return Spot((x, y, z), (row, column), known)

    def section(self, first: Spot, last: Spot, view: NDArray[np.float64]) -> Section:  # noqa: ARG002
        """Give the depth along the line of pixels between two spots."""
        assert first.pixel is not None
        assert last.pixel is not None
        return grid_section(self._xyz_mm[:, :, 2], self._shape.uncertainty_mm, first.pixel, last.pixel)


@dataclass(frozen=True)
class Solid:
    """Points (N, 3) mm, their colours (N, 3), triangles (F, 3), and values (N,) by name, such as `quality`."""

    points_mm: Map
    faces: NDArray[np.uint32]
    colour: Picture
    values: dict[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.points_mm)

    @property
    def words(self) -> str:
        """Size, for people."""
        triangles = f", {len(self.faces):,} triangles" if len(self.faces) else ""
        return f"{len(self.points_mm):,} points{triangles}"

    @cached_property
    def colourings(self) -> tuple[Colouring, ...]:
        """The colourings of which there are values."""
        names = (name for name in COLOURINGS if name in ("texture", "height") or self._values(name) is not None)
        return tuple(names)

    def _values(self, colouring: Colouring) -> Map | None:
        if colouring == "height":
            return -self.points_mm[:, 2]
        values = self.values.get("uncertainty_mm" if colouring == "uncertainty" else colouring)
        return None if values is None or not np.isfinite(values).any() else np.asarray(values, np.float32)

    @cached_property
    def _spacing_mm(self) -> float:
        """Median distance of neighbours: corners of triangles, or of a sample of points."""
        if len(self.faces):
            corners = self.points_mm[self.faces[:: max(1, len(self.faces) // SAMPLES)]]
            return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))
        from scipy.spatial import cKDTree

        sample = self.points_mm[:: max(1, len(self.points_mm) // SAMPLES)]
        away, _ = cKDTree(self.points_mm).query(sample, k=min(2, len(self.points_mm)))
        return max(float(np.median(away.reshape(len(sample), -1)[:, -1])), 1e-3)

    def body(self, colouring: Colouring, step: int, *, surface: bool) -> Body:
        """Give triangles as they are, and of points every `step`-th of every `step`-th."""
        values = None if colouring == "texture" else self._values(colouring)
        colour = self.colour
        if values is not None:
            colour = coloured(values[:, None], limits_for(colouring, values[:, None]))[:, 0]
        if surface and len(self.faces):
            return Body(self.points_mm, self.faces, colour, self._spacing_mm)
        every = slice(None, None, step * step)
        return Body(self.points_mm[every], NO_FACES, colour[every], step * self._spacing_mm)

    def spot(self, ray: Ray) -> Spot | None:
        """Return where a ray meets a triangle first; without triangles, the point that it meets first."""
        if not len(self.faces):
            index = nearest(self.points_mm, ray, self._spacing_mm)
            return None if index is None else self._spot(index, self.points_mm[index])
        found = hit(self.points_mm, self.faces, ray)
        return None if found is None else self._spot(found.corner, np.asarray(found.place_mm))

    def _spot(self, index: int, place_mm: NDArray[np.floating[Any]]) -> Spot:
        """Give a place with what is known of the point next to it."""
        known = {
            name: float(self.values[name][index]) for name in ("row", "column", "uncertainty_mm") if name in self.values
        }
        sigma = known.get("uncertainty_mm", np.nan)
        pixel = (int(known["row"]), int(known["column"])) if {"row", "column"} <= known.keys() else None
        x, y, z = (float(value) for value in place_mm)
        return Spot((x, y, z), pixel, sigma if np.isfinite(sigma) else None)

    def section(self, first: Spot, last: Spot, view: NDArray[np.float64]) -> Section:
        """Cut the triangles between two spots, by the plane that holds the line and the direction of sight."""
        if not len(self.faces):
            raise InputError("a section needs triangles, or rows and columns of the points")
        return plane_section(self.points_mm, self.faces, first.place_mm, last.place_mm, view)
