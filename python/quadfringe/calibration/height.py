"""Height above a reference plane as a polynomial of phase per pixel (S6), and its comparison with triangulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration._params import HEIGHT_BEYOND
from quadfringe.calibration.surfaces import fit_plane
from quadfringe.errors import InputError
from quadfringe.files import require_suffix
from quadfringe.io.arrays import read_npz
from quadfringe.io.export import write_npz

__all__ = ["Agreement", "HeightCalibration", "compare_heights", "fit_heights", "heights_over"]

Map = NDArray[np.float32]
KEYS = ("reference_rad", "coefficients", "heights_mm", "residual_rms_mm")


@dataclass(frozen=True)
class HeightCalibration:
    """Height polynomials of every pixel, and the planes that they were fitted to.

    `reference_rad` (H, W) is the phase of the reference plane, `coefficients` (H, W, degree + 1) give the height in mm,
    `heights_mm` are the heights of the planes and `residual_rms_mm` the RMS residual of each plane.
    """

    reference_rad: Map
    coefficients: NDArray[np.float64]
    heights_mm: tuple[float, ...]
    residual_rms_mm: tuple[float, ...]

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return int(self.coefficients.shape[2]) - 1

    def height_from_phase(self, phase_rad: Map) -> Map:
        """Return heights above the reference plane, (H, W) mm, positive towards the camera.

        NaN where the phase is NaN, where no polynomial was fitted, and more than 5 % of the calibrated range outside
        it. Raises ValueError for a map of another size.
        """
        kernel = _core.PolynomialHeight(self.reference_rad, self.coefficients)
        height = kernel.height_from_phase(np.ascontiguousarray(phase_rad, np.float32))
        low, high = min(self.heights_mm), max(self.heights_mm)
        room = HEIGHT_BEYOND * (high - low)
        return np.where((height >= low - room) & (height <= high + room), height, np.float32(np.nan))

    def save(self, path: Path | str) -> None:
        """Write as NPZ; the file is complete or does not exist."""
        require_suffix(Path(path), (".npz",))
        write_npz(Path(path), {key: np.asarray(getattr(self, key)) for key in KEYS}, {})

    @classmethod
    def load(cls, path: Path | str) -> HeightCalibration:
        """Read a file of `save`; raises `InputError` for any other file."""
        stored = read_npz(Path(path))
        if missing := [key for key in KEYS if key not in stored]:
            raise InputError(
                f"{path}: not a height calibration: {', '.join(missing)} missing; make one with calibrate run --heights"
            )
        arrays = reference, coefficients, heights, residuals = [stored[key] for key in KEYS]
        if [array.ndim for array in arrays] != [2, 3, 1, 1] or any(array.dtype.kind not in "fiu" for array in arrays):
            got = ", ".join(f"{key} {array.dtype} {array.shape}" for key, array in zip(KEYS, arrays, strict=True))
            raise InputError(f"{path}: expected arrays (H, W), (H, W, degree + 1) and two lists of numbers, got {got}")
        if coefficients.shape[:2] != reference.shape or heights.shape != residuals.shape or not heights.size:
            raise InputError(f"{path}: expected coefficients for every pixel, and a residual for every height")
        return cls(reference, coefficients, tuple(heights.tolist()), tuple(residuals.tolist()))


def fit_heights(
    heights_mm: Sequence[float], phases_rad: Sequence[Map], degree: int = 3, reference: int | None = None
) -> HeightCalibration:
    """Fit height against the phase difference to a reference plane, for each pixel, from planes at known heights (S6).

    `phases_rad` holds an absolute phase map (H, W) for each height; heights are positive towards the camera.
    `reference` is the index of the reference plane, by default the one with the smallest absolute height. Raises
    `InputError` when maps and heights differ in number, when the maps differ in size, and when there are fewer than
    degree + 2 heights.
    """
    heights = [float(h) for h in heights_mm]
    maps = [np.ascontiguousarray(phase, np.float32) for phase in phases_rad]
    if len(heights) != len(maps):
        raise InputError(f"heights: {len(heights)} heights for {len(maps)} phase maps; give one for each")
    if len({phase.shape for phase in maps}) > 1:
        raise InputError(
            f"heights: phase maps of sizes {sorted({phase.shape for phase in maps})}; all must have one size"
        )
    if len(set(heights)) < degree + 2:
        raise InputError(
            f"heights: {len(set(heights))} different heights for degree {degree}; capture planes at {degree + 2} "
            "heights or more, or lower the degree"
        )
    reference = int(np.argmin(np.abs(heights))) if reference is None else reference
    kernel = _core.PolynomialHeight.fit(maps[reference], heights, maps, degree)
    missed = [_rms(kernel.height_from_phase(phase) - h) for h, phase in zip(heights, maps, strict=True)]
    return HeightCalibration(maps[reference], kernel.coefficients(), tuple(heights), tuple(missed))


@dataclass(frozen=True)
class Agreement:
    """Difference between heights by polynomial and by triangulation, polynomial minus triangulation.

    `mean_mm` and `rms_mm` describe the whole difference, `worst_mm` is its 99.9 % quantile; `scale_percent` and
    `offset_mm` are the slope and the intercept of the difference against height.
    """

    pixels: int
    mean_mm: float
    rms_mm: float
    worst_mm: float
    scale_percent: float
    offset_mm: float


def heights_over(xyz_mm: Map, reference_xyz_mm: Map) -> Map:
    """Return distances (H, W), mm, of points from the plane fitted to `reference_xyz_mm`, positive to the camera."""
    plane = fit_plane(reference_xyz_mm)
    return np.asarray(plane.distances_mm(xyz_mm), np.float32)


def compare_heights(polynomial_mm: Sequence[Map], triangulated_mm: Sequence[Map]) -> Agreement:
    """Compare height maps (H, W) of the same shots by polynomial and by triangulation.

    Raises `InputError` when no pixel has both.
    """
    pairs = zip(polynomial_mm, triangulated_mm, strict=True)
    both = [np.stack([p, t])[:, np.isfinite(p) & np.isfinite(t)] for p, t in pairs]
    first, second = np.concatenate(both, axis=1).astype(float) if both else np.zeros((2, 0))
    if first.size < 2:
        raise InputError(
            "heights: no pixel has a height both by polynomial and by triangulation; check that the shots are the same"
        )
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
