"""The stages of the published chain one by one, for those who teach or debug; `decode` does them all at once.

>>> import quadfringe as qf
>>> from quadfringe import stages
>>> with qf.open() as scanner:
...     wrapped = stages.wrapped_phases(scanner.grab(), (36.0, 35.0, 30.0))
>>> wrapped[0].shape
(768, 1024)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadfringe._core import background, carrier, fourier, n_step, two_step, unwrap
from quadfringe.data import Shot
from quadfringe.errors import DecodeError

__all__ = ["background", "carrier", "fourier", "linear_light", "n_step", "two_step", "unwrap", "wrapped_phases"]

Map = NDArray[np.float32]


def linear_light(shot: Shot) -> dict[str, Map]:
    """Give the channels as fractions of full scale, (H, W) float32; the response is taken as linear."""
    full = shot.full_scale_value
    return {name: (image / full).astype(np.float32) for name, image in shot.channels.items()}


def wrapped_phases(shot: Shot, fringe_numbers: tuple[float, float, float]) -> tuple[Map, Map, Map]:
    """Give the wrapped phases in rad, (H, W): red and blue by two steps (S2), green and infrared by Fourier (S3).

    Raises `DecodeError` when no fringes cross the rows.
    """
    light = linear_light(shot)
    period_px, _ = carrier(light["red"])
    if not np.isfinite(period_px):
        raise DecodeError("no fringes cross the rows of the red image; the published stages need them")
    red, blue = (light[name] - background(light[name], period_px) for name in ("red", "blue"))
    blue *= float(np.sqrt(np.square(red).mean() / max(np.square(blue).mean(), 1e-12)))
    first, second, third = fringe_numbers
    return (
        two_step(red, blue),
        fourier(light["green"], period_px * first / second),
        fourier(light["ir"], period_px * first / third),
    )
