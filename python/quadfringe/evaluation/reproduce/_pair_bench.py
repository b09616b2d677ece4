"""A virtual bench whose infrared projector deviates from the visible one, in front of a plane.

A `ProjectorPair` holds devices, mirror layout and light. `expose` renders a shot of a plane, `decoded` returns the
absolute phase that the decoder finds, without a verdict, and `infrared_error_rad` the error of the infrared fringes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration.projector_pair import deviated
from quadfringe.config import ChannelResponse, DecodeConfig, Device, Fringes, Matrix4, Response
from quadfringe.data import Calibration, Shot, core_device, device_from_core
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.stages import carrier, fourier, linear_light
from quadfringe.devices.light import eight_bit, predeformation

__all__ = [
    "FRINGES",
    "PLANE_MM",
    "Exposure",
    "ProjectorPair",
    "decoded",
    "expose",
    "ideal_pair",
    "infrared_error_rad",
    "published_camera",
    "real_pair",
    "wrong_percent",
]

Map = NDArray[np.float32]
Vector3 = tuple[float, float, float]
Method = Literal["published", "joint"]
Unwrapping = Literal["coaxial", "pair"]

FRINGES = Fringes()
PLANE_MM = 800.0  # the reference plane
DEVIATION_DEG, DEVIATION_MM = 1.0, 0.5  # on every axis: the deviation of the paper
SEED = 4

# Distortion of ordinary lenses, 0.1 to 1 % at the edges of the image, different for each device.
CAMERA_LENS = (-0.12, 0.08, 2e-4, -3e-4, 0.0)
VISIBLE_LENS = (-0.05, 0.03, 3e-4, -2e-4, 0.0)
INFRARED_LENS = (-0.06, 0.04, -2e-4, 3e-4, 0.0)
# Defects of a real bench: noise of 1 %, blur, 5 % crosstalk between all channels, a response with exponent 1.8.
LEAK, EXPONENT, DARK = 0.05, 1.8, 0.02
CROSSTALK: Matrix4 = tuple(tuple(1.0 if i == j else LEAK for j in range(4)) for i in range(4))  # type: ignore[assignment]
DEFECTS: dict[str, Any] = {
    "noise": 0.01,
    "blur_px": 0.7,
    "crosstalk": CROSSTALK,
    "gain": (0.85,) * 4,
    "camera_exponent": (EXPONENT,) * 4,
    "camera_offset": (DARK,) * 4,
}


@dataclass(frozen=True)
class ProjectorPair:
    """Camera, visible and infrared projector, their mirror layout, and the defects of the light."""

    camera: Device
    visible: Device
    infrared: Device
    layout: Literal["regular", "diamond"] = "regular"
    light: dict[str, Any] = field(default_factory=dict)

    @property
    def single(self) -> ProjectorPair:
        """The same bench with one projector for all four channels."""
        return replace(self, infrared=self.visible)

    @property
    def bench(self) -> _core.Bench:
        """The kernel's bench."""
        camera, visible, infrared = (core_device(device) for device in (self.camera, self.visible, self.infrared))
        return _core.Bench(camera=camera, visible=visible, infrared=infrared, layout=self.layout)

    @property
    def calibration(self) -> Calibration:
        """The exact calibration of this bench."""
        known: dict[str, Any] = {}
        if self.light:
            channel = ChannelResponse(offset=DARK, exponent=EXPONENT)
            known["response"] = Response(red=channel, green=channel, blue=channel, ir=channel)
            known["crosstalk"] = self.light["crosstalk"]
        return Calibration(camera=self.camera, projector=self.visible, infrared=self.infrared, **known)


def ideal_pair(
    rotation_deg: Vector3, translation_mm: Vector3, shrink: int = 1, layout: Literal["regular", "diamond"] = "regular"
) -> ProjectorPair:
    """Return the published bench with a deviated infrared projector, ideal lenses and defect-free light.

    The camera has 1/`shrink` of the pixels in each direction and the same field of view.
    """
    reference = _core.Bench(layout=layout)
    visible = device_from_core(reference.visible)
    camera = published_camera(shrink)
    return ProjectorPair(camera, visible, deviated(visible, rotation_deg, translation_mm), layout)


def real_pair(
    rotation_deg: Vector3 = (DEVIATION_DEG,) * 3,
    translation_mm: Vector3 = (DEVIATION_MM,) * 3,
    shrink: int = 1,
    layout: Literal["regular", "diamond"] = "regular",
) -> ProjectorPair:
    """Return the same bench with lens distortion and with all defects of the light."""
    pair = ideal_pair(rotation_deg, translation_mm, shrink, layout)
    lenses = {"camera": CAMERA_LENS, "visible": VISIBLE_LENS, "infrared": INFRARED_LENS}
    devices = {name: getattr(pair, name).model_copy(update={"distortion": lens}) for name, lens in lenses.items()}
    return replace(pair, **devices, light=DEFECTS)


def published_camera(shrink: int = 1) -> Device:
    """Return the camera of the published bench, with 1/`shrink` of the pixels in each direction and the same field."""
    camera = device_from_core(_core.Bench().camera)
    width, height = camera.width_px // shrink, camera.height_px // shrink
    focal = tuple(f / shrink for f in camera.focal_px)
    centre = ((width - 1) / 2, (height - 1) / 2)
    size = {"width_px": width, "height_px": height, "focal_px": focal, "centre_px": centre}
    return Device.model_validate(camera.model_dump() | size)


