"""A shape against a surface: signed distances, and what they may depend on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape, xyz_mm_of
from quadfringe.decoding.compare import params
from quadfringe.decoding.compare.alignment import align as aligned
from quadfringe.decoding.compare.alignment import moved
from quadfringe.decoding.compare.deviations import bands_of, deviations_of
from quadfringe.decoding.compare.pixels import fringe_period_px_of, slopes, surface_angle_deg
from quadfringe.decoding.compare.profiles import profiles_of
from quadfringe.decoding.compare.results import MeshComparison
from quadfringe.decoding.compare.surface import Surface
from quadfringe.errors import InputError

__all__ = ["compare_surface"]

Map = NDArray[np.float64]


def compare_surface(shape: Shape, surface: Surface, *, align: bool) -> MeshComparison:
    """Give the distances of a shape from a surface; raises `InputError` without millimetres or without overlap."""
    xyz = xyz_mm_of(shape).astype(np.float64)
    known = np.isfinite(xyz).all(axis=2)
    if not known.any():
        raise InputError("compare: A returns no pixel")
    points, transform = xyz[known], np.eye(4)
    warnings: tuple[str, ...] = ()
    if align:
        found = aligned(points, surface)
        transform = found.transform
        if found.used < params.USED_MIN:
            warnings = (f"only {100 * found.used:.0f} % of the points fit the surface after the alignment",)
    closest = surface.closest(moved(points, transform), params.REACH_MM)
    distance = np.full(known.shape, np.nan)
    camera = transform[:3, 3]
    away = moved(points, transform) - closest.points_mm
    # The normal that looks to the camera: the order of the corners of a triangle does not matter.
    front = np.sign(np.sum(closest.normals * (camera - closest.points_mm), axis=1))
    side = np.sign(np.sum(closest.normals * away, axis=1)) * np.where(front == 0, 1, front)
    signed = side * closest.distances_mm
    distance[known] = np.where(np.isfinite(closest.distances_mm), signed, np.nan)
    matched = np.isfinite(distance)
    if not matched.any():
        raise InputError(
            f"compare: no point of A lies within {params.REACH_MM:g} mm of the surface; align them (align=True, or "
            "--align), and check that the mesh is in mm"
        )
    return _summed(shape, distance, matched, float(known.sum()), transform, warnings)


def _summed(
    shape: Shape,
    distance: Map,
    matched: NDArray[np.bool_],
    points: float,
    transform: NDArray[np.float64],
    warnings: tuple[str, ...],
) -> MeshComparison:
    sigma = None if shape.uncertainty_mm is None else shape.uncertainty_mm.astype(np.float64)
    column, period_px = shape.column_px.astype(np.float64), fringe_period_px_of(shape)
    rows, columns = distance.shape
    y, x = np.mgrid[:rows, :columns].astype(np.float64)
    angle = surface_angle_deg(xyz_mm_of(shape))
    quantities = {
        "modulation": ("share of full scale", shape.modulation.astype(np.float64)),
        "fringe phase": ("rad", np.mod(2 * np.pi / period_px * column, 2 * np.pi)),
        "image column": ("px", x),
        "image row": ("px", y),
        "surface angle": ("degrees from the line of sight", angle),
    }
    if sigma is not None:
        # A stated uncertainty is one along the line of sight; across the surface it is smaller.
        sigma = sigma * np.cos(np.radians(np.where(np.isfinite(angle), angle, 0.0)))
    slope = np.hypot(*slopes(column))
    known = np.isfinite(slope)
    fringe_px = period_px / max(float(np.median(slope[known])), 1e-3) if known.any() else 20.0
    return MeshComparison(
        distance_mm=distance.astype(np.float32),
        overall=deviations_of(distance, matched, sigma, "mm"),
        bands=bands_of(distance, matched, 0.187 * params.CUT_OFF_PERIODS * fringe_px),
        matched_percent=100 * float(matched.sum()) / points,
        transform=transform,
        profiles=profiles_of(distance, matched, quantities),
        warnings=warnings,
    )
