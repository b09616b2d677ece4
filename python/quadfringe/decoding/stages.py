"""The stages of the published method one by one, to teach and to debug; `decode` runs them all at once.

The recipe, step by step as in docs/method/published.md. Each line can be changed:

>>> import numpy as np
>>> import quadfringe as qf
>>> from quadfringe import stages
>>> camera = qf.Device(width_px=512, height_px=384, focal_px=(1290, 1290), centre_px=(255.5, 191.5))
>>> with qf.open(qf.SystemConfig(camera=camera)) as scanner:
...     shot, calibration = scanner.grab(), scanner.calibration
>>> light = stages.linear_light(shot, calibration)  # 1. linear light (S1)
>>> wrapped = stages.demodulate(light, (36, 35, 30))  # 2. to 4. background, phases of blocks and of pixels (S2, S3)
>>> phase_rad, margin = stages.order(wrapped, (36, 35, 30), 912)  # 5. and 6. fringe orders (S4), absolute phase
>>> phase_rad, quality = stages.discard_invalid(  # 6. low modulation and doubtful orders are no data
...     phase_rad, margin, wrapped.modulation, modulation_min=0.02, quality_min=0.15
... )
>>> phase_rad, column_px = stages.columns_from_phase(phase_rad, (36, 35, 30), 912)  # 8. projector column
>>> plan = qf.Plan(912, decode=qf.DecodeConfig(method="published"), calibration=calibration, response=qf.Response())
>>> np.array_equal(phase_rad, qf.decode(shot, plan).phase_rad, equal_nan=True)
True

The functions that these steps call, on fringes of 16 columns:

>>> row = np.cos(2 * np.pi * np.arange(512) / 16).astype(np.float32)
>>> red = np.tile(0.5 + 0.4 * row, (64, 1))
>>> blue = np.tile(0.5 - 0.4 * np.roll(row, 4), (64, 1))  # in quadrature
>>> stages.row_period(red), round(float(stages.carrier(red)[0]), 3)
(16.0, 16.0)
>>> rows, columns = stages.block_size(16.0, 19.2, 512)
>>> means = stages.block_means(red, rows, 1)
>>> level = stages.background(means, 16.0, kind="mean_envelope")
>>> stages.modulation_ratio(means - level, means - level).shape
(32,)
>>> stages.two_step(red - 0.5, blue - 0.5).shape, stages.fourier(means - level, 16.0).shape
((64, 512), (32, 512))
>>> (green_rad, modulation), _ = stages.fourier_pair(means - level, means - level, (16.0, 16.0), 1, 512)
>>> stages.fill_gaps(np.where(row > 0.99, np.nan, red).astype(np.float32)).shape
(64, 512)
>>> steps = np.cos(np.arange(4)[:, None, None] * np.pi / 2 + np.zeros((4, 8, 8))).astype(np.float32)
>>> phase_rad, mean, amplitude = stages.n_step(steps)
>>> absolute_rad, certain = stages.unwrap(phase_rad, phase_rad, phase_rad, (36, 35, 30), 912)
>>> stages.nearest_turn(phase_rad, absolute_rad).shape, stages.wrong_order_probability(certain).shape
((8, 8), (8, 8))
>>> isinstance(wrapped, stages.Wrapped), len(stages.wrapped_phases(light, (36, 35, 30)))
(True, 3)
>>> sound_rad = np.nan_to_num(qf.decode(shot, plan).phase_rad)
>>> stages.response_of_shot(shot, sound_rad, (36, 35, 30), 912)  # the light of this bench is linear
'linear'
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from quadfringe import _core
from quadfringe._core import (
    background,
    block_means,
    block_size,
    carrier,
    columns_from_phase,
    discard_invalid,
    fill_gaps,
    fourier,
    fourier_pair,
    modulation_ratio,
    n_step,
    nearest_turn,
    row_period,
    two_step,
    unwrap,
    wrong_order_probability,
)
from quadfringe.config import Response, ResponseChoice, brief
from quadfringe.config.fringes import fringe_numbers as numbers_of
from quadfringe.config.fringes import is_code
from quadfringe.data import AnyShot, BayerShot, Calibration, conditioning
from quadfringe.data._checks import check_maps
from quadfringe.decoding._kernel import check_shot
from quadfringe.decoding._wrapped import FringeNumbers, Map, Wrapped, each_alone, with_quadrature, wrap
from quadfringe.decoding.plan import calibration_of, response_of, stated_response
from quadfringe.decoding.shot_response import shot_response
from quadfringe.errors import InputError

__all__ = [
    "Wrapped",
    "background",
    "block_means",
    "block_size",
    "carrier",
    "columns_from_phase",
    "demodulate",
    "discard_invalid",
    "fill_gaps",
    "fourier",
    "fourier_pair",
    "linear_light",
    "modulation_ratio",
    "n_step",
    "nearest_turn",
    "order",
    "response_of_shot",
    "row_period",
    "two_step",
    "unwrap",
    "wrapped_phases",
    "wrong_order_probability",
]

CHANNELS = ("red", "green", "blue", "ir")


def linear_light(
    shot: AnyShot,
    calibration: Calibration | Path | str | None = None,
    response: Response | Literal["calibration", "auto", "linear"] | Path | str = "calibration",
) -> dict[str, Map]:
    """Give the channels as linear light, fractions of full scale, (H, W) float32, by name (S1).

    Dark level, response, crosstalk and registration come from the `calibration`. `response` is

    - "calibration" (default): the response of the calibration. If it has none, or without a calibration, intensities
      are taken as linear. This stage never estimates a response;
    - a `Response`, the path of its file, or "linear", which replace the response of the calibration;
    - "auto", as in a `Plan`: the response that the calibration states. Where a `Plan` would estimate it, `InputError`.

    IR is NaN where its chip does not see the point, and left out for a shot without infrared. The colours of a raw
    mosaic are interpolated at every pixel from linear samples. Raises `InputError` for arguments that are no shot,
    calibration or response, or cannot be read.
    """
    check_shot(shot)
    calibration = calibration_of(calibration)
    known = conditioning(calibration, "auto" if response == "calibration" else _known(response, calibration))
    if isinstance(shot, BayerShot):
        return _core.linear_light_bayer(shot.raw, shot.bayer, shot.ir, full_scale=shot.full_scale_value, **known)
    return _core.linear_light(shot.red, shot.green, shot.blue, shot.ir, full_scale=shot.full_scale_value, **known)


def response_of_shot(
    shot: AnyShot,
    phase_rad: Map,
    fringe_numbers: FringeNumbers,
    projector_width_px: int,
    calibration: Calibration | Path | str | None = None,
    *,
    columns_px: tuple[float, float] | None = None,
) -> Response | Literal["linear"]:
    """Give the response (gamma) that a shot shows with its phase, (H, W) float32 in rad; "linear" if it shows none.

    Without the right response the phase is wrong too, so decode again with the result and repeat, as
    `quadfringe.estimate_response` does. `columns_px` are those of the fringes that can light the scene. A channel
    without fringes stays linear. Dark level and registration come from the `calibration`. ValueError when the sizes
    differ.
    """
    light = linear_light(shot, calibration)
    return shot_response(light, phase_rad, fringe_numbers, projector_width_px, columns_px).response


def _known(response: object, calibration: Calibration | None) -> ResponseChoice:
    """Read and check a response that means the same as in a `Plan`; raise where a plan would estimate it."""
    found = response_of(response)
    if stated_response(found, calibration) == "auto":
        raise InputError(
            'response: the stages do not estimate it, and "auto" without a response in the calibration asks for that; '
            'call qf.estimate_response first, or pass response="linear"'
        )
    return found


def demodulate(light: dict[str, Map], fringe_numbers: FringeNumbers) -> Wrapped:
    """Give the phases and the modulation of linear light by name, each (H, W) float32 (S2, S3).

    Two fringe numbers are those of light without infrared, three those with it; three and 0, as `Fringes.code` gives
    them, are those of red, green and blue, of which a Fourier filter gives all phases.

    The fringe period comes from the red image. Raises `InputError` for other light, `DecodeError` when no fringes, or
    less than one, cross the rows.
    """
    numbers = numbers_of(fringe_numbers)
    _check_light(light, infrared=len(numbers) == len(CHANNELS) - 1)
    return each_alone(light, numbers[:3]) if is_code(numbers) else with_quadrature(light, numbers)


def order(
    wrapped: Wrapped, fringe_numbers: FringeNumbers, projector_width_px: int, rays: _core.PairTable | None = None
) -> tuple[Map, Map]:
    """Give absolute phase in rad and margin of the order, (H, W), by the ladder of beats (S4).

    With `rays`, a table of two calibrated projectors, orders are searched along the camera rays.
    """
    if not isinstance(wrapped, Wrapped):
        raise InputError(f"wrapped: expected a Wrapped, as stages.demodulate gives it, got {brief(wrapped)}")
    phases = (wrapped.red_blue_rad, wrapped.green_rad, wrapped.infrared_rad)
    if rays is None:
        means_rad, margin = unwrap(*phases, fringe_numbers, projector_width_px)
    else:
        means_rad, margin = rays.unwrap(*phases, rows=wrapped.rows)
    return nearest_turn(wrapped.phase_rad, wrapped.repeated(means_rad)), wrapped.repeated(margin)


def wrapped_phases(light: dict[str, Map], fringe_numbers: FringeNumbers) -> tuple[Map, ...]:
    """Give the wrapped phases in rad, (H, W): red and blue by two steps (S2), green and infrared by Fourier (S3).

    With two fringe numbers there is no infrared, and two phases. With three and 0, as `Fringes.code` gives them, the
    phases are those of red, green and blue. Raises `DecodeError` when no fringes cross the rows.
    """
    wrapped = demodulate(light, fringe_numbers)
    others = (wrapped.green_rad, wrapped.infrared_rad)[: len(fringe_numbers) - 1]
    return wrapped.phase_rad, *(wrap(wrapped.repeated(phase)) for phase in others)


def _check_light(light: object, *, infrared: bool) -> None:
    channels = CHANNELS if infrared else CHANNELS[:3]
    if not isinstance(light, Mapping) or not set(channels) <= set(light):
        got = f"only {', '.join(map(str, light))}" if isinstance(light, Mapping) and light else brief(light)
        raise InputError(f"light: expected {', '.join(channels)} by name, as stages.linear_light gives them, got {got}")
    check_maps({name: light[name] for name in channels})
