"""The guided calibration: what to capture, what is missing, what came of it, in plain words.

A thin layer over `quadfringe.calibration`: captures come from a folder, which camera and
projectors fill, or from the virtual bench; every step calls the
functions there, and one `Calibration` with the record of every step comes out.
"""

from quadfringe.calibration.session.acquisition import take_captures
from quadfringe.calibration.session.captures import Captures, FolderCaptures
from quadfringe.calibration.session.flow import Guided, guide
from quadfringe.calibration.session.settings import Session, step_named

__all__ = ["Captures", "FolderCaptures", "Guided", "Session", "guide", "step_named", "take_captures"]