@dataclass(frozen=True)
class Exposure:
    """A shot of a plane, and its truth: the exact phase (H, W), rad, NaN where it is not judged.

    Pixels that one projector does not light are not judged, nor are pixels within one infrared fringe of them or of the
    row ends, where the Fourier filter of the published method leaks. `apart_rad` is the offset of plain infrared
    fringes from the visible ones, in the phase of the first fringe number.
    """

    shot: Shot
    phase_rad: Map
    apart_rad: Map
    calibration: Calibration
    fringes: Fringes


def expose(
    pair: ProjectorPair, z_mm: float = PLANE_MM, known: Calibration | None = None, predeformed: bool = False
) -> Exposure:
    """Render a shot of the plane at depth `z_mm`, to be decoded with the calibration `known`, or with the exact one.

    With `predeformed`, the infrared image is pre-deformed for the reference plane by that calibration, and quantised
    to 8 bit as a projector receives it.
    """
    known = known or pair.calibration
    fringes = FRINGES.model_copy(update={"layout": pair.layout, "predeformed_z_mm": PLANE_MM if predeformed else None})
    image = None
    deformed = predeformation(fringes, known)
    if deformed is not None:
        image = eight_bit(deformed.light(fringes.numbers[2], pair.layout)).astype(np.float32) / np.float32(255)
    bench = pair.bench
    cast = bench.cast_plane(point_mm=(0.0, 0.0, z_mm), normal=(0.0, 0.0, -1.0))
    images = bench.render(cast, fringes.numbers, infrared_image=image, seed=SEED, **pair.light)
    per_px = np.float32(2 * np.pi * fringes.numbers[0] / pair.visible.width_px)
    visible_rad, infrared_rad = (per_px * cast.column_px(infrared=infrared) for infrared in (False, True))
    apart_rad = infrared_rad - visible_rad
    truth_rad = np.where(_inside(visible_rad, apart_rad, fringes), visible_rad, np.float32(np.nan))
    shot = Shot(images["red"], images["green"], images["blue"], images["ir"])
    return Exposure(shot, truth_rad, apart_rad, known, fringes)


def _inside(visible_rad: Map, apart_rad: Map, fringes: Fringes) -> NDArray[np.bool_]:
    """Return which pixels (H, W) both projectors light for one infrared fringe to either side."""
    slope = abs(float(np.nanmedian(np.diff(visible_rad, axis=1))))
    reach = int(np.ceil(2 * np.pi / slope * fringes.numbers[0] / fringes.numbers[2]))
    lit = np.pad(np.isfinite(apart_rad), ((0, 0), (reach, reach)))
    window = np.ones((1, 2 * reach + 1), np.uint8)
    return np.asarray(cv2.erode(lit.astype(np.uint8), window)[:, reach:-reach], dtype=np.bool_)


def decoded(exposure: Exposure, method: Method = "published", unwrapping: Unwrapping = "coaxial") -> Map:
    """Return the absolute phase (H, W), rad, that the decoder finds, including pixels of wrong order."""
    plan = Plan(
        projector_width_px=exposure.calibration.projector.width_px,
        fringes=exposure.fringes,
        calibration=exposure.calibration,
        decode=DecodeConfig(method=method, unwrapping=unwrapping),
    )
    shot = exposure.shot
    shape = Decoder(shot, plan).decode_without_verdict(shot)
    return np.where(np.isfinite(exposure.phase_rad), shape.phase_rad, np.float32(np.nan))


def infrared_error_rad(exposure: Exposure, unwrapping: Unwrapping = "coaxial") -> Map:
    """Return the error (H, W), rad, of the infrared fringes against the phase that the unwrapping expects.

    The phase comes from the Fourier filter; the error is scaled to the first fringe number (36).
    """
    first, _, third = exposure.fringes.numbers
    light = linear_light(exposure.shot, exposure.calibration)
    period_px = carrier(light["red"])[0] * first / third
    seen = fourier(light["ir"], period_px)
    expected = exposure.phase_rad * np.float32(third / first)
    if unwrapping == "pair":
        expected = _table(exposure).infrared_rad(exposure.phase_rad)
    error = seen - expected
    error -= 2 * np.pi * np.round(error / (2 * np.pi))
    return (error * np.float32(first / third)).astype(np.float32)


def _table(exposure: Exposure) -> _core.PairTable:
    known = exposure.calibration
    assert known.infrared is not None
    return _core.PairTable(
        core_device(known.camera),
        core_device(known.projector),
        core_device(known.infrared),
        exposure.fringes.numbers,
        predeformed_z_mm=exposure.fringes.predeformed_z_mm,
    )


def wrong_percent(phase_rad: Map, truth_rad: Map) -> float:
    """Return the percentage of valid pixels whose fringe order is wrong."""
    known = np.isfinite(phase_rad) & np.isfinite(truth_rad)
    wrong = np.abs(phase_rad[known] - truth_rad[known]) > np.pi
    return 100.0 * float(wrong.mean()) if wrong.size else float("nan")
