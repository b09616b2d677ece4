"""Height above a reference plane as a polynomial of phase for each pixel (S6), and how it agrees with triangulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.surfaces import fit_plane
from quadfringe.errors import InputError
from quadfringe.files import require_suffix
from quadfringe.io.export import read_npz, write_npz

__all__ = ["Agreement", "HeightCalibration", "compare_heights", "fit_heights", "heights_over"]

Map = NDArray[np.float32]
KEYS = ("reference_rad", "coefficients", "heights_mm", "residual_rms_mm")
BEYOND = 0.05  # share of the calibrated range that a height may lie outside of it: a polynomial does not extrapolate


@dataclass(frozen=True)
class HeightCalibration:
    """Per-pixel polynomials, the plane heights they come from, and the RMS of what each plane then misses, mm."""

    reference_rad: Map
    coefficients: NDArray[np.float64]
    heights_mm: tuple[float, ...]
    residual_rms_mm: tuple[float, ...]

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return int(self.coefficients.shape[2]) - 1

    def height_from_phase(self, phase_rad: Map) -> Map:
        """Give heights over the reference plane, (H, W) mm, positive towards the camera.

        NaN where the phase has none, where no polynomial was fitted, and beyond the heights of the planes. Raises
        ValueError for a map of another size.
        """
        kernel = _core.PolynomialHeight(self.reference_rad, self.coefficients)
        height = kernel.height_from_phase(np.ascontiguousarray(phase_rad, np.float32))
        low, high = min(self.heights_mm), max(self.heights_mm)
        room = BEYOND * (high - low)
        return np.where((height >= low - room) & (height <= high + room), height, np.float32(np.nan))

    def save(self, path: Path | str) -> None:
        """Write as NPZ, whole or not at all."""
        require_suffix(Path(path), (".npz",))
        write_npz(Path(path), {key: np.asarray(getattr(self, key)) for key in KEYS}, {})

    @classmethod
    def load(cls, path: Path | str) -> HeightCalibration:
        """Read back what `save` wrote; raises `InputError` for another file."""
        stored = read_npz(Path(path))
        if missing := [key for key in KEYS if key not in stored]:
            raise InputError(f"{path}: not a height calibration: no {', '.join(missing)}")
        heights, residuals = (tuple(stored[key].tolist()) for key in KEYS[2:])
        return cls(stored["reference_rad"], stored["coefficients"], heights, residuals)


def fit_heights(
    heights_mm: Sequence[float], phases_rad: Sequence[Map], degree: int = 3, reference: int | None = None
) -> HeightCalibration:
    """Fit height over the phase difference to the reference plane, pixel by pixel, from planes at known heights (S6).

    `phases_rad` has an absolute phase map (H, W) for each height; heights are positive towards the camera. The plane
    number `reference` is the one that differences are taken to; by default that of least height in size. Raises
    `InputError` when the numbers of maps and heights differ, the maps differ in size, or are too few for the degree.
    """
    heights = [float(h) for h in heights_mm]
    maps = [np.ascontiguousarray(phase, np.float32) for phase in phases_rad]
    if len(heights) != len(maps):
        raise InputError(f"heights: {len(heights)} heights for {len(maps)} phase maps; give one for each")
    if len({phase.shape for phase in maps}) > 1:
        raise InputError(f"heights: phase maps of sizes {sorted({phase.shape for phase in maps})}; all must be alike")
    if len(set(heights)) < degree + 2:
        raise InputError(
            f"heights: {len(set(heights))} different heights for degree {degree}; capture planes at {degree + 2} "
            "heights or more, so that the fit can be judged"
        )
    reference = int(np.argmin(np.abs(heights))) if reference is None else reference
    kernel = _core.PolynomialHeight.fit(maps[reference], heights, maps, degree)
    missed = [_rms(kernel.height_from_phase(phase) - h) for h, phase in zip(heights, maps, strict=True)]
    return HeightCalibration(maps[reference], kernel.coefficients(), tuple(heights), tuple(missed))


@dataclass(frozen=True)
class Agreement:
    """How heights of the two ways differ, polynomial minus triangulation: mm, and a share of scale.

    `scale_percent` and `offset_mm` say what of the difference is a line over height; `rms_mm` is all of it.
    """

    pixels: int
    mean_mm: float
    rms_mm: float
    worst_mm: float
    scale_percent: float
    offset_mm: float


def heights_over(xyz_mm: Map, reference_xyz_mm: Map) -> Map:
    """Give signed distances, (H, W) mm, of points from the plane through `reference_xyz_mm`, positive to the camera."""
    plane = fit_plane(reference_xyz_mm)
    return np.asarray(plane.distances_mm(xyz_mm), np.float32)


def compare_heights(polynomial_mm: Sequence[Map], triangulated_mm: Sequence[Map]) -> Agreement:
    """Compare heights (H, W) of the same shots by polynomial and by triangulation; `worst` holds for 99.9 % of them.

    Raises `InputError` when no pixel has both.
    """
    pairs = zip(polynomial_mm, triangulated_mm, strict=True)
    both = [np.stack([p, t])[:, np.isfinite(p) & np.isfinite(t)] for p, t in pairs]
    first, second = np.concatenate(both, axis=1).astype(float) if both else np.zeros((2, 0))
    if first.size < 2:
        raise InputError("heights: no pixel has a height both by polynomial and by triangulation")
    missed = first - second
    spread = second - second.mean()
    slope = float(spread @ missed / max(float(spread @ spread), 1e-12))
    return Agreement(
        pixels=first.size,
        mean_mm=float(missed.mean()),
        rms_mm=_rms(missed),
        worst_mm=float(np.quantile(np.abs(missed), 0.999)),
        scale_percent=100 * slope,
        offset_mm=float(missed.mean() - slope * second.mean()),
    )


def _rms(values: NDArray[np.floating]) -> float:
    finite = values[np.isfinite(values)].astype(float)
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")
