"""Whether a calibration can be trusted: its own record, and what its numbers say."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from quadfringe.config import ChannelResponse, Device, Response
from quadfringe.data import Calibration
from quadfringe.doctor.finding import Finding, graded

__all__ = ["examine_calibration"]

AGE_DAYS = (90.0, 730.0)
BASELINE_DEG = (8.0, 3.0)  # least angle between the axes of sight of camera and projector at the working distance
CONDITION = (4.0, 20.0)  # of the crosstalk matrix: how much noise grows by undoing it
EXPONENTS = (0.3, 2.5)
WORKING_MM = 800.0
AGAIN = "calibrate again: quadfringe calibrate"


def examine_calibration(calibration: Calibration) -> list[Finding]:
    """Look at the record and at the numbers."""
    return [
        *_record(calibration),
        _baseline(calibration),
        *(_device(name, getattr(calibration, name)) for name in ("camera", "projector")),
        *_pair(calibration),
        *_responses(calibration),
        _crosstalk(calibration),
    ]


def _record(calibration: Calibration) -> list[Finding]:
    record = calibration.record
    if record is None:
        words = "the file does not say how it was made, from what, and what was left over"
        return [Finding("record", "warning", words, f"{AGAIN}, which keeps inputs and residuals")]
    age_days = (datetime.now(UTC) - datetime.fromisoformat(record.made_utc)).total_seconds() / 86400
    words = f"made {record.made_utc} by quadfringe {record.quadfringe_version} for {record.rig}"
    fix = f"check it with quadfringe accept, and {AGAIN} when a limit is not kept"
    found = [graded("age", age_days, AGE_DAYS, words, fix)]
    for step in record.steps:
        fix = "" if step.good else f"take the captures of this step again as it says, then {AGAIN}"
        found.append(Finding(f"step {step.name}", "good" if step.good else "fault", step.verdict, fix))
    return found


def _baseline(calibration: Calibration) -> Finding:
    projector = calibration.projector
    centre = -np.array(projector.rotation).T @ np.array(projector.translation_mm)
    to_point = np.array([0.0, 0.0, WORKING_MM])
    towards = to_point - centre
    cos = float(towards @ to_point / (np.linalg.norm(towards) * WORKING_MM))
    angle = float(np.degrees(np.arccos(np.clip(cos, -1, 1))))
    words = f"camera and projector see a point {WORKING_MM:g} mm away {angle:.1f} degrees apart"
    fix = "place the projector farther from the camera: depth errors grow with one over this angle"
    return graded("triangulation angle", angle, BASELINE_DEG, words, fix)


def _device(name: str, device: Device) -> Finding:
    away = max(
        abs(centre / (0.5 * (size - 1)) - 1)
        for centre, size in zip(device.centre_px, (device.width_px, device.height_px), strict=True)
    )
    words = f"principal point {device.centre_px[0]:.1f}, {device.centre_px[1]:.1f} px of {device.width_px} x "
    words += f"{device.height_px}, focal length {device.focal_px[0]:.1f} px"
    limits = (0.25, 0.6) if name == "camera" else (1.1, 1.5)  # projectors are often made to look upwards
    return graded(name, away, limits, words, "add tilted poses of the board, over the whole field, and calibrate again")


def _pair(calibration: Calibration) -> list[Finding]:
    if calibration.infrared is None:
        return [Finding("coaxial pair", "good", "taken as coaxial: one projector stands for both")]
    first, second = calibration.projector, calibration.infrared
    turn = np.array(second.rotation) @ np.array(first.rotation).T
    shift = np.array(second.translation_mm) - turn @ np.array(first.translation_mm)
    angle = float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))))
    words = f"turned by {angle:.3f} degrees and shifted by {float(np.linalg.norm(shift)):.3f} mm against one another"
    fix = "align the projectors at the beam splitter, or correct the pattern with quadfringe reproduce's correction"
    return [graded("coaxial pair", max(angle / 2.0, float(np.linalg.norm(shift)) / 5.0), (1.0, 3.0), words, fix)]


def _responses(calibration: Calibration) -> list[Finding]:
    found = []
    for what, response in (("response", calibration.response), ("projector response", calibration.projector_response)):
        channels = response or Response()
        for name in Response.model_fields:
            channel: ChannelResponse = getattr(channels, name)
            if not EXPONENTS[0] <= channel.exponent <= EXPONENTS[1]:
                words = f"exponent {channel.exponent:.2f} of {name} is outside {EXPONENTS[0]} to {EXPONENTS[1]}"
                fix = "look at the captures of the levels: a channel may be saturated, or not lit by its own projector"
                found.append(Finding(what, "fault", words, fix))
    if not found:
        words = "no response is known: taken as linear" if calibration.response is None else "exponents are plausible"
        grade = "warning" if calibration.response is None else "good"
        fix = f"{AGAIN}, step levels" if calibration.response is None else ""
        found.append(Finding("response", grade, words, fix))  # type: ignore[arg-type]
    return found


def _crosstalk(calibration: Calibration) -> Finding:
    if calibration.crosstalk is None:
        words = "no crosstalk is known: taken as none"
        return Finding("crosstalk", "warning", words, f"{AGAIN}, step levels")
    matrix = np.array(calibration.crosstalk)
    worst = float(np.abs(matrix - np.diag(np.diag(matrix))).max())
    condition = float(np.linalg.cond(matrix))
    words = f"up to {worst:.1%} of one channel in another; undoing it multiplies noise by up to {condition:.1f}"
    fix = "put band-pass filters before the projectors or the camera, so that less light of one channel reaches another"
    return graded("crosstalk", condition, CONDITION, words, fix)
