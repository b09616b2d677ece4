"""`Device`: a camera or a projector as geometry.

>>> from quadfringe.config import Device
>>> Device(width_px=8, height_px=6, focal_px=(20, 20), centre_px=(3.5, 2.5)).rotation[0]
(1.0, 0.0, 0.0)
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, field_validator

from quadfringe import _core
from quadfringe.config._base import SIZE_MAX, Finite, Model, Positive, kernel_takes

__all__ = ["IDENTITY", "Camera", "Device", "Pixels", "Triple"]

Pixels = Annotated[int, Field(gt=0, le=SIZE_MAX)]
Triple = tuple[Finite, Finite, Finite]
Matrix3 = tuple[Triple, Triple, Triple]
IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Device(Model):
    """A camera or a projector: a pinhole with OpenCV's distortion, pixel centres at integers (S8).

    P_device = rotation P_camera + translation_mm.
    """

    width_px: Pixels = Field(description="Columns of pixels or mirrors.")
    height_px: Pixels = Field(description="Rows of pixels or mirrors.")
    focal_px: tuple[Positive, Positive] = Field(description="Focal length along x and along y, in pixels.")
    centre_px: tuple[Finite, Finite] = Field(description="Principal point: column and row, in pixels.")
    distortion: tuple[Finite, Finite, Finite, Finite, Finite] = Field(
        default=(0.0, 0.0, 0.0, 0.0, 0.0), description="k1, k2, p1, p2, k3 of OpenCV."
    )
    rotation: Matrix3 = Field(default=IDENTITY, description="Rotation from the camera frame, row by row.")
    translation_mm: Triple = Field(default=(0.0, 0.0, 0.0), description="Translation from the camera frame, in mm.")

    @field_validator("rotation")
    @classmethod
    def _is_a_rotation(cls, rotation: Matrix3) -> Matrix3:
        kernel_takes("rotation", lambda: _core.Device(1, 1, (1.0, 1.0), (0.0, 0.0), rotation=rotation))
        return rotation


def _in_own_frame(camera: Device) -> Device:
    if camera.rotation != IDENTITY or camera.translation_mm != (0.0, 0.0, 0.0):
        raise ValueError("expected a camera without rotation and translation_mm; give those of the projectors from it")
    return camera


Camera = Annotated[Device, AfterValidator(_in_own_frame)]
