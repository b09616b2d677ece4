"""`compare`: the entry of the comparison."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, overload

import numpy as np

from quadfringe.config import brief
from quadfringe.data import Shape, Truth, xyz_mm_of
from quadfringe.decoding.compare import params
from quadfringe.decoding.compare.pixels import Pair, compare_pixels, fringe_period_px_of, pair_of
from quadfringe.decoding.compare.results import MeshComparison, ShapeComparison
from quadfringe.errors import InputError
from quadfringe.io.mesh_files import SUFFIXES as MESHES

if TYPE_CHECKING:
    from trimesh import Trimesh

    from quadfringe.decoding.compare.surface import Surface

__all__ = ["MESHES", "compare"]


@overload
def compare(
    a: Shape | Path | str,
    b: Shape | Truth,
    *,
    align: Literal[False] = ...,
    causes: bool = ...,
    fringe_period_px: float | None = ...,
) -> ShapeComparison: ...
@overload
def compare(
    a: Shape | Path | str,
    b: Shape | Truth | Trimesh | Path | str,
    *,
    align: bool = ...,
    causes: bool = ...,
    fringe_period_px: float | None = ...,
) -> ShapeComparison | MeshComparison: ...
def compare(
    a: Shape | Path | str,
    b: Shape | Truth | Trimesh | Path | str,
    *,
    align: bool = False,
    causes: bool = True,
    fringe_period_px: float | None = None,
) -> ShapeComparison | MeshComparison:
    """Compare two shapes of one camera, a shape with the truth of the bench, or with a mesh; say why they differ.

    `a` is a shape, or the path of one (.npz). `b` is a shape or its path, a `Truth`, a mesh of trimesh, or the path of
    a mesh (.stl, .ply, .obj in mm, .glb in metres with y up; extra `export`). Shape and truth are compared pixel by
    pixel, A less B, as `ShapeComparison`; a mesh by the distance to its closest point, as `MeshComparison`. With
    `align`, the points of A are moved onto B first by a rigid motion, and a shape B counts as a surface, so that its
    camera may be another.
    `causes` names causes, which takes about 2 s: gamma and crosstalk, where one of the two comes from a single shot,
    defocus and less light between two shapes, wrong orders, calibration or pose, and another surface.
    `fringe_period_px` is the width of a fringe in columns of the projector, by default that of A.

    Raises `InputError` for shapes of unequal size or without a common pixel, and for a mesh or `align` without
    millimetres.

    >>> import quadfringe as qf
    >>> camera = qf.Device(width_px=512, height_px=384, focal_px=(1290, 1290), centre_px=(255.5, 191.5))
    >>> with qf.open(qf.SystemConfig(camera=camera, scene=qf.SceneConfig(noise=0.03))) as scanner:
    ...     shot = scanner.grab()
    ...     shape = scanner.decode(shot)
    >>> found = qf.compare(shape, shot.truth)
    >>> found.returned_percent > 95, found.right.rms < 0.1, found.causes
    (True, True, ())
    """
    a, b = _shape(a, "A"), _other(b)
    if not isinstance(b, (Shape, Truth)) or align:
        from quadfringe.decoding.compare.meshes import compare_surface

        return compare_surface(a, _surface(b), align=align)
    return _compare_pixels(pair_of(a, b, fringe_period_px or fringe_period_px_of(a)), causes)


def _compare_pixels(pair: Pair, causes: bool) -> ShapeComparison:
    doubts = _doubts(pair)
    found = replace(compare_pixels(pair), warnings=doubts)
    if not causes or not found.overall.pixels:
        return found
    from quadfringe.decoding.compare.causes import causes_of

    return replace(found, causes=causes_of(pair, found.overall))


def _shape(given: object, name: str) -> Shape:
    if isinstance(given, Shape):
        return given
    if isinstance(given, (str, Path)):
        return Shape.load(given)
    raise InputError(f"compare: {name}: expected a Shape, or the path of one (.npz), got {brief(given)}")


def _other(given: Shape | Truth | Trimesh | Path | str) -> Shape | Truth | Trimesh | Path | str:
    """Read B where it is the path of a shape; raises `InputError` for what cannot be compared with."""
    if isinstance(given, (str, Path)):
        suffix = Path(given).suffix.lower()
        if suffix == ".npz":
            return Shape.load(given)
        if suffix not in MESHES:
            raise InputError(f"{given}: expected a shape (.npz) or a mesh ({', '.join(MESHES)})")
        return given
    if isinstance(given, (Shape, Truth)) or hasattr(given, "triangles"):
        return given
    raise InputError(f"compare: B: expected a Shape, a Truth, a mesh or a path, got {brief(given)}")


def _surface(b: Shape | Truth | Trimesh | Path | str) -> Surface:
    from quadfringe.decoding.compare.surface import surface_from, surface_of_grid

    if isinstance(b, Truth):
        return surface_of_grid(b.xyz_mm)
    return surface_of_grid(xyz_mm_of(b)) if isinstance(b, Shape) else surface_from(b)


def _doubts(pair: Pair) -> tuple[str, ...]:
    """Say what makes a comparison doubtful; raises `InputError` when no pixel is returned by both."""
    if not (pair.returned_a & pair.returned_b).any():
        raise InputError("compare: no pixel is returned by both; check that both show the same scene with one camera")
    a, b, found = pair.a, pair.b, []
    if not isinstance(b, Shape):
        return ()
    if a.calibration and b.calibration and a.calibration != b.calibration:
        found.append("the calibrations of A and B differ, so that a difference may come from them")
    if (a.xyz_mm is None) != (b.xyz_mm is None):
        found.append(f"{'A' if a.xyz_mm is None else 'B'} holds phase only, so that phases are compared and no depths")
    if a.xyz_mm is not None and b.xyz_mm is not None:
        both = np.isfinite(a.xyz_mm[..., 2]) & np.isfinite(b.xyz_mm[..., 2])
        if not both.any():
            found.append("no pixel has a point in both, so that no depths are compared")
    other_px = fringe_period_px_of(b)
    if np.isfinite(other_px) and abs(other_px / pair.period_px - 1) > params.PERIOD_OFF:
        found.append(
            f"the fringes of A and B differ, {pair.period_px:.4g} and {other_px:.4g} columns wide; columns are compared"
        )
    return tuple(found)
