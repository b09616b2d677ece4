"""Checks of a system file: whether its settings belong together, its screens, and its camera."""

from __future__ import annotations

from collections.abc import Iterator

from quadfringe.calibration.session import session_of
from quadfringe.config import SystemConfig
from quadfringe.data import Calibration
from quadfringe.decoding import Plan
from quadfringe.doctor.cameras import examine_camera
from quadfringe.doctor.finding import Finding
from quadfringe.doctor.screens import examine_screens
from quadfringe.errors import InputError

__all__ = ["examine_system"]


def examine_system(config: SystemConfig) -> list[Finding]:
    """Check settings, screens and camera of a system; opens the camera, and shows nothing.

    >>> from quadfringe.config import SystemConfig
    >>> {one.grade for one in examine_system(SystemConfig())}
    {'good'}
    """
    return [*_settings(config), *examine_screens(config), *examine_camera(config)]


def _settings(config: SystemConfig) -> Iterator[Finding]:
    """Check whether fringes, projectors, calibration and response belong together."""
    try:
        size_px = session_of(config, "").projector_size_px
        known = None if config.calibration is None else Calibration.load(config.calibration)
        columns = size_px[0] if known is None else known.projector.width_px
        Plan(columns, config.fringes, known, decode=config.decode)
    except InputError as error:
        found, _, fix = str(error).partition("; ")
        yield Finding("settings", "fault", found, fix)
        return
    of = size_px if known is None else (known.projector.width_px, known.projector.height_px)
    if of != size_px:
        has = f"this system has {size_px[0]} x {size_px[1]}"
        words = f"the calibration is of a projector of {of[0]} x {of[1]} pixels, {has}"
        yield Finding("settings", "fault", words, "calibrate again: quadfringe calibrate plan DIR --system FILE")
        return
    yield Finding("settings", "good", f"fringes {config.fringes.numbers} of the encoding {config.fringes.encoding}")
