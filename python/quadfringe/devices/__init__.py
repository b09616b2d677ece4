"""What a system is made of: a projector that shows fringes and a camera that grabs a shot of them."""

from __future__ import annotations

from typing import Protocol

from quadfringe.config import Fringes
from quadfringe.data import AnyShot

__all__ = ["Camera", "Projector"]


class Projector(Protocol):
    """Shows the fringes of one shot: a composite colour image and an infrared one, at the same instant."""

    def show(self, fringes: Fringes) -> None:
        """Project these fringes until told otherwise."""

    def close(self) -> None:
        """Release the device; closing twice is allowed."""


class Camera(Protocol):
    """Takes four channels in one exposure: as four images, or as a raw mosaic and an infrared image."""

    def grab(self) -> AnyShot:
        """Expose once and return the shot."""

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
