"""The light that projectors show, and the images for it.

>>> import quadfringe as qf
>>> from quadfringe.devices.light import *
>>> white, fringes = Levels((1.0, 1.0, 1.0, 0.0)), Step(36.0, 0.0, "columns", "visible")
>>> lights: list[Light] = [qf.Fringes(), white, fringes]
>>> images = projector_images((36, 35, 30), (912, 1140), "diamond")
>>> isinstance(images, ProjectorImages), images.visible.shape, images.infrared.shape
(True, (1140, 912, 3), (1140, 912))
>>> with qf.open() as scanner:
...     deformed = predeformation(qf.Fringes(predeformed_z_mm=800.0), scanner.calibration)
>>> isinstance(deformed, Predeformation), deformed.z_mm
(True, 800.0)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import Device, Fringes, Row4
from quadfringe.config.encoding import require_image
from quadfringe.data.optics import core_device
from quadfringe.errors import InputError

if TYPE_CHECKING:
    from quadfringe.data import Calibration

__all__ = [
    "Levels",
    "Light",
    "Predeformation",
    "ProjectorImages",
    "Step",
    "light_images",
    "predeformation",
    "projector_images",
]

# Peak memory of the images of both projectors, bytes per pixel (`pytest tests/test_size_limits.py` holds it).
BYTES_PER_PX = 56
WITH_INFRARED = 3  # fringe numbers of an encoding with infrared, as `Fringes.code` gives them


@dataclass(frozen=True)
class Levels:
    """Uniform light, one level from 0 to 1 for each channel (R, G, B, IR)."""

    levels: Row4


@dataclass(frozen=True)
class Step:
    """One step of an N-step capture: the same fringes in all channels of one projector, with the other black.

    `number` is the fringe number along `axis`, "columns" or "rows"; `beam` is the projector, "visible" or "infrared";
    `layout` is the mirror layout, "regular" or "diamond".
    """

    number: float
    shift_rad: float
    axis: str
    beam: str
    layout: str = "regular"


Light = Fringes | Levels | Step  # the light of a shot, or of a calibration


class ProjectorImages(NamedTuple):
    """The images of both projectors: `visible` (H, W, 3) and `infrared` (H, W), uint8."""

    visible: NDArray[np.uint8]
    infrared: NDArray[np.uint8]


@dataclass(frozen=True)
class Predeformation:
    """Pre-deformation of the infrared pattern for projectors that are not coaxial (S11).

    It is exact on the plane at depth `z_mm`; when the projector centres differ, the error grows with the distance from
    that plane.
    """

    visible: Device
    infrared: Device
    z_mm: float

    def light(self, fringe_number: float, layout: str) -> NDArray[np.float32]:
        """Return the infrared image, (H, W), linear light from 0 to 1; mirrors that do not light the plane are dark."""
        pair = (core_device(self.visible), core_device(self.infrared))
        return _core.predeform(*pair, fringe_number, z_mm=self.z_mm, layout=layout)


def predeformation(fringes: Fringes, calibration: Calibration | None) -> Predeformation | None:
    """Return the pre-deformation of these fringes; None when `predeformed_z_mm` is not set.

    Raises `InputError` when it is set and the calibration lacks one of the projectors.
    """
    if fringes.predeformed_z_mm is None:
        return None
    if calibration is None or calibration.infrared is None:
        raise InputError(
            "predeformed_z_mm: needs a calibration of both projectors; give one that has an `infrared` device"
        )
    return Predeformation(calibration.projector, calibration.infrared, fringes.predeformed_z_mm)


def projector_images(
    fringes: tuple[float, ...],
    size_px: tuple[int, int],
    layout: str,
    deformed: Predeformation | None = None,
    columns_px: tuple[float, float] | None = None,
) -> ProjectorImages:
    """Return the images of both projectors for these fringes, as `Fringes.code`; `size_px` is (W, H).

    Without infrared its image is black. `columns_px` are those that can light the scene.

    Raises ValueError when the ambiguity range of the fringe numbers does not cover the width, when the projectors of a
    pre-deformation have another size, and for images that are impossible or do not fit into memory.
    """
    require_image("projector images", size_px, BYTES_PER_PX)
    _core.check_code(fringes, size_px[0], columns_px=columns_px)
    letters = ("R", "G", "B", "IR") if len(fringes) == WITH_INFRARED else ("R", "G", "B")
    images = [_core.pattern(letter, fringes, *size_px, layout=layout, columns_px=columns_px) for letter in letters]
    red, green, blue, ir = (*images, np.zeros_like(images[0]))[:4]
    if deformed is not None:
        for device in (deformed.visible, deformed.infrared):
            if (device.width_px, device.height_px) != size_px:
                raise InputError(
                    f"calibration: expected projectors of {size_px[0]} x {size_px[1]} mirrors, got {device.width_px} x "
                    f"{device.height_px}; use the calibration of these projectors"
                )
        ir = deformed.light(fringes[2], layout)
    return ProjectorImages(eight_bit(np.stack([red, green, blue], axis=2)), eight_bit(ir))


def light_images(light: Light, size_px: tuple[int, int], deformed: Predeformation | None = None) -> ProjectorImages:
    """Return the images of both projectors for any light; `size_px` is (W, H).

    Raises ValueError as `projector_images`, and for levels outside 0 to 1.

    >>> from quadfringe.devices.light import Levels, light_images
    >>> visible, infrared = light_images(Levels((1.0, 0.0, 0.0, 0.5)), (912, 1140))
    >>> visible[0, 0].tolist(), int(infrared[0, 0])
    ([255, 0, 0], 128)
    """
    if isinstance(light, Fringes):
        return projector_images(light.code, size_px, light.layout, deformed, light.columns_px)
    require_image("projector images", size_px, BYTES_PER_PX)
    shape = size_px[::-1]
    if isinstance(light, Levels):
        if not all(0 <= level <= 1 for level in light.levels):
            raise ValueError(f"levels: expected numbers from 0 to 1, got {light.levels}")
        red, green, blue, ir = (np.full(shape, level, np.float32) for level in light.levels)
        return ProjectorImages(eight_bit(np.stack([red, green, blue], axis=2)), eight_bit(ir))
    shown = eight_bit(_core.step_pattern(light.number, light.shift_rad, *size_px, axis=light.axis, layout=light.layout))
    black = np.zeros(shape, np.uint8)
    visible, infrared = (shown if light.beam == beam else black for beam in ("visible", "infrared"))
    return ProjectorImages(np.repeat(visible[:, :, None], 3, axis=2), infrared)


def eight_bit(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Quantise linear light from 0 to 1 to 8 bit."""
    return np.round(light * 255).astype(np.uint8)
