"""The region of a camera chip that is sent, against that of the captures from which a calibration was made.

A region that has moved gives images that look sound and points at wrong places; fringes do not show it.

>>> from quadfringe.devices.region import *
>>> step = region_step((64, 0))
>>> step.settings
{'offset_px': [64, 0]}
"""

from __future__ import annotations

from quadfringe.data import Calibration, CalibrationStep
from quadfringe.errors import InputError

__all__ = ["Offset", "calibrated_offset_px", "check_region", "region_step"]

Offset = tuple[int, int]
STEP = "camera region"


def region_step(offset_px: Offset) -> CalibrationStep:
    """Give the step of a calibration record that holds the first column and row of the images on the chip."""
    verdict = f"the images begin at column {offset_px[0]} and row {offset_px[1]} of the chip"
    return CalibrationStep(name=STEP, settings={"offset_px": list(offset_px)}, good=True, verdict=verdict)


def calibrated_offset_px(calibration: Calibration) -> Offset | None:
    """Give the first column and row of the captures of a calibration, if its record holds them."""
    for step in () if calibration.record is None else calibration.record.steps:
        value = step.settings.get("offset_px") if step.name == STEP else None
        if isinstance(value, (list, tuple)) and len(value) == 2 and all(isinstance(one, int) for one in value):
            return int(value[0]), int(value[1])
    return None


def check_region(calibration: Calibration | None, offset_px: Offset | None) -> None:
    """Raise `InputError` if a camera sends another region of its chip than was calibrated, and both are known."""
    known = None if calibration is None else calibrated_offset_px(calibration)
    if known is None or offset_px is None or known == offset_px:
        return
    raise InputError(
        f"camera: its images begin at column {offset_px[0]} and row {offset_px[1]} of the chip, and those of the "
        f"calibration at column {known[0]} and row {known[1]}; set offset_px = [{known[0]}, {known[1]}] under "
        "[capture.visible] and [capture.infrared] (OffsetX, OffsetY), or calibrate again"
    )
