"""Least squares with errors that the tiles of an image tell: each tile is left out once.

Neighbouring pixels share print, shading and what smooths them, so that their number says little about an error. Tiles
as wide as these reach are nearly independent. Waves that are nearly alike over a narrow object get the large errors
that they have, because every tile turns the solution.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding import fit_params

__all__ = ["Jackknife", "normal_equations", "tiles_of"]

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Jackknife:
    """Normal equations of least squares by tile: matrices (T, n, n) and right sides (T, n)."""

    matrices: Real
    sides: Real

    def solved(self, columns: list[int] | slice = slice(None)) -> Real:
        """Give the solution in some of the columns, with the others at 0."""
        matrix, side = self.matrices.sum(axis=0)[columns][:, columns], self.sides.sum(axis=0)[columns]
        return np.asarray(np.linalg.lstsq(matrix, side, rcond=None)[0])

    def least(self, figures: Callable[[Real], Real]) -> tuple[Real, Real]:
        """Give figures of the solution, and the least that each has for sure.

        That lies fit_params.SURE_SDS standard errors below; of few tiles the error is known badly, and by Student's
        distribution it takes more of them. `figures` turns solutions (..., n) into figures (..., m).
        """
        whole = figures(self.solved())
        count, unknowns = self.sides.shape
        if count <= unknowns:
            return whole, np.full_like(whole, -np.inf)
        from scipy.special import ndtr, stdtrit

        without = np.linalg.pinv(self.matrices.sum(axis=0) - self.matrices, hermitian=True)
        moved = figures(np.einsum("tij,tj->ti", without, self.sides.sum(axis=0) - self.sides)) - whole
        error = np.sqrt((count - 1) / count * (moved**2).sum(axis=0))
        return whole, whole - stdtrit(count - unknowns, ndtr(fit_params.SURE_SDS)) * error


def tiles_of(inside: NDArray[np.bool_], side_px: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Give the flat indices of the pixels inside, tile by tile, and where each tile begins among them."""
    rows, columns = np.nonzero(inside)
    side = round(side_px)
    tile = (rows - rows.min()) // side * inside.shape[1] + (columns - columns.min()) // side
    order = np.argsort(tile, kind="stable")
    _, starts = np.unique(tile[order], return_index=True)
    return np.flatnonzero(inside)[order], starts


def normal_equations(design: Real, values: Real, starts: NDArray[np.intp]) -> Jackknife:
    """Sum up the normal equations of every tile."""
    tiles = [slice(first, last) for first, last in zip(starts, [*starts[1:], len(values)], strict=True)]
    matrices = np.array([design[tile].T @ design[tile] for tile in tiles])
    return Jackknife(matrices, np.array([design[tile].T @ values[tile] for tile in tiles]))
