"""The steps of the guided calibration that look at light: dark level, levels, flat field."""

from __future__ import annotations

import numpy as np

from quadfringe.calibration.channels import fit_channels
from quadfringe.calibration.flat import flat_field
from quadfringe.calibration.levels import dark_level, mean_levels
from quadfringe.calibration.session.captures import Captures
from quadfringe.calibration.session.outcome import Outcome, record

__all__ = ["dark", "flat", "levels"]

DARK_MAX = 0.1  # share of full scale
HOT_MAX = 500
LEFT_MAX_PERCENT = 0.5  # of full scale, after response and crosstalk are undone
UNEVEN_MAX_PERCENT = 5.0


def dark(captures: Captures) -> Outcome:
    """Dark level of each channel, from shots with the lens covered."""
    names = captures.session.captures("dark")
    found = dark_level([captures.shot("dark", name) for name in names])
    figures = {
        "level_percent": 100 * max(found.level),
        "fixed_pattern_percent": 100 * max(found.fixed_pattern),
        "noise_percent": 100 * max(found.noise),
        "hot_pixels": float(found.hot_pixels),
    }
    problems = []
    if max(found.level) > DARK_MAX:
        problems.append(f"the camera is not dark: {max(found.level):.1%} of full scale; lower its black level")
    if found.hot_pixels > HOT_MAX:
        problems.append(f"{found.hot_pixels} hot pixels; let the camera cool, or shorten the exposure")
    good = f"dark at {figures['level_percent']:.2f} % of full scale, noise {figures['noise_percent']:.2f} %"
    return Outcome(record("dark", names, figures, problems, good), {"dark": found.level}, {"dark": found})


def levels(captures: Captures, dark_row: tuple[float, ...]) -> Outcome:
    """Responses of camera and projectors and the crosstalk between channels, from evenly lit shots."""
    plan = captures.session.level_plan
    seen = np.array([mean_levels(captures.shot("levels", name)) for name in plan.names])
    found = fit_channels(plan, seen, dark_row)
    figures = found.figures
    problems = []
    if figures["stray_after_percent"] > LEFT_MAX_PERCENT:
        problems.append(
            f"channels still see {figures['stray_after_percent']:.2f} % of one another's light; hold board and room "
            "light still while the levels are taken, and take them again"
        )
    if figures["level_rms_after_percent"] > LEFT_MAX_PERCENT:
        problems.append(
            f"levels still err by {figures['level_rms_after_percent']:.2f} % of full scale; the light may not be "
            "steady, or the projector bends otherwise than by a power: switch its gamma table off"
        )
    before, after = figures["level_rms_before_percent"], figures["level_rms_after_percent"]
    good = (
        f"crosstalk {figures['stray_before_percent']:.1f} % before, {figures['stray_after_percent']:.2f} % after; "
        f"levels err by {before:.1f} % before, {after:.2f} % after"
    )
    outcome = record("levels", plan.names, figures, problems, good)
    return Outcome(outcome, found.keywords(), {"channels": found, "level_plan": plan, "levels": seen})


def flat(captures: Captures, dark_row: tuple[float, ...]) -> Outcome:
    """How evenly the camera sees even light; decoding does not need it, a look at the lens does."""
    names = captures.session.captures("flat")
    found = flat_field([captures.shot("flat", name) for name in names], dark_row)
    figures = found.figures
    problems = []
    if figures["uneven_after_percent"] > UNEVEN_MAX_PERCENT:
        problems.append(
            f"light is uneven by {figures['uneven_after_percent']:.1f} % even after correction: it flickers"
        )
    before, after = figures["uneven_before_percent"], figures["uneven_after_percent"]
    good = (
        f"uneven by {before:.1f} % before, {after:.2f} % after; pixels differ by {figures['pixels_percent']:.2f} %, "
        f"{found.defects} are defective; decoding needs no correction for it"
    )
    return Outcome(record("flat", names, figures, problems, good), {}, {"flat": found})
