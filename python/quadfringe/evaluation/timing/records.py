"""What a timing run reports: cases, their times and memory, and the line of time against pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from quadfringe.errors import InputError

__all__ = ["Case", "Cost", "Memory", "Timing", "cost_of"]


@dataclass(frozen=True)
class Case:
    """One timed case: the image size, the decoding method and the number of threads."""

    width_px: int
    height_px: int
    method: str
    threads: int

    @property
    def pixels(self) -> int:
        """Number of pixels of one image."""
        return self.width_px * self.height_px


@dataclass(frozen=True)
class Timing:
    """Times of one case, from four uint8 images to X, Y, Z and the verdict on the shot.

    `median_ms` and `minimum_ms` are wall-clock times; `verdict_ms` is the part that checks fringe orders, light and
    calibration in Python. `busy_cores` is the processor time divided by the wall-clock time; it never exceeds the
    number of threads.
    """

    case: Case
    repeats: int
    median_ms: float
    minimum_ms: float
    verdict_ms: float
    busy_cores: float
    returned_percent: float

    @property
    def shots_per_s(self) -> float:
        """Shots per second, from the median time."""
        return 1e3 / self.median_ms

    @property
    def ns_per_pixel(self) -> float:
        """Time per pixel, ns, from the median time."""
        return 1e6 * self.median_ms / self.case.pixels

    def record(self) -> dict[str, Any]:
        """Return every field by name with unit, ready for JSON."""
        times = {name: value for name, value in vars(self).items() if name != "case"}
        return vars(self.case) | times | {"shots_per_s": self.shots_per_s, "ns_per_pixel": self.ns_per_pixel}


@dataclass(frozen=True)
class Memory:
    """Resident memory of one decoder, including its last results, whose memory the next shot reuses."""

    case: Case
    held_mb: float

    def record(self) -> dict[str, Any]:
        """Return every field by name with unit, ready for JSON."""
        return vars(self.case) | {"held_mb": self.held_mb}


@dataclass(frozen=True)
class Cost:
    """The straight line of decoding time against pixels for one method: a fixed cost per shot and a cost per pixel.

    `off_percent` is the largest relative distance of a measured time from the line. `spread_percent` says by how much
    the time per pixel, fixed cost included, is larger at the most expensive size than at the cheapest.
    """

    method: str
    fixed_ms: float
    ns_per_pixel: float
    off_percent: float
    spread_percent: float

    def record(self) -> dict[str, Any]:
        """Return every field by name with unit, ready for JSON."""
        return dict(vars(self))


def cost_of(timings: Sequence[Timing]) -> Cost:
    """Fit the line of time against pixels to the times of one method, by least squares of the relative errors.

    Raises `InputError` unless the times are of one method at two or more sizes.
    """
    methods = {timing.case.method for timing in timings}
    pixels = np.array([timing.case.pixels for timing in timings], dtype=np.float64)
    if len(methods) != 1 or len(set(pixels)) < 2:
        raise InputError(
            f"cost: expected times of one method at two sizes or more, got {len(timings)} times of {sorted(methods)}"
        )
    taken_ms = np.array([timing.median_ms for timing in timings])
    parts = np.stack([np.ones_like(pixels), pixels], axis=1) / taken_ms[:, None]
    line, *_ = np.linalg.lstsq(parts, np.ones_like(pixels), rcond=None)
    costs = taken_ms / pixels
    return Cost(
        method=methods.pop(),
        fixed_ms=float(line[0]),
        ns_per_pixel=float(1e6 * line[1]),
        off_percent=float(100.0 * np.abs(parts @ line - 1.0).max()),
        spread_percent=float(100.0 * (costs.max() / costs.min() - 1.0)),
    )
