"""A shape compared with the truth of the virtual bench.

>>> import quadfringe as qf
>>> from quadfringe.decoding.compare import compare
>>> with qf.open() as scanner:
...     shot = scanner.grab()
...     shape = scanner.decode(shot)
>>> compare(shape, shot.truth, 912 / 36).returned_percent > 95
True
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape, Truth, xyz_mm_of

__all__ = ["Comparison", "compare", "rms"]


@dataclass(frozen=True, repr=False)
class Comparison:
    """Figures of one shape.

    depth_error_mm: error of the depth, (H, W), mm; NaN where no depth is returned.
    depth_rms_mm: its RMS over returned pixels away from edges and shadow borders, wrong orders included.
    wrong_order_percent: share of the returned pixels whose fringe order is wrong.
    returned_percent: share of the lit pixels that are returned.
    """

    depth_error_mm: NDArray[np.float32]
    depth_rms_mm: float
    wrong_order_percent: float
    returned_percent: float

    def __repr__(self) -> str:
        return (
            f"Comparison(depth_rms_mm={self.depth_rms_mm:.4g}, wrong_order_percent={self.wrong_order_percent:.4g}, "
            f"returned_percent={self.returned_percent:.4g})"
        )


def rms(values: NDArray[np.floating]) -> float:
    """Root mean square of the finite values; NaN when there are none."""
    finite = values[np.isfinite(values)].astype(np.float64)
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def compare(shape: Shape, truth: Truth, fringe_period_px: float) -> Comparison:
    """Compare a calibrated shape with the truth; an order is wrong when the column is off by half a fringe or more.

    Raises `InputError` for a shape without millimetres.
    """
    error = xyz_mm_of(shape)[:, :, 2] - truth.depth_mm
    lit = np.isfinite(truth.column_px) & ~truth.shadow
    smooth = lit & ~truth.edge
    returned = shape.returned
    wrong = ~(np.abs(shape.column_px - truth.column_px) < fringe_period_px / 2)
    return Comparison(
        depth_error_mm=error,
        depth_rms_mm=rms(error[smooth]),
        wrong_order_percent=_percent(wrong & returned, returned),
        returned_percent=_percent(returned & lit, lit),
    )


def _percent(part: NDArray[np.bool_], whole: NDArray[np.bool_]) -> float:
    count = int(whole.sum())
    return 100.0 * int(part.sum()) / count if count else float("nan")
