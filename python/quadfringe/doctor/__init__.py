"""Diagnosis: what is wrong with a shot, a calibration or the installation, and how to fix it."""

from quadfringe.doctor.calibration import examine_calibration, examine_digest
from quadfringe.doctor.finding import Finding
from quadfringe.doctor.installation import examine_installation
from quadfringe.doctor.plate import examine_board, examine_plane
from quadfringe.doctor.shot import examine_shot
from quadfringe.doctor.system import examine_system

__all__ = [
    "Finding",
    "examine_board",
    "examine_calibration",
    "examine_digest",
    "examine_installation",
    "examine_plane",
    "examine_shot",
    "examine_system",
]
