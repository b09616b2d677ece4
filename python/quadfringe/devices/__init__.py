"""What a system is made of: a projector that shows fringes and a camera that grabs a shot of them."""

from __future__ import annotations

from typing import Protocol

from quadfringe.config import Fringes, SystemConfig
from quadfringe.data import AnyShot, Calibration

__all__ = ["Camera", "Projector", "open_projector"]


class Projector(Protocol):
    """Shows the fringes of one shot: a composite colour image and an infrared one, at the same instant."""

    def show(self, fringes: Fringes) -> None:
        """Project these fringes until told otherwise; ValueError when they cannot number the field."""

    def close(self) -> None:
        """Release the device; closing twice is allowed."""


class Camera(Protocol):
    """Takes four channels in one exposure: as four images, or as a raw mosaic and an infrared image."""

    def grab(self) -> AnyShot:
        """Expose once and return the shot."""

    def close(self) -> None:
        """Release the device; closing twice is allowed."""


def open_projector(config: SystemConfig) -> Projector:
    """Open the projectors of a system: those of its `projectors`, or of a virtual bench when there are none.

    Raises OSError when a device cannot be opened, ValueError when it cannot do what the settings ask.
    """
    if config.projectors is None:
        from quadfringe.devices.virtual import VirtualBench, VirtualProjector

        return VirtualProjector(VirtualBench(config))
    from quadfringe.devices.lightcrafter import CoaxialPair

    known = None if config.calibration is None else Calibration.load(config.calibration)
    return CoaxialPair(config.projectors, known)
