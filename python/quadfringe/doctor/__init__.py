"""Diagnosis: what is wrong with a shot, a calibration or the installation, and how to fix it.

>>> import quadfringe as qf
>>> from quadfringe.doctor import *
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> scene = qf.SceneConfig(surface="plane", noise=0.01)
>>> with qf.open(qf.SystemConfig(camera=small, scene=scene)) as scanner:
...     shot, plan = scanner.grab(), scanner.plan
>>> findings = [*examine_shot(shot, plan), *examine_plane(shot, plan), *examine_calibration(plan.calibration)]
>>> all(isinstance(finding, Finding) for finding in findings)
True
>>> {finding.grade for finding in findings} <= {"good", "note", "warning", "fault"}
True
>>> [finding.name for finding in examine_installation()][:2]  # doctest: +SKIP
>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> with TemporaryDirectory() as folder:
...     plan.calibration.save(Path(folder) / "calibration.json")
...     examine_digest(Path(folder) / "calibration.json").grade
'good'
"""

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
