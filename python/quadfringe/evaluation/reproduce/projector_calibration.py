"""Calibration of both projectors as inverse cameras, and the accuracy of the correction and search based on it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from quadfringe.calibration.bundle import RigCalibration
from quadfringe.calibration.projector import StepPlan
from quadfringe.calibration.projector_pair import AXES, pair_pose
from quadfringe.calibration.rehearsal import board_poses, rehearse
from quadfringe.calibration.targets import ring_board
from quadfringe.config import SceneConfig, SystemConfig
from quadfringe.data import Calibration
from quadfringe.decoding.compare import rms
from quadfringe.evaluation.reproduce._pair_bench import (
    FRINGES,
    SEED,
    ProjectorPair,
    decoded,
    expose,
    infrared_error_rad,
    real_pair,
    wrong_percent,
)
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, draw_panels

__all__ = ["projector_calibration"]

POSES, STEPS = 9, 8  # nine poses, as published
# Each fit in words, with its published mean reprojection error, px.
FITS = (
    ("camera", "camera", None),
    ("visible", "visible projector", 0.2690),
    ("infrared", "infrared projector", 0.2210),
)
ENDS_MM = (700.0, 900.0)  # ends of the depth range


def projector_calibration(out: Path, shrink: int = 1, poses: int = POSES, steps: int = STEPS) -> Reproduction:
    """Calibrate a deviated pair from a ring board in nine poses; then use the result to correct and to search.

    The bench has all defects of a real one; its camera has 1/`shrink` of the pixels in each direction. Writes
    `out`/projector-calibration.png. The figures are: the mean reprojection errors in px (published: 0.2690 and 0.2210);
    the six parameters of the pair by the names of `quadfringe.calibration.projector_pair.AXES`, each with its error and
    the half width of its joint 95 % interval; the RMS error of the infrared fringes in rad at 36 fringes and the share
    of wrong orders in per cent, both after the correction on the reference plane and by the search along the ray at
    both ends of the depth range.
    """
    pair = real_pair(shrink=shrink)
    scene = SceneConfig(seed=SEED, **pair.light)
    devices = {"camera": pair.camera, "projector": pair.visible, "infrared": pair.infrared}
    config = SystemConfig(scene=scene, fringes=FRINGES, **devices)
    board = ring_board()
    found = rehearse(config, board, board_poses(board, poses), StepPlan(FRINGES, steps)).calibration
    assert found.visible is not None
    assert found.infrared is not None
    known = pair.calibration.model_copy(
        update={
            "camera": found.camera.device,
            "projector": found.visible.device,
            "infrared": found.infrared.device,
        }
    )
    means = [
        Figure(f"{name}_mean_px", f"mean reprojection error, {words}", getattr(found, name).mean_px, "px", published)
        for name, words, published in FITS
    ]
    off, used = _pair_figures(found, pair), _use_figures(pair, known)
    path = out / "projector-calibration.png"
    _draw(path, found, {one.name: one.value for one in off})
    outside = [one.name for one, reach in zip(off[1::3], off[2::3], strict=True) if abs(one.value) > reach.value]
    truth = "the true pose of the pair lies inside the stated interval"
    verdict = f"{truth}" if not outside else f"outside their stated interval: {', '.join(outside)}"
    return Reproduction((*means, *off, *used), (path,), verdict)


def _pair_figures(found: RigCalibration, pair: ProjectorPair) -> list[Figure]:
    """Name the six parameters of the pair, each with its error and the half width of its interval."""
    assert found.pair is not None
    (r1, t1), (r2, t2) = ((d.rotation, d.translation_mm) for d in (pair.visible, pair.infrared))
    truth = pair_pose(r1, t1, r2, t2).values
    reach = found.pair.interval(0.95)[:, 1] - found.pair.values
    rows = zip(AXES, found.pair.values, found.pair.values - truth, reach, truth, strict=True)
    return [
        one
        for axis, value, error, half, true in rows
        for one in (
            Figure(axis, f"pair: {axis[:2]}", float(value), axis[3:], expected=float(true)),
            Figure(f"{axis}_error", f"pair: {axis[:2]}, error", float(error), axis[3:]),
            Figure(f"{axis}_interval", f"pair: {axis[:2]}, half of the joint 95 % interval", float(half), axis[3:]),
        )
    ]


def _use_figures(pair: ProjectorPair, known: Calibration) -> list[Figure]:
    """Name the errors after correction on the reference plane, and by search at both ends of the depth range."""
    corrected = expose(pair, known=known, predeformed=True)
    figures = [
        Figure(
            "corrected_infrared_rms_rad",
            "pre-deformed by it: infrared fringes",
            rms(infrared_error_rad(corrected)),
            "rad RMS",
        ),
        Figure(
            "corrected_wrong_order_percent",
            "pre-deformed by it: wrong orders",
            wrong_percent(decoded(corrected), corrected.phase_rad),
            "%",
        ),
    ]
    for z_mm in ENDS_MM:
        plain = expose(pair, z_mm, known)
        name, words = f"searched_{z_mm:g}mm", f"searched by it at {z_mm:g} mm"
        wrong = wrong_percent(decoded(plain, unwrapping="pair"), plain.phase_rad)
        error_rad = rms(infrared_error_rad(plain, "pair"))
        figures.append(Figure(f"{name}_wrong_order_percent", f"{words}: wrong orders", wrong, "%"))
        figures.append(Figure(f"{name}_infrared_rms_rad", f"{words}: infrared fringes", error_rad, "rad RMS"))
    return figures


def _draw(path: Path, found: RigCalibration, figures: Mapping[str, float]) -> None:
    def residuals(name: str, words: str) -> Graph:
        fit = getattr(found, name)
        missed = np.concatenate(fit.residuals_px)
        lines = {"": (missed[:, 0], missed[:, 1])}
        title = f"{words}: {fit.mean_px:.4f} px mean"
        return Graph(title, "residual of x, px", "residual of y, px", lines, points=True)

    kinds = {"rotation, deg": AXES[:3], "translation, mm": AXES[3:]}
    errors = []
    for words, axes in kinds.items():
        x = np.arange(len(axes), dtype=float)
        error = np.array([figures[f"{axis}_error"] for axis in axes])
        reach = np.array([figures[f"{axis}_interval"] for axis in axes])
        name = "error, joint 95 % interval"
        lines, unit = {name: (x, error)}, words.rsplit(" ", 1)[1]
        errors.append(
            Graph(
                f"pair: error of {words}",
                "axis",
                unit,
                lines,
                points=True,
                spread={name: reach},
                ticks=[axis[:2] for axis in axes],
            )
        )
    row = [residuals("visible", "visible projector"), residuals("infrared", "infrared projector"), *errors]
    draw_panels(path, "both projectors calibrated: residuals and the pair", [row[:2], row[2:]])
