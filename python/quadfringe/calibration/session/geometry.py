"""Geometric steps of the guided calibration: board poses, registration, heights, acceptance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration._params import (
    COVERAGE_GRID,
    COVERAGE_MIN,
    HEIGHTS_AGREE_MAX_MM,
    REGISTERED_MAX_PX,
    REPROJECTION_MAX_PX,
)
from quadfringe.calibration.acceptance import Artefacts, accept
from quadfringe.calibration.bundle import Pose, RigCalibration, calibrate_rig
from quadfringe.calibration.detect import View, find_target
from quadfringe.calibration.height import HeightCalibration, compare_heights, fit_heights, heights_over
from quadfringe.calibration.projector import ProjectorMap, projector_points
from quadfringe.calibration.registration import Registration, register_views
from quadfringe.calibration.session.captures import Captures
from quadfringe.calibration.session.outcome import Outcome, record, worse
from quadfringe.data import Calibration, Shape, xyz_mm_of
from quadfringe.decoding import Decoder, Plan
from quadfringe.errors import CalibrationError, DecodeError

__all__ = ["acceptance", "coverage", "planes", "poses", "registration", "seen_image"]

Array = NDArray[np.float64]
Maps = Mapping[str, dict[str, ProjectorMap]]


def registration(captures: Captures, maps: Maps) -> Outcome:
    """Register the infrared chip to the visible chip, from the board in all poses."""
    target = captures.session.target
    found = register_views(
        *(
            [_view(pose[beam], target, f"pose {name}, {beam}") for name, pose in maps.items()]
            for beam in ("visible", "infrared")
        )
    )
    problems = []
    if found.after_rms_px > REGISTERED_MAX_PX:
        problems.append(
            f"the chips still lie {found.after_rms_px:.2f} px apart, at most {REGISTERED_MAX_PX} are accepted; focus "
            "both, "
            "and keep the board still"
        )
    good = (
        f"the infrared image is shifted by {found.shift_px[0]:+.2f}, {found.shift_px[1]:+.2f} px, turned by "
        f"{found.rotation_deg:+.3f} degrees and scaled by {found.scale:.5f}; {found.before_rms_px:.2f} px apart "
        f"before, {found.after_rms_px:.3f} px after"
    )
    remarks = worse("the distance of the chips", found.before_rms_px, found.after_rms_px)
    step = record("registration", tuple(maps), found.figures, problems, good, remarks=remarks)
    return Outcome(step, {"ir_registration": found.ir_registration}, {"registration": found})


def poses(captures: Captures, maps: Maps, registered: Registration | None) -> Outcome:
    """Adjust camera, projectors and all board poses in one fit."""
    session = captures.session
    affine = None if registered is None else registered.ir_registration
    observed = []
    for name, pose in maps.items():
        view = _view(pose["visible"], session.target, f"pose {name}")
        lit = {"visible": projector_points(pose["visible"], view)}
        if "infrared" in pose:
            lit["infrared"] = projector_points(pose["infrared"], view, ir_registration=affine)
        observed.append(Pose(view, **lit))
    rig = calibrate_rig(observed, session.target, distance_mm=session.distance_mm)
    devices = {"camera": rig.camera, "projector": rig.visible, "infrared": rig.infrared}
    fits = {name: fit for name, fit in devices.items() if fit is not None}
    covered = coverage([pose.view for pose in observed])
    figures = {f"{name}_mean_px": fit.mean_px for name, fit in fits.items()}
    figures |= {f"{name}_worst_px": fit.max_px for name, fit in fits.items()}
    figures |= {f"{name}_left_out": float(fit.left_out) for name, fit in fits.items()}
    seen = seen_image([pose.view for pose in observed])
    figures["covered_percent"] = 100 * float(seen.mean())
    problems = _pose_problems(figures, covered)
    means = ", ".join(f"{name} {fit.mean_px:.3f} px" for name, fit in fits.items())
    good = f"mean reprojection error: {means}; the board covered {figures['covered_percent']:.0f} % of the image"
    lost = sum(fit.left_out for fit in fits.values())
    good += f"; {lost} outliers were left out" if lost else ""
    step = record("poses", tuple(maps), figures, problems, good, _observations(rig, observed))
    fields = {name: fit.device for name, fit in fits.items()}
    return Outcome(step, fields, {"rig": rig, "observed": observed, "seen": seen})


def coverage(views: list[View]) -> NDArray[np.intp]:
    """Count the board points of all views in the fields of a 4 x 4 grid over the image."""
    width, height = views[0].size_px
    points = np.concatenate([view.points_px for view in views])
    counts = np.histogram2d(
        points[:, 1], points[:, 0], bins=COVERAGE_GRID, range=((-0.5, height - 0.5), (-0.5, width - 0.5))
    )[0]
    return np.asarray(counts, np.intp)


def seen_image(views: list[View]) -> NDArray[np.bool_]:
    """Return which pixels of the image, (H, W), lie inside the outline of the board points of any view."""
    width, height = views[0].size_px
    seen = np.zeros((height, width), np.uint8)
    for view in views:
        outline = cv2.convexHull(np.round(view.points_px).astype(np.int32))
        cv2.fillConvexPoly(seen, outline, 1)
    return seen.astype(np.bool_)


def _view(lit: ProjectorMap, target: Any, words: str) -> View:
    try:
        return find_target(lit.background, target)
    except CalibrationError as error:
        raise CalibrationError(error.reason, f"{words}: {error}") from error


def _pose_problems(figures: Mapping[str, float], covered: NDArray[np.intp]) -> list[str]:
    problems = [
        f"{name[: -len('_mean_px')]} has a mean reprojection error of {value:.2f} px, at most {REPROJECTION_MAX_PX} "
        "are accepted; "
        "take poses again in which the board moved"
        for name, value in figures.items()
        if name.endswith("_mean_px") and value > REPROJECTION_MAX_PX
    ]
    if (covered > 0).mean() < COVERAGE_MIN:
        rows, columns = ("top", "upper", "lower", "bottom"), ("left", "centre left", "centre right", "right")
        empty = [f"{rows[y]} {columns[x]}" for y, x in zip(*np.nonzero(covered == 0), strict=True)]
        problems.append(f"the board was never seen in these fields: {', '.join(empty[:6])}; add poses there")
    return problems


def _observations(rig: RigCalibration, observed: list[Pose]) -> dict[str, Any]:
    """Return the observations, so that the calibration can be repeated from its file."""
    found = {}
    for i, pose in enumerate(observed):
        seen = {"ids": pose.view.ids.tolist(), "camera_px": np.round(pose.view.points_px, 4).tolist()}
        for name, points in (("projector_px", pose.visible), ("infrared_px", pose.infrared)):
            if points is not None:
                rounded = np.round(points.points_px, 4)
                seen[name] = [[None if np.isnan(v) else float(v) for v in row] for row in rounded]
        found[f"pose_{i + 1}"] = seen | {"T_camera_board": np.round(rig.T_camera_board[i], 9).tolist()}
    return found


def planes(captures: Captures, calibration: Calibration) -> Outcome:
    """Fit height polynomials of phase per pixel, and compare them with triangulation on the same shots."""
    session = captures.session
    names = session.captures("planes")
    shapes = _decoded(captures, "planes", names, calibration)
    found = fit_heights(session.heights_mm, [shape.phase_rad for shape in shapes], session.height_degree)
    reference = shapes[int(np.argmin(np.abs(session.heights_mm)))]
    polynomial = [found.height_from_phase(shape.phase_rad) for shape in shapes]
    triangulated = [heights_over(xyz_mm_of(shape), xyz_mm_of(reference)) for shape in shapes]
    agreement = compare_heights(polynomial, triangulated)
    figures = {f"agreement_{name}": float(value) for name, value in vars(agreement).items()}
    figures["polynomial_rms_mm"] = float(np.sqrt(np.mean(np.square(found.residual_rms_mm))))
    problems = []
    if agreement.rms_mm > HEIGHTS_AGREE_MAX_MM:
        problems.append(
            f"polynomial and triangulation differ by {agreement.rms_mm:.3f} mm RMS, {agreement.scale_percent:+.3f} % "
            "in scale; measure the travel of the stage and the pitch of the board: one of them differs from its setting"
        )
    words = f"{agreement.rms_mm:.3f} mm RMS ({agreement.scale_percent:+.4f} % in scale)"
    good = f"polynomial and triangulation agree within {words}"
    details = {"heights": found, "polynomial": polynomial, "triangulated": triangulated}
    return Outcome(record("planes", names, figures, problems, good, {"degree": found.degree}), {}, details)


def acceptance(captures: Captures, calibration: Calibration) -> Outcome:
    """Judge the calibrated instrument by a plane, a sphere and steps."""
    session = captures.session
    names = session.captures("acceptance")
    plane, sphere, steps = (xyz_mm_of(shape) for shape in _decoded(captures, "acceptance", names, calibration))
    artefacts = Artefacts((plane,), (sphere,), session.sphere_diameter_mm, (steps,), session.step_heights_mm)
    found = accept(artefacts)
    figures = {line.name: line.value_mm for line in found.lines} | dict(found.figures)
    problems = [
        f"{line.name} is {line.value_mm:.3f} mm, the limit is {line.limit_mm:g} mm"
        for line in found.lines
        if not line.accepted
    ]
    if problems and not session.fringes.infrared:
        problems.append(
            "the limits are those of 36 fringes on 1024 x 768 pixels, and fringes of three colours are wider; take a "
            "larger image, less noise, or more fringes within columns_px, or judge by other limits"
        )
    worst = max(found.lines, key=lambda line: abs(line.value_mm) / line.limit_mm)
    figure = f"{worst.name}, {worst.value_mm:.3f} of {worst.limit_mm:g} mm"
    good = f"all figures are within their limits; the closest is {figure}"
    return Outcome(record("acceptance", names, figures, problems, good), {}, {"acceptance": found})


def _decoded(captures: Captures, step: str, names: tuple[str, ...], calibration: Calibration) -> list[Shape]:
    session = captures.session
    plan = Plan(calibration.projector.width_px, session.fringes, calibration)
    decoder: Decoder | None = None
    found = []
    for name in names:
        shot = captures.shot(step, name)
        decoder = decoder or Decoder(shot, plan)
        try:
            found.append(decoder.decode(shot))
        except DecodeError as error:
            raise CalibrationError("not_decoded", f"{step}/{name}: {error}") from error
    return found


def height_calibration(outcome: Outcome) -> HeightCalibration | None:
    """Return the per-pixel polynomials of the step `planes`, which are saved to a separate file."""
    heights = outcome.details.get("heights")
    return heights if isinstance(heights, HeightCalibration) else None
