"""Calibrations that contradict the bench that took a shot, as moved images and moved devices make them.

>>> import quadfringe as qf
>>> from quadfringe.evaluation.wrong_geometry import *
>>> with qf.open() as scanner:
...     moved = FAULTS["rows 20"](scanner.calibration)
>>> moved.camera.centre_px[1] - scanner.calibration.camera.centre_px[1]
20.0
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import MappingProxyType

import cv2
import numpy as np

from quadfringe.config import Device, SceneConfig, SystemConfig
from quadfringe.data import AnyShot, Calibration, CalibrationRecord, CalibrationStep
from quadfringe.scanner import open_system

__all__ = ["BOARDS_MM", "CLOSE", "FAULTS", "WIDE", "Exposed", "exposed", "with_boards"]

# Cameras of 512 x 384: the published field of view, in which the light has no border, and a wider one, in which it has.
CLOSE, WIDE = (
    Device(width_px=512, height_px=384, focal_px=(focal, focal), centre_px=(255.5, 191.5)) for focal in (1290.0, 600.0)
)
BOARDS_MM = (730.0, 870.0)  # depths of calibration boards around the scenes, which lie at 800 mm
SCENES = ("plane", "face", "steps", "peaks")
NOISE = 0.01

Change = Callable[[Calibration], Calibration]


@dataclass(frozen=True)
class Exposed:
    """A shot of a scene, and the calibration of the bench that took it."""

    scene: str
    shot: AnyShot
    calibration: Calibration


def _changed(device: Device, **fields: object) -> Device:
    return Device.model_validate(device.model_dump() | fields)


def _moved(device: Device, columns_px: float, rows_px: float) -> Device:
    return _changed(device, centre_px=(device.centre_px[0] + columns_px, device.centre_px[1] + rows_px))


def _turned(device: Device, axis: int, degrees: float) -> Device:
    """Turn a device about its centre, around its x (0), y (1) or z (2)."""
    turn, _ = cv2.Rodrigues(np.radians(degrees) * np.eye(3)[axis])
    pose = np.array(device.rotation), np.array(device.translation_mm)
    return _changed(device, rotation=(turn @ pose[0]).tolist(), translation_mm=(turn @ pose[1]).tolist())


def _scaled(device: Device, focal: float = 1.0, distance: float = 1.0) -> Device:
    focal_px = [focal * f for f in device.focal_px]
    return _changed(device, focal_px=focal_px, translation_mm=[distance * t for t in device.translation_mm])


def _camera(change: Callable[[Device], Device]) -> Change:
    return lambda known: known.model_copy(update={"camera": change(known.camera)})


def _projectors(change: Callable[[Device], Device]) -> Change:
    """Change both projectors, so that the pair is no evidence."""

    def changed(known: Calibration) -> Calibration:
        devices = {"projector": known.projector, "infrared": known.infrared}
        return known.model_copy(update={n: change(device) for n, device in devices.items() if device is not None})

    return changed


FAULTS: MappingProxyType[str, Change] = MappingProxyType(
    {
        "rows 20": _camera(lambda device: _moved(device, 0, 20)),
        "rows -20": _camera(lambda device: _moved(device, 0, -20)),
        "rows 60": _camera(lambda device: _moved(device, 0, 60)),
        "columns 20": _camera(lambda device: _moved(device, 20, 0)),
        "pan 5": _projectors(lambda device: _turned(device, 1, 5)),
        "pan -5": _projectors(lambda device: _turned(device, 1, -5)),
        "tilt 5": _projectors(lambda device: _turned(device, 0, 5)),
        "roll 5": _projectors(lambda device: _turned(device, 2, 5)),
        "focal length 1.5": _projectors(lambda device: _scaled(device, focal=1.5)),
        "principal point x 40": _projectors(lambda device: _moved(device, 40, 0)),
        "principal point y 40": _projectors(lambda device: _moved(device, 0, 40)),
        "distance 1.2": _projectors(lambda device: _scaled(device, distance=1.2)),
    }
)


def exposed(camera: Device, scenes: tuple[str, ...] = SCENES, seed: int = 1) -> Iterator[Exposed]:
    """Give a shot of each scene with this camera, which is sound."""
    for scene in scenes:
        settings = SceneConfig.model_validate({"surface": scene, "noise": NOISE, "seed": seed})
        with open_system(SystemConfig(camera=camera, scene=settings)) as scanner:
            assert scanner.calibration is not None
            yield Exposed(scene, scanner.grab(), scanner.calibration)


def with_boards(known: Calibration) -> Calibration:
    """Give a calibration with the record of boards at `BOARDS_MM`, as `quadfringe calibrate` writes it."""
    poses = {f"pose_{z_mm:.0f}": {"T_camera_board": _pose(z_mm)} for z_mm in BOARDS_MM}
    step = CalibrationStep(name="poses", good=True, verdict="good", settings=poses)
    record = CalibrationRecord(made_utc="2026-01-01T00:00:00+00:00", quadfringe_version="0", rig="bench", steps=(step,))
    return known.model_copy(update={"record": record})


def _pose(z_mm: float) -> list[list[float]]:
    pose = np.eye(4)
    pose[2, 3] = z_mm
    return [[float(value) for value in row] for row in pose]
