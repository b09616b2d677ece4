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

from quadfringe import _core
from quadfringe._core import background, carrier, fourier, n_step, two_step, unwrap
from quadfringe.config import ChannelResponse, Response
from quadfringe.data import AnyShot, BayerShot, Calibration, conditioning
from quadfringe.errors import DecodeError

__all__ = [
    "background",
    "carrier",
    "fourier",
    "linear_light",
    "n_step",
    "response_of_shot",
    "two_step",
    "unwrap",
    "wrapped_phases",
]

Map = NDArray[np.float32]


def linear_light(
    shot: AnyShot, calibration: Calibration | None = None, response: Response | None = None
) -> dict[str, Map]:
    """Give the channels as linear light, fractions of full scale, (H, W) float32 (step 1 of the chain, S1).

    Dark level, response, crosstalk and registration are those of the `calibration`; `response` stands in for its
    own. Without either, intensities are taken as linear. NaN where the infrared chip does not see the point. The
    colours of a raw mosaic are interpolated at every pixel, from samples made linear.
    """
    known = conditioning(calibration, response)
    if isinstance(shot, BayerShot):
        return _core.linear_light_bayer(shot.raw, shot.bayer, shot.ir, full_scale=shot.full_scale_value, **known)
    return _core.linear_light(shot.red, shot.green, shot.blue, shot.ir, full_scale=shot.full_scale_value, **known)


def response_of_shot(
    shot: AnyShot,
    phase_rad: Map,
    fringe_numbers: tuple[float, float, float],
    projector_width_px: int,
    calibration: Calibration | None = None,
) -> Response | None:
    """Give the response (gamma) that a shot shows with its phase, (H, W) float32 in rad; None for linear light.

    The phase of a shot whose response was not undone is bent itself: decode again with what was found, and repeat;
    `quadfringe.estimate_response` does. A channel that shows nothing stays linear. Dark level and registration are
    those of the `calibration`. ValueError when the sizes differ.
    """
    light = linear_light(shot, calibration)
    found = _core.estimate_response_of_shot(
        light["red"], light["green"], light["blue"], light["ir"], phase_rad, fringe_numbers, projector_width_px
    )
    numbers = ChannelResponse.model_fields
    channels = {name: ChannelResponse(**{n: figures[n] for n in numbers}) for name, figures in found.items()}
    return Response(**channels) if channels else None


def wrapped_phases(shot: AnyShot, fringe_numbers: tuple[float, float, float]) -> tuple[Map, Map, Map]:
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
