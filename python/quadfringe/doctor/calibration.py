"""Checks of a calibration: its record, and whether its numbers are plausible."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from quadfringe.config import ChannelResponse, Device, Response
from quadfringe.data import Calibration
from quadfringe.data.calibration import DIGEST, stored_values
from quadfringe.decoding.device_limits import impossible_devices, pair_offset
from quadfringe.doctor.finding import Finding, graded, told

__all__ = ["examine_calibration", "examine_digest"]

# Limits for a warning and for a fault.
AGE_DAYS = (90.0, 730.0)  # a bench drifts with temperature and transport within months
BASELINE_DEG = (8.0, 3.0)  # smallest angle between the lines of sight of camera and projector: depth noise is 1 over it
CONDITION = (4.0, 20.0)  # condition number of the crosstalk matrix, by which its inverse may multiply noise
PAIR = (1.0, 3.0)  # rotation over 2 degrees, and translation over 5 mm, of the pair; the larger counts
CAMERA_CENTRE = (0.25, 0.6)  # offset of the principal point from the image centre, share of half the image
PROJECTOR_CENTRE = (1.1, 1.5)  # the same: projectors often project upwards, with a principal point near the edge
EXPONENTS = (0.3, 2.5)  # plausible range: displays and projectors have 1.8 to 2.4, their inverse 0.4 to 0.6
WORKING_MM = 800.0  # the published working distance
AGAIN = "calibrate again: quadfringe calibrate"


def examine_calibration(calibration: Calibration) -> list[Finding]:
    """Check the record and the numbers of a calibration."""
    with np.errstate(all="ignore"):  # numbers that no bench has overflow; the findings say so
        return [
            *told(impossible_devices(calibration, coaxial=False)),
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
        words = "the file has no record of how it was made"
        return [Finding("record", "warning", words, f"{AGAIN}, which records inputs and residuals")]
    words = f"made {record.made_utc} by quadfringe {record.quadfringe_version} for {record.rig}"
    fix = f"test it with quadfringe accept, and {AGAIN} when a limit is exceeded"
    age_days = _age_days(record.made_utc)
    if age_days is None:
        found = [Finding("age", "warning", f"{words}; expected a time such as 2026-01-31T12:00:00+00:00", fix)]
    else:
        found = [graded("age", age_days, AGE_DAYS, words, fix)]
    for step in record.steps:
        fix = "" if step.good else f"take the captures of this step again as described, then {AGAIN}"
        found.append(Finding(f"step {step.name}", "good" if step.good else "fault", step.verdict, fix))
    return found


def examine_digest(path: Path) -> Finding:
    """Say whether the file of a calibration, which was read before, has a digest that tells a change."""
    if DIGEST in stored_values(path):
        return Finding("digest", "good", f"{path} is unchanged since it was saved")
    words = f"{path} has no digest, so that a changed number cannot be told"
    return Finding(
        "digest", "warning", words, "check its numbers, and save it again: Calibration.load(FILE).save(FILE)"
    )


def _age_days(made_utc: str) -> float | None:
    """Give the days since a time, which is UTC unless it says otherwise; None when it is not a time."""
    try:
        made = datetime.fromisoformat(made_utc)
    except ValueError:
        return None
    made = made if made.tzinfo else made.replace(tzinfo=UTC)
    return (datetime.now(UTC) - made).total_seconds() / 86400


def _baseline(calibration: Calibration) -> Finding:
    projector = calibration.projector
    centre = -np.array(projector.rotation).T @ np.array(projector.translation_mm)
    to_point = np.array([0.0, 0.0, WORKING_MM])
    towards = to_point - centre
    cos = float(towards @ to_point / (np.linalg.norm(towards) * WORKING_MM))
    angle = float(np.degrees(np.arccos(np.clip(cos, -1, 1))))
    words = f"camera and projector see a point {WORKING_MM:g} mm away from directions {angle:.1f} degrees apart"
    fix = "move the projector farther from the camera: the depth error is inversely proportional to this angle"
    return graded("triangulation angle", angle, BASELINE_DEG, words, fix)


def _device(name: str, device: Device) -> Finding:
    away = max(
        abs(centre / (0.5 * (size - 1)) - 1)
        for centre, size in zip(device.centre_px, (device.width_px, device.height_px), strict=True)
    )
    words = f"principal point {device.centre_px[0]:.1f}, {device.centre_px[1]:.1f} px of {device.width_px} x "
    words += f"{device.height_px}, focal length {device.focal_px[0]:.1f} px"
    limits = CAMERA_CENTRE if name == "camera" else PROJECTOR_CENTRE
    return graded(name, away, limits, words, "add tilted poses of the board over the whole field, and calibrate again")


def _pair(calibration: Calibration) -> list[Finding]:
    if calibration.infrared is None:
        return [Finding("coaxial pair", "good", "the calibration has one projector, so both count as coaxial")]
    offset = pair_offset(calibration.projector, calibration.infrared)
    words = f"rotated by {offset.angle_deg:.3f} degrees and shifted by {offset.shift_mm:.3f} mm relative to each other"
    fix = "align the projectors at the beam splitter, or pre-deform the infrared pattern (--predeformed-z-mm)"
    return [graded("coaxial pair", max(offset.angle_deg / 2.0, offset.shift_mm / 5.0), PAIR, words, fix)]


def _responses(calibration: Calibration) -> list[Finding]:
    found = []
    for what, response in (("response", calibration.response), ("projector response", calibration.projector_response)):
        channels = response or Response()
        for name in Response.model_fields:
            channel: ChannelResponse = getattr(channels, name)
            if not EXPONENTS[0] <= channel.exponent <= EXPONENTS[1]:
                words = f"exponent {channel.exponent:.2f} of {name} is outside {EXPONENTS[0]} to {EXPONENTS[1]}"
                fix = "check the level captures: this channel may be saturated, or not lit by its projector"
                found.append(Finding(what, "fault", words, fix))
    if not found:
        words = (
            "no response is calibrated; the light counts as linear"
            if calibration.response is None
            else "exponents are plausible"
        )
        grade = "warning" if calibration.response is None else "good"
        fix = f"{AGAIN}, step levels" if calibration.response is None else ""
        found.append(Finding("response", grade, words, fix))  # type: ignore[arg-type]
    return found


def _crosstalk(calibration: Calibration) -> Finding:
    if calibration.crosstalk is None:
        words = "no crosstalk is calibrated, so it counts as zero"
        return Finding("crosstalk", "warning", words, f"{AGAIN}, step levels")
    matrix = np.array(calibration.crosstalk)
    worst = float(np.abs(matrix - np.diag(np.diag(matrix))).max())
    condition = float(np.linalg.cond(matrix))
    words = f"up to {worst:.1%} of one channel in another; the correction multiplies noise by up to {condition:.1f}"
    fix = "put band-pass filters in front of the projectors or the camera, to separate the channels"
    return graded("crosstalk", condition, CONDITION, words, fix)
