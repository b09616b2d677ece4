"""The exposures of a session: some levels are taken at a share of the exposure of the system."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from quadfringe.calibration.session.captures import light_of
from quadfringe.calibration.session.settings import FILE, Session
from quadfringe.config import SystemConfig
from quadfringe.config.cameras import AravisConfig, FilesConfig, ReplayConfig, UvcConfig, VirtualConfig
from quadfringe.devices import part_frames, with_whole_frames
from quadfringe.errors import ConfigError

__all__ = ["check_exposures", "exposed", "shares_of"]

FRAMES_MAX = 64  # of a full exposure: more than a second at 60 Hz


def shares_of(session: Session, step: str, names: Iterable[str]) -> dict[float, list[str]]:
    """Give the captures of a step by their share of the exposure of the system, in the order of taking them."""
    found: dict[float, list[str]] = {}
    for name in names:
        found.setdefault(light_of(session, step, name).share, []).append(name)
    return found


def exposed(config: SystemConfig, share: float) -> SystemConfig:
    """Return the system at a share of its exposure; raises `ConfigError` when that cannot be set.

    A camera of kind files is the same at every share: a person sets the exposure.
    """
    config = with_whole_frames(config)  # rounding a share to whole frames would make it another share
    capture = config.capture
    if isinstance(capture, ReplayConfig):
        raise ConfigError("capture: a recording cannot be taken again under other light; name a camera")
    changes: dict[str, Any] = {"calibration": None}  # it does not exist yet, and neither need a response
    changes["decode"] = config.decode.model_copy(update={"response": "auto"})
    if isinstance(capture, VirtualConfig):
        gain = tuple(share * one for one in config.scene.gain or (1.0,) * 4)
        changes["scene"] = config.scene.model_copy(update={"gain": gain})
        # A frame rate gives each shot new noise.
        changes["capture"] = capture.model_copy(update={"frame_rate_hz": capture.frame_rate_hz or 1.0})
    elif share != 1 and not isinstance(capture, FilesConfig):
        changes["capture"] = _shorter(capture, share)
    return config.model_copy(update=changes)


def check_exposures(config: SystemConfig, shares: Iterable[float]) -> None:
    """Raise `ConfigError` unless the camera can be set to all these shares of its exposure.

    With a projector of kind hdmi each of them must be a whole number of its frames: of a part of a frame, a camera sees
    one colour more than the others.
    """
    wanted = sorted({share for share in shares if share != 1})
    for share in wanted:
        shorter = exposed(config, share)
        for part in part_frames(shorter):
            frames = _frames_of(wanted)
            advice = f"set {frames * part.period_us:.1f} us ({frames} frames) and lower gain or aperture; or " * bool(
                frames
            )
            raise ConfigError(
                f"capture.{part.setting}: the levels are taken at {_percent(wanted)} of it, too, and at {share:.0%} "
                f"it is {part.frames:.2f} frames of the projector, not a whole number; {advice}set level_exposures = "
                f"[] in {FILE}, which takes the camera as linear"
            )


def _frames_of(shares: Iterable[float]) -> int:
    """Return the least number of frames of which all shares are whole numbers; 0 if there is no small one."""
    shares = tuple(shares)
    whole = (n for n in range(1, FRAMES_MAX) if all(abs(n * s - round(n * s)) < 1e-6 for s in shares))
    return next(whole, 0)


def _percent(shares: Iterable[float]) -> str:
    return " and ".join(f"{share:.0%}" for share in shares)


def _shorter(capture: AravisConfig | UvcConfig, share: float) -> AravisConfig | UvcConfig:
    def times(exposure_us: float | None) -> float | None:
        return None if exposure_us is None else share * exposure_us

    names = ("visible", "infrared") if isinstance(capture, AravisConfig) else ()
    chips = {name: getattr(capture, name) for name in names}
    each = [chip.exposure_us for chip in chips.values()] or [None]
    if capture.exposure_us is None and None in each:
        raise ConfigError(
            "capture.exposure_us: missing; set it, because a calibration takes some levels at a fraction of the "
            "exposure"
        )
    chips_changed = {
        name: chip.model_copy(update={"exposure_us": times(chip.exposure_us)}) for name, chip in chips.items()
    }
    return capture.model_copy(update={"exposure_us": times(capture.exposure_us), **chips_changed})
