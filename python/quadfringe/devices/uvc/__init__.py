"""Webcams and other colour cameras through OpenCV, and video files in their place.

>>> from quadfringe.devices import open_camera
>>> with open_camera("uvc:0") as camera:  # doctest: +SKIP
...     shot = camera.snap()
"""

from __future__ import annotations

from quadfringe.devices.uvc._controls import compression
from quadfringe.devices.uvc._source import FoundDevice, found
from quadfringe.devices.uvc.camera import UvcCamera, open_devices

__all__ = ["FoundDevice", "UvcCamera", "compression", "found", "open_devices"]
