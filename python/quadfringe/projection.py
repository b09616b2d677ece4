"""The images that projectors show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import DeviceModel, Fringes
from quadfringe.errors import InputError
from quadfringe.optics import core_device

if TYPE_CHECKING:
    from quadfringe.data import Calibration

__all__ = ["Predeformation", "predeformation", "projector_images"]


@dataclass(frozen=True)
class Predeformation:
    """What makes up for an infrared projector that is not coaxial: both calibrated projectors and the plane (S11).

    Exact on the plane at depth `z_mm`; where the centres of the projectors differ it drifts with depth.
    """

    visible: DeviceModel
    infrared: DeviceModel
    z_mm: float

    def light(self, fringe_number: float, layout: str) -> NDArray[np.float32]:
        """Give the infrared image, (H, W), linear light from 0 to 1; mirrors that miss the plane are dark."""
        pair = (core_device(self.visible), core_device(self.infrared))
        return _core.predeform(*pair, fringe_number, z_mm=self.z_mm, layout=layout)


def predeformation(fringes: Fringes, calibration: Calibration | None) -> Predeformation | None:
    """Give the pre-deformation that these fringes ask for; None when they ask for none.

    Raises `InputError` when they do and the calibration does not know both projectors.
    """
    if fringes.predeformed_z_mm is None:
        return None
    if calibration is None or calibration.infrared is None:
        raise InputError("predeformed_z_mm needs a calibration with both projectors: one that has an `infrared` device")
    return Predeformation(calibration.projector, calibration.infrared, fringes.predeformed_z_mm)


def projector_images(
    fringes: tuple[float, float, float],
    size_px: tuple[int, int],
    layout: str,
    deformed: Predeformation | None = None,
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Give the composite colour image (H, W, 3) and the infrared image (H, W), uint8; `size_px` is (W, H).

    Raises ValueError when the joint range of the fringes does not cover the width, and when the projectors of a
    pre-deformation have another size.
    """
    _core.check_code(fringes, size_px[0])
    red, green, blue, ir = (
        _core.pattern(channel, fringes, *size_px, layout=layout) for channel in ("R", "G", "B", "IR")
    )
    if deformed is not None:
        for device in (deformed.visible, deformed.infrared):
            if (device.width_px, device.height_px) != size_px:
                raise InputError(
                    f"the calibration is for projectors of {device.width_px} x {device.height_px} mirrors, "
                    f"the images have {size_px[0]} x {size_px[1]}"
                )
        ir = deformed.light(fringes[2], layout)
    return eight_bit(np.stack([red, green, blue], axis=2)), eight_bit(ir)


def eight_bit(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Give linear light from 0 to 1 as the levels that a projector takes."""
    return np.round(light * 255).astype(np.uint8)
