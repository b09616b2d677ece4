"""Devices of the settings as devices of the kernel, and back."""

from __future__ import annotations

from quadfringe import _core
from quadfringe.config import Device

__all__ = ["core_device", "device_from_core"]


def core_device(model: Device) -> _core.Device:
    """Make the kernel's device from its settings."""
    return _core.Device(
        model.width_px,
        model.height_px,
        model.focal_px,
        model.centre_px,
        distortion=model.distortion,
        rotation=model.rotation,
        translation_mm=model.translation_mm,
    )


def device_from_core(device: _core.Device) -> Device:
    """Write out a device of the kernel as settings."""
    return Device(
        width_px=device.width,
        height_px=device.height,
        focal_px=device.focal_px,
        centre_px=device.centre_px,
        distortion=device.distortion,
        rotation=device.rotation,
        translation_mm=device.translation_mm,
    )
