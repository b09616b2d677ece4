"""The records of a measurement: `Shot` or `BayerShot` goes in with a `Calibration`, `Shape` comes out.

>>> from quadfringe.data import *
>>> import numpy as np
>>> image = np.full((48, 64), 128, np.uint8)
>>> stamp = Stamp(7, 1_700_000_000_000_000, "camera", {"visible": FrameStamp(7, 10, 20)})
>>> shots: list[AnyShot] = [Shot(image, image, image, image, stamp=stamp), BayerShot(image, "rggb", image)]
>>> shots[0].full_scale_value, shots[1].raw.shape
(255.0, (48, 64))
>>> from tempfile import TemporaryDirectory
>>> with TemporaryDirectory() as folder:
...     files = write_shot(folder, shots[0])
...     same = read_shot(folder)
>>> sorted(files), np.array_equal(same.red, image)
(['blue', 'green', 'ir', 'red'], True)
>>> ChipImage(image, "Mono8", 255.0, None, stamp).pixels.shape  # of one chip alone
(48, 64)

A calibration, with the record of how it was made:

>>> import quadfringe as qf
>>> camera = qf.Device(width_px=64, height_px=48, focal_px=(160, 160), centre_px=(31.5, 23.5))
>>> step = CalibrationStep(name="poses", figures={"camera_rms_px": 0.02}, good=True, verdict="12 poses")
>>> record = CalibrationRecord(made_utc="2026-11-26T08:00:00", quadfringe_version="0.1.0", rig="bench 1", steps=(step,))
>>> calibration = Calibration(camera=camera, projector=camera, record=record)
>>> calibration.record.steps[0].verdict
'12 poses'
>>> response = ResponseCalibration(steps=12)
>>> sorted(conditioning(calibration, response))  # what the kernel corrects
['response']
>>> device_from_core(core_device(camera)) == camera
True

A shape and its surface:

>>> row, column = np.mgrid[0:48, 0:64].astype(np.float32)
>>> points_mm = np.dstack([column, row, np.full_like(row, 800)])
>>> shape = Shape(column, column, np.ones_like(row), np.ones_like(row), xyz_mm=points_mm)
>>> xyz_mm_of(shape) is points_mm, shape.mesh()
(True, Mesh(3072 vertices, 5922 triangles))
>>> isinstance(shape.mesh(), Mesh), isinstance(shape.normals(), Normals), Reason(0).words
(True, True, 'returned')
>>> truth = Truth(column, points_mm, row < 0, row < 1)  # of the virtual bench
>>> int(truth.edge.sum())
64
"""

from quadfringe.data.calibration import (
    Calibration,
    CalibrationRecord,
    CalibrationStep,
    ResponseCalibration,
    conditioning,
)
from quadfringe.data.mesh import Mesh, Normals
from quadfringe.data.optics import core_device, device_from_core
from quadfringe.data.points import xyz_mm_of
from quadfringe.data.reason import Reason
from quadfringe.data.shape import Shape
from quadfringe.data.shot import AnyShot, BayerShot, ChipImage, FrameStamp, Shot, Stamp, Truth
from quadfringe.data.shot_files import read_shot, write_shot

__all__ = [
    "AnyShot",
    "BayerShot",
    "Calibration",
    "CalibrationRecord",
    "CalibrationStep",
    "ChipImage",
    "FrameStamp",
    "Mesh",
    "Normals",
    "Reason",
    "ResponseCalibration",
    "Shape",
    "Shot",
    "Stamp",
    "Truth",
    "conditioning",
    "core_device",
    "device_from_core",
    "read_shot",
    "write_shot",
    "xyz_mm_of",
]
