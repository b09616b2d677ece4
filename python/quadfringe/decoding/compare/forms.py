"""Smooth forms over an image, the blur that lost modulation shows, and shares of a difference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare import params

__all__ = ["Fitted", "blur_of", "fit_form", "polynomials", "share_explained"]

Map = NDArray[np.float64]


def polynomials(shape: tuple[int, int]) -> Map:
    """Give offset, tilt and bow over the image, (H, W, 6)."""
    y, x = np.mgrid[-1 : 1 : shape[0] * 1j, -1 : 1 : shape[1] * 1j]
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)


@dataclass(frozen=True)
class Fitted:
    """Coefficients of a smooth form over the image, and the form, (H, W)."""

    coefficients: Map
    form: Map


def fit_form(values: Map) -> Fitted:
    """Fit offset, tilt and bow to a map (H, W); NaN is ignored. Twice: outliers beyond four deviations do not count."""
    terms = polynomials((values.shape[0], values.shape[1]))
    known = np.isfinite(values)
    for _ in range(2):
        coefficients = np.asarray(np.linalg.lstsq(terms[known], values[known], rcond=None)[0], np.float64)
        form = terms @ coefficients
        away = np.abs(values - form)
        limit = 4 * params.NORMAL * float(np.median(away[np.isfinite(away)]))
        known = np.isfinite(values) & (away <= max(limit, 1e-12))
    return Fitted(coefficients, form)


def blur_of(loss: Map, frequency: Map) -> float:
    """Give the square of the blur, px2, that a loss of modulation shows by its growth with the frequency (D5)."""
    known = np.isfinite(loss) & np.isfinite(frequency) & (frequency < 0.25)
    if not known.any():
        return 0.0
    y = loss[known]
    terms = np.stack([np.ones_like(y), 2 * np.pi**2 * frequency[known] ** 2], axis=1)
    weights = np.ones_like(y)
    found: Map = np.zeros(2)
    for _ in range(5):
        found = np.asarray(np.linalg.lstsq(terms * weights[:, None], y * weights, rcond=None)[0], np.float64)
        away = np.abs(y - terms @ found)
        scale = params.NORMAL * float(np.median(away))
        weights = np.sqrt(np.minimum(1, 2 * scale / np.maximum(away, 1e-12)))
    return float(found[1])


def share_explained(difference: Map, part: Map, of: Map | None = None) -> float:
    """Give by how much a part lowers the mean square of `of`, or of the difference, over that of the difference."""
    rest = difference if of is None else of
    known = np.isfinite(rest) & np.isfinite(part)
    total = float(np.mean(difference[known] ** 2)) if known.any() else 0.0
    if total == 0:
        return 0.0
    gain = float(np.mean(rest[known] ** 2)) - float(np.mean((rest[known] - part[known]) ** 2))
    return max(0.0, gain / total)
