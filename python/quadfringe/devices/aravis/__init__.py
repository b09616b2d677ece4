"""Cameras of GenICam through Aravis: a visible and an infrared chip, exposed together, as one camera; or one chip.

>>> from quadfringe.devices import open_camera
>>> with open_camera("aravis:AD-080GE") as camera:      # doctest: +SKIP
...     shot = camera.snap()

Needs the extra `aravis` and the Debian packages that the error without them names. `quadfringe.devices.emulator`
is a camera on the wire for those who have none.
"""

from __future__ import annotations

from quadfringe.devices.aravis._gi import Found, found
from quadfringe.devices.aravis.camera import AravisCamera, ChipCamera, open_devices

__all__ = ["AravisCamera", "ChipCamera", "Found", "found", "open_devices"]
