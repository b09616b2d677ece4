"""Compare a shape with the truth: depth errors, missing pixels, wrong orders, and stated uncertainties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.evaluation.scoring import rms, within_percent
from quadfringe.evaluation.world.scenes import Take

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Figures:
    """Figures of one shape, over counted pixels: lit, and not mixing two sides of an edge."""

    rms_mm: float  # depth errors of returned pixels with the right order, as the three below
    median_mm: float
    p95_mm: float
    p99_mm: float
    rim_rms_mm: float  # of returned pixels within a fringe of an edge, wrong orders included
    returned_percent: float
    wrong_percent: float  # of returned: order
    inside_1_percent: float  # of right: errors within 1, 2 and 3 stated standard deviations
    inside_2_percent: float
    inside_3_percent: float
    stated_wrong_percent: float  # mean stated probability of a wrong order


def judge(shape: Shape, take: Take) -> Figures:
    """Compare a calibrated shape with the truth; raises ValueError for a shape without millimetres."""
    if shape.xyz_mm is None or shape.uncertainty_mm is None or shape.wrong_order_probability is None:
        raise ValueError("expected a shape decoded with a calibration, got one without depths in mm")
    error_mm = shape.xyz_mm[..., 2].astype(np.float64) - take.depth_mm
    returned = shape.returned & take.counted
    right = returned & (np.abs(shape.phase_rad - take.phase_rad) < np.pi)
    absolute_mm = np.abs(error_mm[right])
    rim = returned & (take.edge_distance_px < fringe_px(take))
    inside = within_percent(absolute_mm, shape.uncertainty_mm[right], (1, 2, 3))
    count = max(1, int(returned.sum()))
    return Figures(
        rms_mm=rms(absolute_mm),
        median_mm=float(np.median(absolute_mm)),
        p95_mm=float(np.percentile(absolute_mm, 95)),
        p99_mm=float(np.percentile(absolute_mm, 99)),
        rim_rms_mm=rms(error_mm[rim]),
        returned_percent=100 * count / int(take.counted.sum()),
        wrong_percent=100 * (1 - float(right.sum()) / count),
        inside_1_percent=inside[0],
        inside_2_percent=inside[1],
        inside_3_percent=inside[2],
        stated_wrong_percent=100 * float(np.mean(shape.wrong_order_probability[returned])),
    )


def fringe_px(take: Take) -> float:
    """Give the usual fringe period, in camera pixels along the rows."""
    return float(2 * np.pi / np.nanmedian(np.abs(np.diff(take.phase_rad, axis=1))))
