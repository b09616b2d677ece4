"""Figures of a map of differences: bias, spread, shares inside the uncertainty, and its slow and its fast part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare.params import NORMAL

__all__ = ["Bands", "Deviations", "bands_of", "deviations_of", "rms"]

Map = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Deviations:
    """Figures of the differences at some pixels, all in `unit` ("mm" or "rad") but for counts and shares.

    bias: their median. rms: their root mean square. robust_rms: 1.4826 times the median size of their distances from
    the bias, the standard deviation of a normal distribution with the same middle half. p95: the size that 95 % keep.
    inside_percent: share of the pixels whose difference is at most 1, 2 and 3 combined uncertainties (D1); NaN where no
    uncertainty is known. A normal distribution has 68.3, 95.4 and 99.7. All are NaN without pixels.
    """

    unit: str
    pixels: int
    bias: float
    rms: float
    robust_rms: float
    p95: float
    inside_percent: tuple[float, float, float]

    def figures(self) -> dict[str, float]:
        """Give the figures by name with unit."""
        found = {f"{name}_{self.unit}": getattr(self, name) for name in ("bias", "rms", "robust_rms", "p95")}
        return found | {f"inside_{i}_percent": share for i, share in enumerate(self.inside_percent, 1)}


@dataclass(frozen=True)
class Bands:
    """RMS of the slow part of a difference (form), and of what is left (detail and noise), in the unit of the map."""

    form_rms: float
    noise_rms: float
    form: Map


def rms(values: NDArray[np.floating]) -> float:
    """Root mean square of the finite values; NaN when there are none."""
    finite = values[np.isfinite(values)].astype(np.float64)
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def deviations_of(difference: Map, counted: Mask, uncertainty: Map | None, unit: str) -> Deviations:
    """Sum up the differences at the counted pixels, maps (H, W) in `unit`."""
    values = difference[counted]
    if not values.size:
        nan = float("nan")
        return Deviations(unit, 0, nan, nan, nan, nan, (nan, nan, nan))
    bias = float(np.median(values))
    away = np.abs(values - bias)
    inside = (float("nan"),) * 3
    if uncertainty is not None:
        sigma = uncertainty[counted]
        known = np.isfinite(sigma)
        ratio = np.abs(values[known]) / np.maximum(sigma[known], np.finfo(np.float32).tiny)
        if known.any():
            inside = tuple(100 * float(np.mean(ratio <= limit)) for limit in (1, 2, 3))  # type: ignore[assignment]
    return Deviations(
        unit=unit,
        pixels=int(values.size),
        bias=bias,
        rms=rms(values),
        robust_rms=NORMAL * float(np.median(away)),
        p95=float(np.quantile(np.abs(values), 0.95)),
        inside_percent=inside,
    )


def bands_of(difference: Map, counted: Mask, sigma_px: float) -> Bands:
    """Split a difference (H, W) by a Gaussian mean over the counted pixels (D2); form is NaN elsewhere."""
    import cv2

    weight = cv2.GaussianBlur(counted.astype(np.float64), (0, 0), sigma_px)
    summed = cv2.GaussianBlur(np.where(counted, difference, 0.0), (0, 0), sigma_px)
    form = np.where(counted, summed / np.maximum(weight, 1e-9), np.nan)
    return Bands(rms(form), rms((difference - form)[counted]), form)
