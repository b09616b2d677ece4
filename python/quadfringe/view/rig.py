"""Where the devices of a calibration stand and what they see, for drawings of the rig."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Device
from quadfringe.data import Calibration

__all__ = ["Sight", "sights"]

FALLBACK_MM = 500.0  # depth of the drawing where the axes do not meet in front of the camera


@dataclass(frozen=True)
class Sight:
    """A device from above: its eye and the two ends of what it sees at the depth where the axes meet, (3, 3) mm."""

    name: str
    device: Device
    outline_mm: NDArray[np.float64]

    @property
    def baseline_mm(self) -> float:
        """Distance of the device from the camera, mm."""
        return float(np.linalg.norm(self.outline_mm[0]))


def sights(calibration: Calibration) -> list[Sight]:
    """Give the camera, the projector and, if it stands elsewhere, the infrared projector."""
    devices = {"camera": calibration.camera, "projector": calibration.projector, "infrared": calibration.infrared}
    depth_mm = _meeting_mm(calibration.projector)
    coaxial = calibration.infrared == calibration.projector
    return [
        Sight(name, device, _outline(device, depth_mm))
        for name, device in devices.items()
        if device is not None and not (name == "infrared" and coaxial)
    ]


def _eye(device: Device) -> NDArray[np.float64]:
    return np.asarray(-np.transpose(device.rotation) @ np.array(device.translation_mm), np.float64)


def _meeting_mm(projector: Device) -> float:
    """Return the depth where the projector's axis comes nearest to that of the camera."""
    eye, axis = _eye(projector), np.array(projector.rotation)[2]
    across = float(axis[0] ** 2 + axis[1] ** 2)
    if across < 1e-9:
        return FALLBACK_MM
    depth = float(eye[2] - (eye[:2] @ axis[:2]) / across * axis[2])
    return depth if depth > 0 else FALLBACK_MM


def _outline(device: Device, depth_mm: float) -> NDArray[np.float64]:
    eye, turn = _eye(device), np.transpose(device.rotation)
    ends = []
    for column in (0.0, device.width_px - 1.0):
        ray = turn @ np.array([(column - device.centre_px[0]) / device.focal_px[0], 0.0, 1.0])
        reach = (depth_mm - eye[2]) / ray[2] if ray[2] > 1e-6 else FALLBACK_MM
        ends.append(eye + max(reach, 1.0) * ray)
    return np.stack([eye, *ends])
