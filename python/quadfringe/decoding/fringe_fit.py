"""Amplitude, contrast, harmonics and crosstalk of the fringes of a decoded shot.

With the absolute phase known at every pixel, each channel is a sum of known waves: its fringes, their second harmonic
(a non-linear response) and the fringes of the other channels (crosstalk). Least squares over the whole image gives
their amplitudes. Over a whole field 36 and 35 fringes are nearly orthogonal; across an object of a few fringes they are
nearly the same, so that every ratio comes with the least value that it has for sure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Device
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import fit_params
from quadfringe.decoding.jackknife import Jackknife, normal_equations, tiles_of
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.stages import carrier
from quadfringe.decoding.symptoms import linear_light_of

__all__ = [
    "Fit",
    "Waves",
    "expected_column",
    "fit_fringes",
    "infrared_column",
    "pixels_of",
    "relative_waves",
    "shown_waves",
]

Map = NDArray[np.float32]
Wave = NDArray[np.float64]
Real = TypeVar("Real", np.float32, np.float64)
# Checked by pytest tests/test_doctor.py on shots with known defects.
PIXELS_MIN = 5000  # pixels with fringes, below which amplitudes are not estimated


class Stray(NamedTuple):
    """A channel, the channel whose fringes it sees too, and their amplitude relative to the right ones, at least."""

    to: str
    of: str
    share: float
    least: float


@dataclass(frozen=True)
class Fit:
    """Fringe amplitude of each channel, share of full scale, and the ratio of its second harmonic to the first.

    `contrast` is the amplitude over the mean light: 1 for full fringes, 0 without any. `crosstalk` (4, 4), or (3, 3)
    without infrared, is the amplitude of the fringes of each channel (columns) in each captured channel (rows),
    relative to the fringes of the captured channel itself. `harmonic_least` and `crosstalk_least` are the least sizes
    of the ratios that the tiles of the image leave possible; -inf where there are too few.
    """

    names: tuple[str, ...]
    amplitude: NDArray[np.float64]
    harmonic: NDArray[np.float64]
    crosstalk: NDArray[np.float64]
    contrast: NDArray[np.float64]
    harmonic_least: NDArray[np.float64]
    crosstalk_least: NDArray[np.float64]

    @property
    def worst_stray(self) -> Stray:
        """The strongest crosstalk that is sure; without any, the one that may be the strongest."""
        stray = np.abs(self.crosstalk) * ~np.eye(len(self.names), dtype=bool)
        sure = np.where(stray > 0, self.crosstalk_least, -np.inf)
        to, of = np.unravel_index(int(np.argmax(sure if sure.max() > 0 else stray)), stray.shape)
        return Stray(self.names[int(to)], self.names[int(of)], float(stray[to, of]), float(sure[to, of]))


def fit_fringes(shot: AnyShot, shape: Shape, plan: Plan) -> Fit | None:
    """Fit the waves of every channel in linear light; None when fewer than 5000 pixels carry fringes."""
    light, backgrounds, inside, period_px = relative_waves(shot, shape, plan)
    if inside.sum() < PIXELS_MIN:
        return None
    pixels, starts = tiles_of(inside, max(fit_params.TILE_OF_ERRORS_PX, period_px))
    shown, phases = shown_waves(shape, plan, pixels)
    found = []
    for i, name in enumerate(plan.fringes.channels):
        twice = np.stack([np.cos(2 * phases[i]), np.sin(2 * phases[i]), np.ones_like(phases[i])], axis=1)
        background = backgrounds[name].ravel()[pixels]
        wave = light[name].ravel()[pixels] / background - 1
        equations = normal_equations(np.hstack([shown, twice]), wave.astype(np.float64), starts)
        found.append(_channel(equations, i, float(np.median(background))))
    return Fit(
        plan.fringes.channels,
        amplitude=np.array([one.contrast * one.light for one in found]),
        harmonic=np.array([one.harmonic for one in found]),
        crosstalk=np.stack([one.crosstalk for one in found]),
        contrast=np.array([one.contrast for one in found]),
        harmonic_least=np.array([one.harmonic_least for one in found]),
        crosstalk_least=np.stack([one.crosstalk_least for one in found]),
    )


@dataclass(frozen=True)
class _Channel:
    """What a `Fit` tells of one captured channel, and its mean light, share of full scale."""

    light: float
    contrast: float
    harmonic: float
    harmonic_least: float
    crosstalk: Wave
    crosstalk_least: Wave


def _channel(equations: Jackknife, own: int, light: float) -> _Channel:
    """Solve the equations of a channel."""
    count = equations.sides.shape[1] - 3

    def ratios(found: NDArray[np.float64]) -> NDArray[np.float64]:
        harmonic = np.hypot(found[..., count], found[..., count + 1]) / found[..., own]
        strays = found[..., :count] / found[..., own, None]
        return np.asarray(np.abs(np.concatenate([harmonic[..., None], strays], axis=-1)))

    # Without the waves of the others, which are nearly the same across a narrow object and share its contrast at will.
    contrast = abs(float(equations.solved([own, count, count + 1, count + 2])[0]))
    found = equations.solved()
    whole, least = equations.least(ratios)
    return _Channel(light, contrast, float(whole[0]), float(least[0]), found[:count] / found[own], least[1:])


class Waves(NamedTuple):
    """Linear light and its mean over about a fringe, by channel, the pixels where all are valid, and the period."""

    light: dict[str, Map]
    backgrounds: dict[str, Map]
    inside: NDArray[np.bool_]
    period_px: float


def relative_waves(shot: AnyShot, shape: Shape, plan: Plan) -> Waves:
    """Compute the linear light of a shot and its mean over about a fringe."""
    import cv2

    light = linear_light_of(shot, plan)
    period_px, _ = carrier(np.nan_to_num(light["red"]))
    period_px = period_px if np.isfinite(period_px) else 20.0
    known = shape.returned & np.all([np.isfinite(image) for image in light.values()], axis=0)
    weight = cv2.GaussianBlur(known.astype(np.float32), (0, 0), period_px)
    backgrounds = {}
    for name, image in light.items():
        summed = cv2.GaussianBlur(np.where(known, image, 0).astype(np.float32), (0, 0), period_px)
        backgrounds[name] = summed / np.maximum(weight, 1e-6)
    inside = known & (weight > 0.95) & np.all([b > 0.02 for b in backgrounds.values()], axis=0)
    return Waves(light, backgrounds, inside, period_px)


def shown_waves(shape: Shape, plan: Plan, pixels: NDArray[np.intp]) -> tuple[Wave, list[Wave]]:
    """Give the fringes that each channel shows at some pixels, (N, channels), and their phases."""
    column = shape.column_px.astype(float)
    third = infrared_column(shape, plan) if plan.fringes.infrared else column
    numbers = zip(plan.fringes.numbers, (column, column, third), strict=False)  # there may be two
    phases = [2 * np.pi * number * seen.ravel()[pixels] / plan.projector_width_px for number, seen in numbers]
    if plan.fringes.quadrature:
        phases.insert(2, phases[0])
    shown = np.stack([np.cos(phase) for phase in phases], axis=1)
    if plan.fringes.quadrature:  # blue is a quarter period before red
        shown[:, 2] = -np.sin(phases[2])
    return shown, phases


def infrared_column(shape: Shape, plan: Plan) -> NDArray[np.float64]:
    """Give the column (H, W) of the plain infrared fringes at each point, as the decoder takes them to lie.

    It is that of the visible projector, unless the shape was decoded with the calibration of both projectors.
    """
    if plan.decode.unwrapping == "pair" and plan.fringes.predeformed_z_mm is None:
        return expected_column(shape, plan)
    return shape.column_px.astype(float)


def expected_column(shape: Shape, plan: Plan) -> NDArray[np.float64]:
    """Return the column of the infrared projector that lights each point according to the calibration."""
    calibration = plan.calibration
    if calibration is None or calibration.infrared is None or shape.xyz_mm is None:
        return shape.column_px.astype(float)
    return _columns_px(shape.xyz_mm, calibration.infrared)


def _columns_px(xyz_mm: Map, device: Device) -> NDArray[np.float64]:
    points = np.nan_to_num(xyz_mm.reshape(-1, 3).astype(float), nan=1.0)
    columns = pixels_of(points, device)[:, 0].reshape(xyz_mm.shape[:2])
    return np.where(np.isfinite(xyz_mm[:, :, 2]), columns, np.nan)


def pixels_of(points_mm: NDArray[Real], device: Device) -> NDArray[Real]:
    """Give columns and rows, (..., 2) px, at which a device sees points of the camera frame, (..., 3) mm.

    NaN stays NaN. As cv2.projectPoints, which takes about ten times as long: every decode projects thousands of points.
    """
    kind = points_mm.dtype
    (fx, fy), (cx, cy), (k1, k2, p1, p2, k3) = device.focal_px, device.centre_px, device.distortion
    turn, shift_mm = np.array(device.rotation, kind), np.array(device.translation_mm, kind)
    with np.errstate(all="ignore"):  # points in the plane of the device, and numbers that no lens has
        turned = turn @ np.moveaxis(points_mm, -1, 0).reshape(3, -1) + shift_mm[:, None]
        x, y = turned[:2] / turned[2]
        r2, xy = x * x + y * y, x * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        column = fx * (x * radial + 2 * p1 * xy + p2 * (r2 + 2 * x * x)) + cx
        row = fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * xy) + cy
    return np.stack([column, row], axis=-1).reshape(*points_mm.shape[:-1], 2)
