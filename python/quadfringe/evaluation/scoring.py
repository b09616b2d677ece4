"""Score a phase map against the truth: fringe orders, phase errors and depth errors.

A pixel has the right fringe order when |phase - truth| < pi. Comparing floor(phase / 2 pi) would call a phase of
-0.01 rad wrong where the truth is +0.01 rad: at the border of two orders the integer jumps and the phase does not.

This module needs NumPy only, so that it judges the decoders without sharing code with them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Image",
    "Map",
    "Mask",
    "Scene",
    "Score",
    "fringe_px",
    "inside",
    "phase_errors",
    "rms",
    "score",
    "within_percent",
]

Image = NDArray[Any]
Map = NDArray[np.floating[Any]]
Mask = NDArray[np.bool_]
Kind = Literal["absolute", "relative", "wrapped"]


@dataclass(frozen=True)
class Scene:
    """One shot (four (H, W) images of one dtype, or three without infrared), its fringes, and the known truth."""

    name: str
    red: Image
    green: Image
    blue: Image
    ir: Image | None
    fringe_numbers: tuple[float, ...]
    projector_width: int
    phase_rad: Map  # truth, absolute, first fringe number
    scored: Mask  # pixels that count
    depth_mm: Map | None = None
    shadow: Mask | None = None
    phase_sd_rad: Map | None = None  # standard deviation of the truth by noise, where it was measured
    sure: Mask | None = None  # scored pixels whose truth is beyond doubt; None: all of them

    @property
    def channels(self) -> dict[str, Image]:
        """The images by name."""
        images = {"red": self.red, "green": self.green, "blue": self.blue}
        return images if self.ir is None else images | {"ir": self.ir}


def inside(mask: Mask, margin_px: int) -> Mask:
    """Pixels whose whole square neighbourhood of `margin_px` lies in the mask and in the image."""
    for axis in (0, 1):
        padded = np.pad(mask, [(margin_px, margin_px) if a == axis else (0, 0) for a in (0, 1)])
        total = np.cumsum(np.insert(padded.astype(np.int32), 0, 0, axis=axis), axis=axis)
        size, length = 2 * margin_px + 1, mask.shape[axis]
        upper = np.take(total, np.arange(size, size + length), axis=axis)
        mask = upper - np.take(total, np.arange(length), axis=axis) == size
    return mask


def fringe_px(scene: Scene) -> int:
    """Widest fringe of the scene along rows (camera pixels), from the truth, rounded up."""
    slope = np.abs(np.diff(scene.phase_rad, axis=1))[:, ::8]
    return int(np.ceil(2 * np.pi / np.quantile(slope, 0.05)))


def rms(values: Map) -> float:
    """Give the root mean square; NaN for an empty map."""
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64)))) if values.size else np.nan


def within_percent(errors: Map, sigma: Map, limits: tuple[int, ...]) -> list[float]:
    """Give the share of absolute errors within each number of their stated standard deviations; NaN without any.

    >>> within_percent(np.array([0.0, 1.5, -2.5, 9.0]), np.ones(4), (1, 2, 3))
    [25.0, 50.0, 75.0]
    """
    deviations = np.abs(errors) / sigma
    return [100 * float(np.mean(deviations <= limit)) if deviations.size else np.nan for limit in limits]


@dataclass(frozen=True)
class Score:
    """Figures of one map against the truth, over the scored pixels unless a name says otherwise."""

    right_percent: float  # right order; a missing pixel counts as wrong
    right_of_returned_percent: float
    returned_percent: float
    wrong_pixels: int  # returned with a wrong order
    phase_rms_rad: float  # wrapped difference of all returned pixels
    right_phase_rms_rad: float  # plain difference of the pixels with the right order
    depth_rms_mm: float | None = None  # of the pixels with the right order
    depth_rms_all_mm: float | None = None  # of all returned pixels: one wrong order is some 30 mm
    in_shadow_pixels: int | None = None  # returned where no light falls

    def as_figures(self) -> dict[str, float]:
        """Numbers by name with unit; what does not apply is left out."""
        return {name: value for name, value in vars(self).items() if value is not None}


def score(scene: Scene, phase_rad: Map, xyz_mm: Map | None = None, mask: Mask | None = None) -> Score:
    """Judge an absolute phase map, and the depth of its points where both are known."""
    scored = scene.scored if mask is None else mask
    error = phase_rad.astype(np.float64) - scene.phase_rad
    returned = np.isfinite(phase_rad) & scored
    right = returned & (np.abs(error) < np.pi)
    pixels, count, good = (int(np.count_nonzero(m)) for m in (scored, returned, right))
    figures: dict[str, Any] = {}
    if xyz_mm is not None and scene.depth_mm is not None:
        depth_error = xyz_mm[:, :, 2] - scene.depth_mm
        figures["depth_rms_mm"] = rms(depth_error[right])
        figures["depth_rms_all_mm"] = rms(depth_error[returned])
    if scene.shadow is not None:
        in_shadow = np.isfinite(phase_rad) & scene.shadow
        figures["in_shadow_pixels"] = int(np.count_nonzero(in_shadow))
    return Score(
        right_percent=100 * good / pixels,
        right_of_returned_percent=100 * good / max(1, count),
        returned_percent=100 * count / pixels,
        wrong_pixels=count - good,
        phase_rms_rad=rms(np.angle(np.exp(1j * error[returned]))),
        right_phase_rms_rad=rms(error[right]),
        **figures,
    )


def phase_errors(phase_rad: Map, truth_rad: Map, kind: Kind = "absolute") -> dict[str, float]:
    """Judge a phase that may be known only up to sign, offset or whole periods.

    `kind` says what the phase means: "absolute" is compared as it is; "relative" may be off by one multiple of 2 pi
    everywhere; "wrapped" may also have the other sign and a constant offset. Pixels that are NaN are left out.
    Returns `phase_rms_rad` of the pixels with the right order and, unless wrapped, `wrong_orders_percent`.

    >>> import numpy as np
    >>> truth_rad = np.linspace(0.0, 30.0, 100)
    >>> phase_errors(truth_rad + 2 * np.pi, truth_rad, "relative")["wrong_orders_percent"]
    0.0
    """
    seen = np.isfinite(phase_rad)
    phase, truth = phase_rad[seen].astype(np.float64), truth_rad[seen].astype(np.float64)
    if kind == "wrapped":
        signed = [np.exp(1j * (sign * phase - truth)) for sign in (1, -1)]
        turned = max(signed, key=lambda z: abs(z.mean()))
        return {"phase_rms_rad": rms(np.angle(turned / turned.mean()))}
    error_rad = phase - truth
    if kind == "relative":
        error_rad -= 2 * np.pi * np.round(np.median(error_rad) / (2 * np.pi))
    right = np.abs(error_rad) < np.pi
    return {"phase_rms_rad": rms(error_rad[right]), "wrong_orders_percent": 100.0 * float(1 - right.mean())}
