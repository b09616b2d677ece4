"""The pre-deformed infrared pattern: the errors before and after, and the remaining deviation."""

from __future__ import annotations

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
from quadfringe.evaluation.reproduce._pair_bench import (
    FRINGES,
    PLANE_MM,
    ProjectorPair,
    real_pair,
)
from quadfringe.evaluation.reproduce.row_profile import CASES, ROW, Cases, measured, profile_figures
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, Panel, draw_panels
from quadfringe.view.style import DIVERGING, symmetric

__all__ = ["correction", "remaining_deviation"]

# Points of boards around the reference plane, as a second calibration would see them.
BOARD_X_MM, BOARD_Y_MM, BOARD_Z_MM = (-120, -60, 0, 60, 120), (-80, -40, 0, 40, 80), (-40, 0, 40)


def correction(out: Path, shrink: int = 1, calibration: Calibration | None = None) -> Reproduction:
    """Correct a deviated pair by pre-deforming its infrared image; compare with a single projector on the plane.

    The bench has all defects of a real one. `calibration` is the known calibration of the pair, by default the exact
    one. Writes `out`/correction.png. Figures in rad at 36 fringes, over the image and along row 130: `*_rms_rad`
    is the error of the unwrapped phase against the phase of a single projector, `infrared_*` the error of the infrared
    fringes against their expected phase. Further figures: wrong orders in per cent, and the deviation that a second
    calibration would find, deg and mm.
    """
    pair = real_pair(shrink=shrink)
    known = calibration or pair.calibration
    cases = measured(pair, known)
    left = remaining_deviation(pair, known)
    records = [
        *_field_figures(cases),
        *profile_figures(cases, ROW // shrink),
        *(
            Figure(f"remaining_{axis}", f"deviation left: {axis[:2]}", float(value), axis[3:])
            for axis, value in zip(AXES, left.values, strict=True)
        ),
    ]
    path = out / "correction.png"
    _draw(path, cases, known)
    return Reproduction(tuple(records), (path,), _verdict(cases))


def _field_figures(cases: Cases) -> list[Figure]:
    """Name the errors over the image."""
    wrong = [
        Figure(f"{name}_wrong_order_percent", f"{cases.words[name]}: wrong orders", cases.wrong_percent[name], "%")
        for name in CASES
    ]
    phase = [
        Figure(f"{name}_rms_rad", f"{cases.words[name]}: unwrapped phase against one projector", rms(off), "rad RMS")
        for name, off in cases.off_single.items()
    ]
    infrared = [
        Figure(
            f"infrared_{name}_rms_rad", f"{cases.words[name]}: infrared fringes", rms(cases.infrared[name]), "rad RMS"
        )
        for name in CASES
    ]
    return [*wrong, *phase, *infrared]


def _verdict(cases: Cases) -> str:
    before, after = (rms(cases.infrared[name]) for name in CASES[1:])
    word = "takes the error of the infrared fringes" if after < before else "makes it WORSE: the error goes"
    return (
        f"the correction {word} from {before:.3g} to {after:.3g} rad RMS, and wrong orders from "
        f"{cases.wrong_percent['before']:.3g} to {cases.wrong_percent['after']:.3g} %"
    )


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


def _draw(path: Path, cases: Cases, known: Calibration) -> None:
    deformed = predeformation(cases.shots["after"].fringes, known)
    assert deformed is not None
    width, height = known.projector.width_px, known.projector.height_px
    plain = _core.pattern("IR", FRINGES.numbers, width, height)
    light = deformed.light(FRINGES.numbers[2], FRINGES.layout)
    before, after = (cases.infrared[name] for name in CASES[1:])
    words = [f"{rms(one):.3g} rad RMS" for one in (before, after)]
    turns, row = cases.turns["before"], ROW * before.shape[0] // known.camera.height_px
    along = {cases.words[n]: (np.arange(before.shape[1]), cases.infrared[n][row]) for n in ("after", "single")}
    wrong = cases.wrong_percent
    rows: list[list[Panel | Graph]] = [
        [
            Panel("infrared image, plain", plain, "share of full light", "gray", (0.0, 1.0)),
            Panel("infrared image, pre-deformed", light, "share of full light", "gray", (0.0, 1.0)),
            Panel(f"orders before: {wrong['before']:.3g} % wrong", turns, "fringes off", DIVERGING, symmetric(turns)),
        ],
        [
            Panel(f"infrared fringes before: {words[0]}", before, "error, rad", DIVERGING, symmetric(before)),
            Panel(f"after, finer scale: {words[1]}", after, "error, rad", DIVERGING, symmetric(after)),
            Graph(f"infrared fringes along row {ROW}", "column, px", "error, rad", along),
        ],
    ]
    draw_panels(path, "a deviated pair before and after its infrared image was pre-deformed", rows)
