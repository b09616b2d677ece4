"""Reliefs over a plane 800 mm from the camera, as height maps: fine detail, thin rods, objects that overlap."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core

PLANE_Z_MM = 800.0
HALF_WIDTH_MM, HALF_HEIGHT_MM = 175.0, 135.0
FRINGE_MM = 10.6  # of 36 fringes on the plane, camera and projector of the bench
WALL_MM = 2.0  # run of a wall: walls of a height map cannot be vertical

Heights = NDArray[np.float64]


@dataclass(frozen=True)
class Relief:
    """Heights towards the camera (rows, columns), mm, and the number of the part that each sample belongs to."""

    height_mm: Heights
    part: NDArray[np.int64]
    pitch_mm: float

    def cast(self, bench: _core.Bench) -> _core.Cast:
        """Send the rays of the camera."""
        pitch, origin = (self.pitch_mm, self.pitch_mm), (-HALF_WIDTH_MM, -HALF_HEIGHT_MM)
        return bench.cast_height_map(self.height_mm, pitch_mm=pitch, origin_mm=origin, z_mm=PLANE_Z_MM)

    def parts_at(self, points_mm: NDArray[np.float32]) -> NDArray[np.int64]:
        """Give the part at each point, (H, W)."""
        return np.asarray(self.part[self._places(points_mm)])

    def folds_at(self, points_mm: NDArray[np.float32]) -> Heights:
        """Give how far each point lies above its surroundings, in standard deviations, (H, W)."""
        above = self.height_mm - cv2.GaussianBlur(self.height_mm, (0, 0), FRINGE_MM / 2 / self.pitch_mm)
        return np.asarray((above / above.std())[self._places(points_mm)])

    def _places(self, points_mm: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        rows, columns = self.part.shape
        x = np.clip(np.nan_to_num((points_mm[..., 0] + HALF_WIDTH_MM) / self.pitch_mm).round(), 0, columns - 1)
        y = np.clip(np.nan_to_num((points_mm[..., 1] + HALF_HEIGHT_MM) / self.pitch_mm).round(), 0, rows - 1)
        return y.astype(np.int64), x.astype(np.int64)


def grid(pitch_mm: float) -> tuple[Heights, Heights]:
    """Give x and y of every sample, mm."""
    y, x = np.mgrid[-HALF_HEIGHT_MM:HALF_HEIGHT_MM:pitch_mm, -HALF_WIDTH_MM:HALF_WIDTH_MM:pitch_mm]
    return x, y


def coin(random: np.random.Generator) -> Relief:
    """Give a disc with a rim and 40 ridges and dents of 0.2 to 1 mm, a few mm wide."""
    x, y = grid(0.2)
    radius = np.hypot(x, y)
    height = 3.0 * np.clip((90 - radius) / 3, 0, 1) + 0.8 * np.exp(-(((radius - 84) / 2) ** 2))
    for _ in range(40):
        angle, far = random.uniform(0, 2 * np.pi), 75 * np.sqrt(random.uniform())
        across, along = random.uniform(1.0, 3.0), random.uniform(3.0, 12.0)
        turn = random.uniform(0, np.pi)
        dx, dy = x - far * np.cos(angle), y - far * np.sin(angle)
        u, v = dx * np.cos(turn) + dy * np.sin(turn), dy * np.cos(turn) - dx * np.sin(turn)
        size = random.uniform(0.2, 1.0) * random.choice((-1, 1))
        height += size * np.exp(-((u / along) ** 2) - (v / across) ** 2)
    return Relief(height, np.zeros(height.shape, np.int64), 0.2)


def cloth(random: np.random.Generator) -> Relief:
    """Give a draped cloth with folds of 0.3 to 1 fringe of the bench, and hair on it (part 1), 0.6 mm high."""
    x, y = grid(0.2)
    height, warp = 8.0 * np.exp(-((x / 120) ** 2) - (y / 90) ** 2), np.zeros(x.shape)
    for _ in range(6):
        turn, period = random.uniform(0, 2 * np.pi), random.uniform(60, 140)
        along = x * np.cos(turn) + y * np.sin(turn)
        warp += random.uniform(4, 9) * np.sin(2 * np.pi * along / period + random.uniform(0, 2 * np.pi))
    for _ in range(5):
        turn, period, slope = random.uniform(0, np.pi), FRINGE_MM * random.uniform(0.3, 1.0), random.uniform(0.15, 0.4)
        across = np.sin(2 * np.pi * (x * np.cos(turn) + y * np.sin(turn) + warp) / period)
        near = ((x - random.uniform(-90, 90)) / 60) ** 2 + ((y - random.uniform(-70, 70)) / 50) ** 2
        height += np.exp(-near) * slope * period / (2 * np.pi) * (1 - 2 * np.abs(across) ** 1.3)
    hair = np.zeros(x.shape)
    for _ in range(60):
        cx, cy, turn = random.uniform(-100, 100), random.uniform(-80, 80), random.uniform(0, np.pi)
        u = (x - cx) * np.cos(turn) + (y - cy) * np.sin(turn)
        v = (y - cy) * np.cos(turn) - (x - cx) * np.sin(turn) + 0.002 * u * u * random.choice((-1, 1))
        radius, long = FRINGE_MM * random.uniform(0.3, 1.0) / 4, random.uniform(15, 40)
        hair = np.maximum(hair, np.where(np.abs(u) < long, 0.6 * np.clip(1 - (v / radius) ** 2, 0, 1), 0))
    return Relief(height + hair, (hair > 0).astype(np.int64), 0.2)


def rods(random: np.random.Generator) -> Relief:
    """Give ten rods of 2 to 4 mm, 15 to 25 mm above the plane, in all directions."""
    x, y = grid(0.5)
    height, part = np.zeros(x.shape), np.zeros(x.shape, np.int64)
    for number in range(1, 11):
        cx, cy, turn = random.uniform(-100, 100), random.uniform(-70, 70), random.uniform(0, np.pi)
        u = (x - cx) * np.cos(turn) + (y - cy) * np.sin(turn)
        v = (y - cy) * np.cos(turn) - (x - cx) * np.sin(turn)
        radius, long = random.uniform(1.0, 2.0), random.uniform(30, 70)
        away = np.maximum(np.abs(v) - radius, np.abs(u) - long)
        _raise(height, part, random.uniform(15, 25) * np.clip(1 - away / WALL_MM, 0, 1), number)
    return Relief(height, part, 0.5)


def clutter(random: np.random.Generator) -> Relief:
    """Give six objects that overlap, domes and boxes of 10 to 40 mm, and four rods across them."""
    x, y = grid(0.5)
    height, part = np.zeros(x.shape), np.zeros(x.shape, np.int64)
    for number in range(1, 7):
        cx, cy, size = random.uniform(-90, 90), random.uniform(-60, 60), random.uniform(25, 45)
        top, turn = random.uniform(10, 40), random.uniform(0, np.pi)
        if number % 2:
            found = top * np.sqrt(np.clip(1 - ((x - cx) ** 2 + (y - cy) ** 2) / size**2, 0, 1))
        else:
            u = (x - cx) * np.cos(turn) + (y - cy) * np.sin(turn)
            v = (y - cy) * np.cos(turn) - (x - cx) * np.sin(turn)
            away = np.maximum(np.abs(u) - size, np.abs(v) - 0.6 * size)
            found = (top + 0.1 * u) * np.clip(1 - away / WALL_MM, 0, 1)
        _raise(height, part, found, number)
    bars = rods(random)
    kept = bars.part <= 4
    _raise(height, part, np.where(kept, 1.8 * bars.height_mm, 0), 7)
    return Relief(height, part, 0.5)


def waves(period_mm: float, amplitude_mm: float, along: str, phase_rad: float) -> Relief:
    """Give a sinusoid in height over "x" or "y"."""
    x, y = grid(0.2)
    height = amplitude_mm * np.sin(2 * np.pi * (x if along == "x" else y) / period_mm + phase_rad)
    return Relief(height, np.zeros(height.shape, np.int64), 0.2)


def step(height_mm: float, tilt_rad: float) -> Relief:
    """Give a step along a line through the centre, tilted against the rows; the lower side of the image is higher."""
    x, y = grid(0.5)
    away = y * np.cos(tilt_rad) - x * np.sin(tilt_rad)
    height = height_mm * np.clip(away / 0.5 + 0.5, 0, 1)
    return Relief(height, (away > 0).astype(np.int64), 0.5)


def _raise(height: Heights, part: NDArray[np.int64], other: Heights, number: int) -> None:
    higher = other > height
    height[higher] = other[higher]
    part[higher] = number
