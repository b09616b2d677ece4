"""The guided calibration of a bench: it lists the captures and the missing ones, and makes one `Calibration`.

The captures come from a folder, which `take_captures` fills from the camera and the projectors, or from the virtual
bench. Every step calls functions of `quadfringe.calibration`; the result keeps a record of every step.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from quadfringe.calibration.session import *
>>> session = Session(rig="bench 1", poses=9)
>>> session.captures("dark"), step_named("poses").needed
(('01', '02', '03', '04'), True)
>>> with TemporaryDirectory() as name:
...     session.save(Path(name) / "session.json")
...     captures: Captures = FolderCaptures(Path(name), rig="bench 1")
...     done = guide(captures)  # nothing is there yet
>>> isinstance(done, Guided), done.calibration, len(done.missing["dark"])
(True, None, 4)
"""

from quadfringe.calibration.session.acquisition import take_captures
from quadfringe.calibration.session.captures import Captures, FolderCaptures
from quadfringe.calibration.session.flow import Guided, guide
from quadfringe.calibration.session.planning import session_of
from quadfringe.calibration.session.settings import Session, step_named

__all__ = ["Captures", "FolderCaptures", "Guided", "Session", "guide", "session_of", "step_named", "take_captures"]
