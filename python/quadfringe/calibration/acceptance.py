"""Acceptance test of the instrument: a plane, a sphere and steps, in the manner of VDI/VDE 2634 part 2.

>>> import numpy as np
>>> from quadfringe.calibration.acceptance import *
>>> x, y = np.meshgrid(np.linspace(-100, 100, 400), np.linspace(-80, 80, 320))
>>> plane = np.dstack([x, y, 800 + 0.02 * np.sin(x / 20)])
>>> found = accept(Artefacts(planes=(plane,)), Limits(plane_form_mm=0.05))
>>> isinstance(found, Acceptance), found.accepted
(True, True)
>>> [(line.name, line.accepted) for line in found.lines if isinstance(line, Line)]
[('plane_1_form_mm', True)]
>>> SPHERE_DIAMETER_MM, STEP_HEIGHTS_MM[0]  # of the virtual bench, which measure_artefacts renders and decodes
(68.0, 5.0)
>>> from pathlib import Path
>>> write_acceptance(Path("acceptance.png"), found)  # doctest: +SKIP
>>> saved = read_artefacts([Path("plane.npz")], [], [], SPHERE_DIAMETER_MM, ())  # doctest: +SKIP
>>> virtual = measure_artefacts(qf.SystemConfig())  # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import ARTEFACT_BAND_MM, BORDER_PX, CAP_DEG
from quadfringe.calibration.surfaces import (
    Form,
    cap_towards_camera,
    dominant_plane,
    dominant_sphere,
    fit_plane,
    fit_sphere,
    form_of,
    measure_steps,
)
from quadfringe.calibration.trueness import (
    dimension_trueness_percent,
    global_planarity_mm,
    local_planarity_mm,
    point_precision_mm,
)
from quadfringe.config import SystemConfig
from quadfringe.data import AnyShot, Calibration, Shape, xyz_mm_of
from quadfringe.decoding import Decoder, Plan
from quadfringe.devices.virtual import VirtualBench
from quadfringe.view.report import Panel, draw_panels
from quadfringe.view.style import DIVERGING, symmetric

__all__ = [
    "SPHERE_DIAMETER_MM",
    "STEP_HEIGHTS_MM",
    "Acceptance",
    "Artefacts",
    "Limits",
    "Line",
    "accept",
    "measure_artefacts",
    "read_artefacts",
    "write_acceptance",
]

Map = NDArray[np.float32]
# Calibrated sizes of the artefacts in the built-in scenes of the virtual bench.
SPHERE_DIAMETER_MM = 68.0
FORM_LEAST_MM = 0.01  # least end of the colours of deviations
STEP_HEIGHTS_MM = (5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 45.0, 50.0)


@dataclass(frozen=True)
class Limits:
    """Largest accepted absolute value of each kind of figure, mm."""

    plane_form_mm: float = 0.10
    sphere_form_mm: float = 0.15
    sphere_size_mm: float = 0.10
    step_mm: float = 0.05


@dataclass(frozen=True)
class Artefacts:
    """Measured points (H, W, 3), mm, of each artefact, and its calibrated sizes; every kind may be absent.

    `repeats` are further captures of the first plane, for the precision of a point alone.
    """

    planes: tuple[Map, ...] = ()
    spheres: tuple[Map, ...] = ()
    sphere_diameter_mm: float = 0.0
    steps: tuple[Map, ...] = ()
    step_heights_mm: tuple[float, ...] = ()
    repeats: tuple[Map, ...] = ()


@dataclass(frozen=True)
class Line:
    """One figure and its limit, mm."""

    name: str
    value_mm: float
    limit_mm: float

    @property
    def accepted(self) -> bool:
        """Whether the absolute value of the figure is within the limit."""
        return abs(self.value_mm) <= self.limit_mm


@dataclass(frozen=True)
class Acceptance:
    """The judged figures, further figures by name, and the deviation map (H, W), mm, of every artefact by name."""

    lines: tuple[Line, ...]
    figures: Mapping[str, float]
    deviations_mm: Mapping[str, NDArray[np.float64]]

    @property
    def accepted(self) -> bool:
        """Whether every line is within its limit."""
        return all(line.accepted for line in self.lines)


def accept(artefacts: Artefacts, limits: Limits | None = None) -> Acceptance:
    """Judge measured artefacts; raises `InputError` when an artefact cannot be found in its points.

    Planes are judged by their form: the range of the distances from the fitted plane without the worst 3 of 1000
    points. Spheres are judged by the range inside +-3 standard deviations (`6sigma` in the name of the figure) and by
    their diameter. Points within 30 px of the image border are left out, and points of a sphere that the camera sees
    at more than 60 degrees from the surface normal.
    """
    limits = limits or Limits()
    found = [
        *(_plane(f"plane_{i}", xyz, limits) for i, xyz in enumerate(artefacts.planes, 1)),
        *(_sphere(f"sphere_{i}", xyz, artefacts, limits) for i, xyz in enumerate(artefacts.spheres, 1)),
        *(_steps(f"steps_{i}", xyz, artefacts, limits) for i, xyz in enumerate(artefacts.steps, 1)),
    ]
    point = point_precision_mm([*reversed(artefacts.repeats), *artefacts.planes])
    precision = {} if point is None else {"point_precision_mm": point}
    return Acceptance(
        lines=tuple(line for one in found for line in one.lines),
        figures=precision | {name: value for one in found for name, value in one.figures.items()},
        deviations_mm={name: image for one in found for name, image in one.deviations_mm.items()},
    )


def _plane(name: str, xyz_mm: Map, limits: Limits) -> Acceptance:
    inner = _without_border(xyz_mm)
    first = dominant_plane(inner)
    part = np.where((np.abs(first.distances_mm(inner)) < ARTEFACT_BAND_MM)[..., None], inner, np.nan)
    distances = fit_plane(part).distances_mm(part)
    form = form_of(distances)
    lines = (Line(f"{name}_form_mm", form.form_mm, limits.plane_form_mm),)
    words = {
        f"{name}_local_planarity_precision_mm": local_planarity_mm(distances),
        f"{name}_global_planarity_trueness_mm": global_planarity_mm(distances),
    }
    known = {key: value for key, value in words.items() if np.isfinite(value)}
    return Acceptance(lines, _form_figures(name, form) | known, {name: distances})


def _sphere(name: str, xyz_mm: Map, artefacts: Artefacts, limits: Limits) -> Acceptance:
    inner = _without_border(xyz_mm)
    sphere = dominant_sphere(inner, artefacts.sphere_diameter_mm)
    for _ in range(2):
        near = np.abs(sphere.distances_mm(inner)) < ARTEFACT_BAND_MM
        part = np.where((near & cap_towards_camera(inner, sphere, CAP_DEG))[..., None], inner, np.nan)
        sphere = fit_sphere(part, sphere)
    distances = sphere.distances_mm(part)
    form = form_of(distances)
    size = 2 * sphere.radius_mm - artefacts.sphere_diameter_mm
    lines = (
        Line(f"{name}_form_6sigma_mm", form.form_6sigma_mm, limits.sphere_form_mm),
        Line(f"{name}_size_error_mm", size, limits.sphere_size_mm),
    )
    x, y, z = (float(c) for c in sphere.centre_mm)
    place = {f"{name}_x_mm": x, f"{name}_y_mm": y, f"{name}_z_mm": z}
    place[f"{name}_dimension_trueness_percent"] = dimension_trueness_percent([size], [artefacts.sphere_diameter_mm])
    return Acceptance(lines, _form_figures(name, form) | place, {name: distances})


def _steps(name: str, xyz_mm: Map, artefacts: Artefacts, limits: Limits) -> Acceptance:
    found = measure_steps(_without_border(xyz_mm), artefacts.step_heights_mm)
    pairs = zip(found.nominal_mm, found.errors_mm, strict=True)
    lines = tuple(Line(f"{name}_{nominal:g}mm_error_mm", error, limits.step_mm) for nominal, error in pairs)
    words = {f"{name}_dimension_trueness_percent": dimension_trueness_percent(found.errors_mm, found.nominal_mm)}
    return Acceptance(lines, _form_figures(f"{name}_base", found.base) | words, {name: found.height_mm})


def _without_border(xyz_mm: Map) -> Map:
    return xyz_mm[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX]


def _form_figures(name: str, form: Form) -> dict[str, float]:
    return {
        f"{name}_points": float(form.points),
        f"{name}_sigma_mm": form.sigma_mm,
        f"{name}_form_mm": form.form_mm,
        f"{name}_form_6sigma_mm": form.form_6sigma_mm,
        f"{name}_cut_6sigma_percent": form.cut_percent,
    }


def measure_artefacts(config: SystemConfig, calibration: Calibration | None = None) -> Artefacts:
    """Measure two planes, a sphere and steps on the virtual bench of `config`, about 800 mm away.

    One plane faces the camera, twice, and one is tilted by 15 degrees; sphere and steps are built-in scenes. Light
    and camera are those of the scene of `config`, with new noise for each shot. Without a calibration, the exact one is
    used.
    """
    bench = VirtualBench(config)
    known = calibration or bench.calibration()
    bench.project(config.fringes)
    tilt = np.radians(15.0)
    shots: list[AnyShot] = []
    facing = (0.0, 0.0, -1.0)
    for normal in (facing, (float(np.sin(tilt)), 0.0, -float(np.cos(tilt)))):
        bench.place_plane((0.0, 0.0, 800.0), normal)
        shots.append(bench.expose(seed=_seed(config, len(shots))))
    for surface in ("sphere", "steps"):
        bench.place_scene(surface)
        shots.append(bench.expose(seed=_seed(config, len(shots))))
    bench.place_plane((0.0, 0.0, 800.0), facing)
    shots.append(bench.expose(seed=_seed(config, len(shots))))
    plan = Plan(known.projector.width_px, config.fringes, known, decode=config.decode)
    decoder = Decoder(shots[0], plan)
    points = [xyz_mm_of(decoder.decode(shot)) for shot in shots]
    return Artefacts(tuple(points[:2]), (points[2],), SPHERE_DIAMETER_MM, (points[3],), STEP_HEIGHTS_MM, (points[4],))


def _seed(config: SystemConfig, number: int) -> int:
    return 1000 * (1 + (config.scene.seed or 0)) + number


def read_artefacts(
    planes: Sequence[Path],
    spheres: Sequence[Path],
    steps: Sequence[Path],
    sphere_diameter_mm: float,
    step_heights_mm: Sequence[float],
) -> Artefacts:
    """Read measured artefacts from shapes saved as NPZ; raises `InputError` for an uncalibrated shape."""
    read = [tuple(xyz_mm_of(Shape.load(path)) for path in paths) for paths in (planes, spheres, steps)]
    return Artefacts(read[0], read[1], sphere_diameter_mm, read[2], tuple(step_heights_mm))


def write_acceptance(path: Path, found: Acceptance) -> None:
    """Write the deviation maps of all artefacts as one PNG; needs matplotlib (extra `plot`)."""
    forms = [image for name, image in found.deviations_mm.items() if not name.startswith("steps")]
    limits_mm = symmetric(*forms, least=FORM_LEAST_MM)
    panels = [_panel(name, image, limits_mm) for name, image in found.deviations_mm.items()]
    word = "accepted" if found.accepted else "not accepted"
    draw_panels(path, f"acceptance: {word}", [panels[i : i + 3] for i in range(0, len(panels), 3)])


def _panel(name: str, image: NDArray[np.float64], limits_mm: tuple[float, float]) -> Panel:
    words = name.replace("_", " ")
    if name.startswith("steps"):
        return Panel(f"{words}: height over the base", image, "mm")
    return Panel(f"{words}: deviation from the fit", image, "mm", DIVERGING, limits_mm)
