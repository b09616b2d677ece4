"""Checks of the screens that show patterns: present, native, one to one, and whether exposures fit their frames."""

from __future__ import annotations

from collections.abc import Iterator

from quadfringe import _core
from quadfringe.calibration.session.exposures import check_exposures
from quadfringe.calibration.session.settings import Session
from quadfringe.config import HdmiProjectorConfig, SystemConfig
from quadfringe.devices import part_frames, with_whole_frames
from quadfringe.doctor._params import RATE_SHARE
from quadfringe.doctor.finding import Finding
from quadfringe.errors import ConfigError

__all__ = ["examine_screens"]

Row = tuple[str, int, int, float | None, str | None]


def examine_screens(config: SystemConfig) -> list[Finding]:
    """Check the projectors of kind hdmi of a system without opening a window; nothing for other projectors."""
    beams = () if config.projectors is None else ("visible", "infrared")
    screens = {beam: getattr(config.projectors, beam) for beam in beams}
    found = []
    for beam, screen in screens.items():
        if isinstance(screen, HdmiProjectorConfig):
            found += _screen(f"{beam} screen", screen)
    if found and all(one.grade != "fault" for one in found):
        found += _exposures(config)
    return found


def _screen(name: str, screen: HdmiProjectorConfig) -> list[Finding]:
    try:
        rows = _core.outputs(screen.size_px)
    except OSError as error:
        fix = "run this command in the graphical session of the computer at which the projector is a screen"
        return [Finding(name, "fault", str(error), fix)]
    active = [row for row in rows if screen.output in (None, row[0])]
    fit = [row for row in active if row[-1] is None]
    if len(fit) == 1:
        return list(_fit(name, screen, fit[0]))
    return [_unfit(name, screen, rows, active, fit)]


def _unfit(name: str, screen: HdmiProjectorConfig, rows: list[Row], active: list[Row], fit: list[Row]) -> Finding:
    listed = ", ".join(f"{row[0]} ({row[1]} x {row[2]})" for row in rows) or "none"
    if len(fit) > 1:
        names = " and ".join(row[0] for row in fit)
        return Finding(name, "fault", f"{names} have this size", f'name one of them: output = "{fit[0][0]}"')
    if not active:
        wanted = f"no output {screen.output} is active" if screen.output else "no output is active"
        fix = "switch the projector on, connect it, and extend the desktop to it (not mirrored) in the display settings"
        return Finding(name, "fault", f"{wanted}; active outputs: {listed}", f"{fix}; or name another output")
    words = "; ".join(f"{row[0]}: {row[-1]}" for row in active)
    width, height = screen.size_px
    fix = (
        f"in the display settings choose {width} x {height}, a scale of 100 % and no rotation; with X11: xrandr "
        f"--output {screen.output or active[0][0]} --mode {width}x{height} --scale 1x1 --rotate normal; if the "
        "projector does not offer this mode, size_px is not its native resolution"
    )
    return Finding(name, "fault", words, fix)


def _fit(name: str, screen: HdmiProjectorConfig, row: Row) -> Iterator[Finding]:
    output, width, height, rate_hz, _ = row
    rate = "an unknown rate" if rate_hz is None else f"{rate_hz:.4g} Hz"
    yield Finding(name, "good", f"{output}: {width} x {height} pixels one to one, at {rate}")
    stated_hz = screen.frame_rate_hz
    if stated_hz is not None and rate_hz is not None and abs(stated_hz / rate_hz - 1) > RATE_SHARE:
        words = f"frame_rate_hz is {stated_hz:g}, and {output} runs at {rate}"
        yield Finding(
            f"{name} rate", "fault", words, "leave frame_rate_hz out, or set that rate in the display settings"
        )


def _exposures(config: SystemConfig) -> Iterator[Finding]:
    """Check exposures against the frames of the screen: that of a shot, and its shares in a calibration."""
    parts = list(part_frames(with_whole_frames(config)))  # as the devices are opened
    for part in parts:
        yield Finding(
            "exposure in frames",
            "warning",
            f"capture.{part.setting}: {part.exposure_us:g} us is {part.frames:.2f} frames of the screen, so that "
            "colours differ from shot to shot",
            f"set {part.whole_us:g}, or match_exposure = true of the projector",
        )
    if not parts:
        yield Finding("exposure in frames", "good", "whole frames of the screen, or set in the program of the camera")
    try:
        check_exposures(config, Session(rig="").level_exposures)
    except ConfigError as error:
        found, _, fix = str(error).partition("; ")
        yield Finding("exposures of a calibration", "warning", found, fix)
