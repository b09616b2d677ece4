"""GenICam cameras through Aravis: a visible and an infrared chip exposed together as one camera, or one chip.

>>> from quadfringe.devices import open_camera
>>> with open_camera("aravis:AD-080GE") as camera:      # doctest: +SKIP
...     shot = camera.snap()

Needs the extra `aravis` and Debian packages; the error raised without them names both. `quadfringe.devices.emulator`
emulates such a camera on the network.

>>> from quadfringe.config import AravisConfig, SystemConfig
>>> from quadfringe.devices.aravis import *
>>> for device in found():  # doctest: +SKIP
...     assert isinstance(device, Found)
...     print(device.where, device.model, device.serial)
>>> with AravisCamera(AravisConfig(exposure_us=8000.0)) as camera:  # doctest: +SKIP
...     shot = camera.snap()
>>> devices = open_devices(SystemConfig(capture="aravis:AD-080GE"))  # doctest: +SKIP
"""

from __future__ import annotations

from quadfringe.devices.aravis._device import Found, found
from quadfringe.devices.aravis.camera import AravisCamera, ChipCamera, open_devices

__all__ = ["AravisCamera", "ChipCamera", "Found", "found", "open_devices"]
