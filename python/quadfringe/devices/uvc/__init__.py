"""Webcams and other colour cameras through OpenCV, and video files in their place.

>>> from quadfringe.devices import open_camera
>>> with open_camera("uvc:0") as camera:  # doctest: +SKIP
...     shot = camera.snap()
>>> from quadfringe.config import SystemConfig, UvcConfig
>>> from quadfringe.devices.uvc import *
>>> for device in found():  # doctest: +SKIP
...     assert isinstance(device, FoundDevice)
...     print(device.where, device.name)
>>> with UvcCamera(UvcConfig(device="0", exposure_us=33333.0)) as camera:  # doctest: +SKIP
...     shot = camera.snap()
>>> devices = open_devices(SystemConfig(capture="uvc:0"))  # doctest: +SKIP
>>> compression("YUYV"), len(compression("MJPG"))  # what is lost
((), 1)
"""

from __future__ import annotations

from quadfringe.devices.uvc._controls import compression
from quadfringe.devices.uvc._source import FoundDevice, found
from quadfringe.devices.uvc.camera import UvcCamera, open_devices

__all__ = ["FoundDevice", "UvcCamera", "compression", "found", "open_devices"]
