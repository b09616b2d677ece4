"""The session that a system needs, and whether a session is that of a system."""

from __future__ import annotations

from typing import Any

from quadfringe.calibration.session.settings import FILE, Session
from quadfringe.config import BayerPattern, HdmiProjectorConfig, SystemConfig
from quadfringe.config.cameras import AravisConfig, FilesConfig, UvcConfig, VirtualConfig
from quadfringe.errors import ConfigError, InputError

__all__ = ["check_session", "session_of"]

LIGHTCRAFTER_PX = (912, 1140)
DEPTHS = (10, 12, 14, 16)  # bits of 16-bit files that a session can state


def session_of(config: SystemConfig, rig: str, **settings: Any) -> Session:
    """Return the session of a bench: its fringes, and the images of its projectors and of its camera.

    `settings` are further fields of `Session`. Raises `ConfigError` when its fringes have infrared and no projector
    shows them.

    >>> from quadfringe.config import Fringes, SystemConfig
    >>> session_of(SystemConfig(fringes=Fringes(encoding="rgb")), "bench 1").beams
    ('visible',)
    """
    _check_fringes(config)
    values = {"fringes": config.fringes, "projector_size_px": _size_px(config), "bayer": _bayer(config)}
    return Session(rig=rig, **(values | {"bits": _bits(config)} | settings))


def check_session(config: SystemConfig, session: Session) -> None:
    """Raise `InputError` when a session was planned for other projectors, whose images would be misread."""
    _check_fringes(config)
    fringes, shown = session.fringes, config.fringes
    compared = {
        "projector_size_px": (session.projector_size_px, _size_px(config)),
        "fringes.encoding": (fringes.encoding, shown.encoding),
        "fringes.layout": (fringes.layout, shown.layout),
    }
    for name, (planned, has) in compared.items():
        if planned != has:
            raise InputError(
                f"{FILE}: {name} is {planned}, and this system has {has}; make the session with quadfringe calibrate "
                "plan DIR --system FILE"
            )


def _check_fringes(config: SystemConfig) -> None:
    if config.projectors is not None and config.projectors.infrared is None and config.fringes.infrared:
        raise ConfigError(
            "fringes: they have infrared, and this system has no infrared projector; add [fringes] with encoding = "
            '"rgb"'
        )


def _size_px(config: SystemConfig) -> tuple[int, int]:
    if config.projectors is not None:
        visible = config.projectors.visible
        return visible.size_px if isinstance(visible, HdmiProjectorConfig) else LIGHTCRAFTER_PX
    if isinstance(config.capture, VirtualConfig):
        from quadfringe.devices.virtual import VirtualBench

        return VirtualBench(config).projector_size_px
    return LIGHTCRAFTER_PX


def _bayer(config: SystemConfig) -> BayerPattern | None:
    capture = config.capture
    if isinstance(capture, (UvcConfig, FilesConfig)):
        return capture.bayer
    if isinstance(capture, VirtualConfig):
        return config.scene.bayer if config.scene.demosaic is None else None
    name = capture.visible.pixel_format if isinstance(capture, AravisConfig) else None
    orders: dict[str, BayerPattern] = {"GR": "grbg", "RG": "rggb", "GB": "gbrg", "BG": "bggr"}
    return orders[name[5:7]] if name is not None and name.startswith("Bayer") else None


def _bits(config: SystemConfig) -> int | None:
    """Return the bits of deep images; None for 8 bit, and where the settings of the camera do not say."""
    capture = config.capture
    bits = capture.bits if isinstance(capture, FilesConfig) else None
    if isinstance(capture, VirtualConfig):
        bits = config.scene.bit_depth
    if isinstance(capture, AravisConfig) and capture.visible.pixel_format is not None:
        bits = int("".join(letter for letter in capture.visible.pixel_format if letter.isdigit()))
    return bits if bits in DEPTHS else None
