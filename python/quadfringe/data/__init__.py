"""The records of a measurement: `Shot` or `BayerShot` goes in with a `Calibration`, `Shape` comes out."""

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
