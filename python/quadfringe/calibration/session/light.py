"""Photometric steps of the guided calibration: dark level, responses and crosstalk, flat field."""

from __future__ import annotations

import numpy as np

from quadfringe.calibration._params import HOT_PIXELS_MAX, LEFT_MAX_PERCENT, SESSION_DARK_MAX, UNEVEN_MAX_PERCENT
from quadfringe.calibration.channels import fit_channels
from quadfringe.calibration.flat import flat_field
from quadfringe.calibration.levels import dark_level, mean_levels
from quadfringe.calibration.session.captures import Captures
from quadfringe.calibration.session.outcome import Outcome, record, worse

__all__ = ["dark", "flat", "levels"]


def dark(captures: Captures) -> Outcome:
    """Measure the dark level of each channel, from shots with the lens covered."""
    names = captures.session.captures("dark")
    found = dark_level([captures.shot("dark", name) for name in names])
    figures = {
        "level_percent": 100 * max(found.level),
        "fixed_pattern_percent": 100 * max(found.fixed_pattern),
        "noise_percent": 100 * max(found.noise),
        "hot_pixels": float(found.hot_pixels),
    }
    problems = []
    if max(found.level) > SESSION_DARK_MAX:
        problems.append(
            f"the dark level is {max(found.level):.1%} of full scale; cover the lens, or lower the black level of the "
            "camera"
        )
    if found.hot_pixels > HOT_PIXELS_MAX:
        problems.append(f"{found.hot_pixels} hot pixels; let the camera cool, or shorten the exposure")
    good = f"dark at {figures['level_percent']:.2f} % of full scale, noise {figures['noise_percent']:.2f} %"
    return Outcome(record("dark", names, figures, problems, good), {"dark": found.level}, {"dark": found})


def levels(captures: Captures, dark_row: tuple[float, ...]) -> Outcome:
    """Fit the responses of camera and projectors and the crosstalk between channels, from evenly lit shots."""
    plan = captures.session.level_plan
    seen = np.array([mean_levels(captures.shot("levels", name)) for name in plan.names])
    found = fit_channels(plan, seen, dark_row)
    figures = found.figures
    problems = []
    if figures["stray_after_percent"] > LEFT_MAX_PERCENT:
        problems.append(
            f"channels still see {figures['stray_after_percent']:.2f} % of the light of other channels; keep the board "
            "and the room light constant, and take the levels again"
        )
    if figures["level_rms_after_percent"] > LEFT_MAX_PERCENT:
        problems.append(
            f"levels still err by {figures['level_rms_after_percent']:.2f} % of full scale; keep the light constant, "
            "and "
            "switch off the gamma table of the projector, whose response is otherwise no power law"
        )
    before, after = figures["level_rms_before_percent"], figures["level_rms_after_percent"]
    good = (
        f"crosstalk {figures['stray_before_percent']:.1f} % before, {figures['stray_after_percent']:.2f} % after; "
        f"levels err by {before:.1f} % before, {after:.2f} % after"
    )
    remarks = [
        *worse("crosstalk", figures["stray_before_percent"], figures["stray_after_percent"]),
        *worse("the error of the levels", before, after),
    ]
    outcome = record("levels", plan.names, figures, problems, good, remarks=remarks)
    return Outcome(outcome, found.keywords(), {"channels": found, "level_plan": plan, "levels": seen})


def flat(captures: Captures, dark_row: tuple[float, ...]) -> Outcome:
    """Measure the flat field of the camera; decoding does not need it, but it shows faults of lens and chip."""
    names = captures.session.captures("flat")
    found = flat_field([captures.shot("flat", name) for name in names], dark_row)
    figures = found.figures
    problems = []
    if figures["uneven_after_percent"] > UNEVEN_MAX_PERCENT:
        problems.append(
            f"the light is uneven by {figures['uneven_after_percent']:.1f} % after correction, so it flickers; use "
            "light that "
            "does not, or an exposure of whole periods"
        )
    before, after = figures["uneven_before_percent"], figures["uneven_after_percent"]
    good = (
        f"uneven by {before:.1f} % before, {after:.2f} % after; pixels differ by {figures['pixels_percent']:.2f} %, "
        f"{found.defects} are defective; decoding needs no correction for it"
    )
    remarks = worse("the unevenness", before, after)
    return Outcome(record("flat", names, figures, problems, good, remarks=remarks), {}, {"flat": found})
