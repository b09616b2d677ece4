"""GenICam cameras through Aravis: a visible and an infrared chip exposed together as one camera, or one chip.

>>> from quadfringe.devices import open_camera
>>> with open_camera("aravis:AD-080GE") as camera:      # doctest: +SKIP
...     shot = camera.snap()

Needs the extra `aravis` and Debian packages; the error raised without them names both. `quadfringe.devices.emulator`
emulates such a camera on the network.
"""

from __future__ import annotations

from quadfringe.devices.aravis._device import Found, found
from quadfringe.devices.aravis.camera import AravisCamera, ChipCamera, open_devices

__all__ = ["AravisCamera", "ChipCamera", "Found", "found", "open_devices"]
