"""Shots of a material into which the colours penetrate differently: the channels see fringes of different columns.

>>> from quadfringe.evaluation.penetration import *
>>> found = judged("face", GREEN_AND_IR, seed=1)
>>> 0.0 < found.rms_rad < 0.2
True
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import Device
from quadfringe.data import Reason, Shot, core_device
from quadfringe.decoding import Decoder, Plan
from quadfringe.evaluation._scenes import noisy_8bit

__all__ = ["GREEN_AND_IR", "ONE_ORDER", "Judged", "judged", "penetrated"]

CAMERA = Device(width_px=512, height_px=384, focal_px=(1290.325, 1290.325), centre_px=(255.5, 191.5))
NUMBERS, WIDTH_PX = (36.0, 35.0, 36.0, 30.0), 912
NOISE = 0.01
REACH_PX = 70.0  # of the spot in which light penetrates
EDGE_PX = 2.0

# Offsets of the fringes of R, G, B, IR, rad. Green and infrared see a point that is deeper than that of red and blue.
GREEN_AND_IR = (0.0, 0.1, 0.0, 0.4)
# What one order more does to green and infrared: 2 pi / 36 and 6 times that.
ONE_ORDER = (0.0, 2 * np.pi / 36, 0.0, 12 * np.pi / 36)

Offsets = tuple[float, float, float, float]


@dataclass(frozen=True)
class Judged:
    """Figures of the middle of the spot: errors of the phase, rad, against red and blue, and why pixels are missing.

    `inside` is the share of the errors inside one stated standard deviation; `wrong` and the reasons are in percent.
    """

    returned: float
    wrong: float
    rms_rad: float
    stated_rad: float
    inside: float
    reasons: dict[str, float]


def penetrated(surface: str, offsets_rad: Offsets, seed: int, *, everywhere: bool = False) -> dict[str, Any]:
    """Draw a shot whose channels have these offsets in the middle of the image, or everywhere, and its truth.

    Gives `shot`, `phase_rad` of the first fringe number, `counted` pixels and the `weight` of the offsets, (H, W).
    """
    cast = _core.Bench(camera=core_device(CAMERA)).cast(surface)
    column_px = cast.column_px().astype(np.float64)
    rows, columns = np.mgrid[: CAMERA.height_px, : CAMERA.width_px]
    square = (rows - CAMERA.centre_px[1]) ** 2 + (columns - CAMERA.centre_px[0]) ** 2
    weight = np.ones(column_px.shape) if everywhere else np.exp(-square / REACH_PX**2)
    images = []
    for channel, (number, offset_rad) in enumerate(zip(NUMBERS, offsets_rad, strict=True)):
        phase_rad = 2 * np.pi * number * column_px / WIDTH_PX + (np.pi / 2 if channel == 2 else 0.0)
        light = np.nan_to_num(0.5 + 0.4 * np.cos(phase_rad + offset_rad * weight))
        images.append(noisy_8bit((65535 * light).astype(np.uint16), NOISE, 10 * seed + channel))
    red, green, blue, ir = images
    lit = np.isfinite(column_px) & ~cast.shadow() & (cast.edge_distance_px() >= EDGE_PX)
    truth_rad = 2 * np.pi * NUMBERS[0] * column_px / WIDTH_PX
    return {"shot": Shot(red, green, blue, ir), "phase_rad": truth_rad, "counted": lit, "weight": weight}


def judged(surface: str, offsets_rad: Offsets, seed: int, *, everywhere: bool = False) -> Judged:
    """Decode such a shot without a verdict, and compare the middle of the spot with the truth."""
    drawn = penetrated(surface, offsets_rad, seed, everywhere=everywhere)
    shape = Decoder(drawn["shot"], Plan(WIDTH_PX, response="linear")).decode_without_verdict(drawn["shot"])
    middle: NDArray[np.bool_] = drawn["counted"] & (drawn["weight"] > 0.6)
    error = (shape.phase_rad - drawn["phase_rad"])[middle]
    assert shape.uncertainty_rad is not None
    assert shape.reason is not None
    sigma, reason = shape.uncertainty_rad[middle], shape.reason[middle]
    returned = np.isfinite(error)
    right = np.abs(error) < np.pi
    names = {Reason(value).name: 100 * float(np.mean(reason == value)) for value in np.unique(reason)}
    return Judged(
        returned=100 * float(returned.mean()),
        wrong=100 * float(np.mean(returned & ~right)),
        rms_rad=_rms(error[right]),
        stated_rad=_rms(sigma[right]),
        inside=float(np.mean(np.abs(error[right]) < sigma[right])) if right.any() else float("nan"),
        reasons=names,
    )


def _rms(values: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64)))) if values.size else float("nan")
