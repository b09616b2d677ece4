"""Exposures in whole frames of a projector that shows its colours one after another.

A camera that sees a part of a frame sees a colour more or less often than the others, and from shot to shot
differently, because nothing synchronises the two. Over whole frames, a still pattern needs no synchronisation.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass

from quadfringe.config import AravisConfig, HdmiProjectorConfig, SystemConfig, UvcConfig
from quadfringe.errors import CameraWarning

__all__ = ["PartFrame", "exposures_us", "part_frames", "warn_of_part_frames", "whole_frames_us", "with_whole_frames"]

USUAL_RATE_HZ = 60.0  # of a screen that does not say
PART = 0.02  # share of a frame that may be missing: cameras round their exposures to steps of up to 100 us


def whole_frames_us(exposure_us: float, frame_rate_hz: float) -> float:
    """Return the whole number of frames, at least one, that is nearest to an exposure, us.

    >>> whole_frames_us(30_000, 60.0)
    33333.3
    """
    period_us = 1e6 / frame_rate_hz
    return round(max(round(exposure_us / period_us), 1) * period_us, 1)


def exposures_us(config: SystemConfig) -> dict[str, float]:
    """Return the exposures that the camera has, by the name of the setting; none for a camera that does not tell."""
    capture = config.capture
    if not isinstance(capture, (AravisConfig, UvcConfig)):
        return {}
    found = {"exposure_us": capture.exposure_us}
    if isinstance(capture, AravisConfig):
        found |= {f"{name}.exposure_us": getattr(capture, name).exposure_us for name in ("visible", "infrared")}
    return {name: exposure_us for name, exposure_us in found.items() if exposure_us is not None}


@dataclass(frozen=True)
class PartFrame:
    """An exposure that is no whole number of frames of the projector: its setting, and how many frames it is."""

    setting: str
    exposure_us: float
    frame_rate_hz: float

    @property
    def period_us(self) -> float:
        """Duration of a frame."""
        return 1e6 / self.frame_rate_hz

    @property
    def frames(self) -> float:
        """Number of frames that the exposure lasts."""
        return self.exposure_us / self.period_us

    @property
    def whole_us(self) -> float:
        """The nearest exposure of whole frames."""
        return whole_frames_us(self.exposure_us, self.frame_rate_hz)


def part_frames(config: SystemConfig) -> Iterator[PartFrame]:
    """Give the exposures that are no whole number of frames of a projector of kind hdmi."""
    projector, exposures = _projector(config), exposures_us(config)
    if projector is None or not exposures:
        return
    rate_hz = _rate_hz(projector)
    for name, exposure_us in exposures.items():
        found = PartFrame(name, exposure_us, rate_hz)
        if abs(exposure_us - found.whole_us) > PART * found.period_us:
            yield found


def warn_of_part_frames(config: SystemConfig) -> None:
    """Warn of exposures that are no whole number of frames of a projector of kind hdmi; name the nearest one."""
    for part in part_frames(config):
        warnings.warn(
            f"capture.{part.setting}: {part.exposure_us:g} us is {part.frames:.2f} frames of the projector "
            f"({part.frame_rate_hz:g} Hz), so that colours differ from shot to shot; set {part.whole_us:g}, or "
            "match_exposure of the projector",
            CameraWarning,
            stacklevel=2,
        )


def with_whole_frames(config: SystemConfig) -> SystemConfig:
    """Return the settings with stated exposures in whole frames, if the projector has `match_exposure`."""
    projector = _projector(config)
    if projector is None or not projector.match_exposure:
        return config
    rate_hz = _rate_hz(projector)
    capture = config.capture
    for name, exposure_us in exposures_us(config).items():
        change = {"exposure_us": whole_frames_us(exposure_us, rate_hz)}
        chip, _, inner = name.partition(".")
        if inner:
            change = {chip: getattr(capture, chip).model_copy(update=change)}
        capture = capture.model_copy(update=change)
    return config.model_copy(update={"capture": capture})


def _projector(config: SystemConfig) -> HdmiProjectorConfig | None:
    visible = None if config.projectors is None else config.projectors.visible
    return visible if isinstance(visible, HdmiProjectorConfig) else None


def _rate_hz(projector: HdmiProjectorConfig) -> float:
    if projector.frame_rate_hz is not None:
        return projector.frame_rate_hz
    from quadfringe._core import outputs  # as late as that: a build for a computer without screens may lack it

    rates_hz = [rate for name, *size, rate, _ in outputs() if projector.output in (None, name) and rate is not None]
    return rates_hz[0] if len(rates_hz) == 1 else USUAL_RATE_HZ
