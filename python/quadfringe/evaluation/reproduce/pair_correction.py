"""The pre-deformed infrared pattern: the errors before and after, and the remaining deviation."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.projector_pair import AXES, PairPose, pair_pose
from quadfringe.config import Device
from quadfringe.data import Calibration, core_device
from quadfringe.decoding.compare import rms
from quadfringe.devices.light import predeformation
from quadfringe.errors import InputError
from quadfringe.evaluation.reproduce._deviated_pair import (
    FRINGES,
    PLANE_MM,
    Exposure,
    ProjectorPair,
    decoded,
    expose,
    infrared_error_rad,
    real_pair,
    wrong_percent,
)
from quadfringe.evaluation.reproduction import Reproduction
from quadfringe.view.report import Graph, Panel, draw_panels

__all__ = ["pair_correction", "remaining_deviation"]

Map = NDArray[np.float32]
ROW = 130  # the row of the published profile
CASES = ("single", "before", "after")
# Points of boards around the reference plane, as a second calibration would see them.
BOARD_X_MM, BOARD_Y_MM, BOARD_Z_MM = (-120, -60, 0, 60, 120), (-80, -40, 0, 40, 80), (-40, 0, 40)


def pair_correction(out: Path, shrink: int = 1, calibration: Calibration | None = None) -> Reproduction:
    """Correct a deviated pair by pre-deforming its infrared image; compare with a single projector on the plane.

    The bench has all defects of a real one. `calibration` is the known calibration of the pair, by default the exact
    one. Writes `out`/pair-correction.png. Figures in rad at 36 fringes, over the image and along row 130: `*_rms_rad`
    is the error of the unwrapped phase against the phase of a single projector, `infrared_*` the error of the infrared
    fringes against their expected phase. Further figures: wrong orders in per cent, and the deviation that a second
    calibration would find, deg and mm.
    """
    pair = real_pair(shrink=shrink)
    known = calibration or pair.calibration
    shots = {
        "single": expose(pair.single),
        "before": expose(pair),
        "after": expose(pair, known=known, predeformed=True),
    }
    row = ROW // shrink
    errors: dict[str, Map] = {}
    figures: dict[str, float] = {}
    for name, shot in shots.items():
        phase_rad = decoded(shot)
        errors[name] = phase_rad - shot.phase_rad
        figures[f"{name}_wrong_order_percent"] = wrong_percent(phase_rad, shot.phase_rad)
    for name in CASES[1:]:
        off = errors[name] - errors["single"]
        figures[f"{name}_rms_rad"], figures[f"{name}_rms_rad_row{ROW}"] = rms(off), rms(off[row])
    off = decoded(shots["after"], "joint") - decoded(shots["single"], "joint")
    figures["after_joint_rms_rad"], figures[f"after_joint_rms_rad_row{ROW}"] = rms(off), rms(off[row])
    infrared = {name: shots[name].apart_rad if name == "before" else infrared_error_rad(shots[name]) for name in CASES}
    for name in CASES:
        figures[f"infrared_{name}_rms_rad"] = rms(infrared[name])
        figures[f"infrared_{name}_rms_rad_row{ROW}"] = rms(infrared[name][row])
    left = remaining_deviation(pair, known)
    figures |= {f"remaining_{axis}": float(value) for axis, value in zip(AXES, left.values, strict=True)}
    _draw(out / "pair-correction.png", shots, known, errors, infrared, row, figures)
    return Reproduction(figures, out / "pair-correction.png")


def remaining_deviation(pair: ProjectorPair, known: Calibration) -> PairPose:
    """Return the deviation that a second calibration would find with the pre-deformed patterns.

    Each mirror of the infrared projector now represents the position in the visible projector that its intensity was
    computed from; a calibration fits a pose to these positions for the points of a board.
    """
    if known.infrared is None:
        raise InputError("calibration: expected both projectors, got one without `infrared`; calibrate both")
    real = core_device(pair.infrared)
    believed = (core_device(known.infrared), core_device(known.projector))
    points, seen = [], []
    for x, y, z in product(BOARD_X_MM, BOARD_Y_MM, BOARD_Z_MM):
        point = (float(x), float(y), PLANE_MM + z)
        mirror = real.project(point)
        position = None if mirror is None else believed[0].through_plane(mirror, believed[1], PLANE_MM)
        if position is not None:
            points.append(point)
            seen.append(position)
    rotation, translation_mm = _posed(known.projector, np.array(points), np.array(seen))
    return pair_pose(known.projector.rotation, known.projector.translation_mm, rotation, translation_mm)


def _posed(
    device: Device, points_mm: NDArray[np.float64], seen_px: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    (fx, fy), (cx, cy) = device.focal_px, device.centre_px
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    _, vector, translation_mm = cv2.solvePnP(points_mm, seen_px, matrix, np.array(device.distortion))
    return cv2.Rodrigues(vector)[0].astype(np.float64), np.asarray(translation_mm, dtype=np.float64).ravel()


def _draw(
    path: Path,
    shots: Mapping[str, Exposure],
    known: Calibration,
    errors: Mapping[str, Map],
    infrared: Mapping[str, Map],
    row: int,
    figures: Mapping[str, float],
) -> None:
    deformed = predeformation(shots["after"].fringes, known)
    assert deformed is not None
    width, height = known.projector.width_px, known.projector.height_px
    plain = _core.pattern("IR", FRINGES.numbers, width, height)
    patterns = [
        Panel("infrared image, plain", plain, "", "gray", (0.0, 1.0)),
        Panel(
            "infrared image, pre-deformed", deformed.light(FRINGES.numbers[2], FRINGES.layout), "", "gray", (0.0, 1.0)
        ),
        Panel("infrared fringes before: apart by", infrared["before"], "rad", "coolwarm"),
        Panel(
            f"after: {figures['infrared_after_rms_rad']:.4f} rad RMS", infrared["after"], "rad", "coolwarm", (-0.1, 0.1)
        ),
    ]
    x = np.arange(errors["single"].shape[1])
    words = {"single": "one projector", "before": "before", "after": "after"}

    def graph(title: str, maps: Mapping[str, Map], names: tuple[str, ...]) -> Graph:
        lines = {f"{words[n]}: {rms(maps[n][row]):.3g} rad RMS": (x, maps[n][row]) for n in names}
        return Graph(title, "column of the camera", "rad at 36 fringes", lines)

    profiles = [
        graph(f"row {ROW}: unwrapped phase, error", errors, ("before", "after", "single")),
        graph(f"row {ROW}: unwrapped phase, error", errors, ("after", "single")),
        graph(f"row {ROW}: infrared fringes, error", infrared, ("before", "after", "single")),
        graph(f"row {ROW}: infrared fringes, error", infrared, ("after", "single")),
    ]
    draw_panels(path, "a deviated pair before and after its infrared image was pre-deformed", [patterns, profiles])
