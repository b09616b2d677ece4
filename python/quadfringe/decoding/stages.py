"""The stages of the published method one by one, to teach and to debug; `decode` runs them all at once.

The recipe, step by step as in docs/method/published.md. Each line can be changed:

>>> import numpy as np
>>> import quadfringe as qf
>>> from quadfringe import stages
>>> with qf.open() as scanner:
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
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
from quadfringe.config import ChannelResponse, Response, ResponseChoice, brief
from quadfringe.config.fringes import fringe_numbers as numbers_of
from quadfringe.config.fringes import is_code
from quadfringe.data import AnyShot, BayerShot, Calibration, conditioning
from quadfringe.data._checks import check_maps
from quadfringe.decoding._kernel import check_shot
from quadfringe.decoding.plan import calibration_of, response_of, stated_response
from quadfringe.errors import DecodeError, InputError

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

Map = NDArray[np.float32]
FringeNumbers = tuple[float, ...]  # as `Fringes.code`: of red and blue, of green, of infrared if there is any
CHANNELS = ("red", "green", "blue", "ir")


class Wrapped(NamedTuple):
    """Phases of one shot before unwrapping, float32.

    Orders are found on means over blocks of a few rows, (B, W) with one row for each block; the phase of the result is
    that of single pixels, (H, W).
    """

    phase_rad: Map
    """Wrapped phase of R and B at every pixel, (H, W), rad (S2); of blocks of R if each colour has a number."""
    modulation: Map
    """Least modulation of all channels, (H, W), fraction of full scale; NaN where IR has no data."""
    red_blue_rad: Map
    """Wrapped phase of the block means of R and B, (B, W), rad; of R, up to whole turns, if each has a number."""
    green_rad: Map
    """Phase of the block means of G, (B, W), rad, up to whole turns (S3)."""
    infrared_rad: Map
    """Phase of the block means of IR, or of B with a number for itself, (B, W), rad, up to whole turns (S3); else 0."""
    rows: int
    """Rows of a block."""

    def __repr__(self) -> str:
        height, width = self.phase_rad.shape
        return f"Wrapped({width} x {height}, blocks of {self.rows} rows)"

    def repeated(self, blocks: Map) -> Map:
        """Give a map of blocks, (B, W), at every pixel, (H, W)."""
        return np.repeat(blocks, self.rows, axis=0)[: len(self.phase_rad)]


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
    channels = (light["red"], light["green"], light["blue"], light.get("ir"))
    found = _core.estimate_response_of_shot(
        *channels, phase_rad, fringe_numbers, projector_width_px, columns_px=columns_px
    )
    numbers = ChannelResponse.model_fields
    responses = {name: ChannelResponse(**{n: figures[n] for n in numbers}) for name, figures in found.items()}
    return Response(**responses) if responses else "linear"


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
    return _each_alone(light, numbers[:3]) if is_code(numbers) else _with_quadrature(light, numbers)


def _with_quadrature(light: dict[str, Map], numbers: FringeNumbers) -> Wrapped:
    first, second, *third = numbers
    red, blue = light["red"], light["blue"]
    ir = light["ir"] if third else np.zeros_like(red)
    period_px, green_px, infrared_px = _periods_px(red, (first, second, *(third or [second])))
    rows, columns = block_size(green_px, infrared_px, red.shape[1])
    red_means, red_level = _fringes(red, rows, 1, period_px)
    blue_means, blue_level = _fringes(blue, rows, 1, period_px)
    ratio = modulation_ratio(red_means, blue_means)[:, np.newaxis]
    green_means, _ = _fringes(light["green"], rows, columns, green_px)
    infrared_means, _ = _fringes(fill_gaps(ir), rows, columns, infrared_px)
    periods = (green_px / columns, infrared_px / columns)
    found = fourier_pair(green_means, infrared_means, periods, columns, red.shape[1])
    (green, green_modulation), (infrared, infrared_modulation) = found

    def pixels(blocks: Map) -> Map:
        return np.repeat(blocks, rows, axis=0)[: len(red)]

    red_fringes = red - pixels(red_level)
    blue_fringes = (blue - pixels(blue_level)) * pixels(ratio)
    modulation = np.sqrt(red_fringes * red_fringes + blue_fringes * blue_fringes)
    least = np.fmin(modulation, pixels(green_modulation))
    least = np.fmin(least, pixels(infrared_modulation)) if third else least
    least[np.isnan(ir)] = np.nan
    return Wrapped(
        phase_rad=two_step(red_fringes, blue_fringes),
        modulation=least,
        red_blue_rad=two_step(red_means, blue_means * ratio, coarse=True),
        green_rad=green,
        infrared_rad=infrared if third else np.zeros_like(infrared),
        rows=rows,
    )


def _each_alone(light: dict[str, Map], numbers: FringeNumbers) -> Wrapped:
    """Give the Fourier phases of red, green and blue."""
    red, width = light["red"], light["red"].shape[1]
    period_px, green_px, blue_px = _periods_px(red, numbers)
    rows, columns = block_size(green_px, blue_px, width)
    red_means = block_means(_fringes(red, rows, 1, period_px)[0], 1, columns)
    green_means, blue_means = (
        _fringes(light[name], rows, columns, px)[0] for name, px in (("green", green_px), ("blue", blue_px))
    )
    (red_rad, modulation), _ = fourier_pair(red_means, red_means, (period_px / columns,) * 2, columns, width)
    found = fourier_pair(green_means, blue_means, (green_px / columns, blue_px / columns), columns, width)
    (green, green_modulation), (blue, blue_modulation) = found
    least = np.fmin(np.fmin(green_modulation, blue_modulation), modulation)
    phase_rad, modulation = (np.repeat(blocks, rows, axis=0)[: len(red)] for blocks in (_wrap(red_rad), least))
    return Wrapped(phase_rad, modulation, red_rad, green, blue, rows)


def _periods_px(red: Map, numbers: FringeNumbers) -> list[float]:
    """Give the fringe periods of these numbers along the rows; raise `DecodeError` when no fringes cross them."""
    period_px = row_period(red)
    others_px = [period_px * numbers[0] / number for number in numbers[1:]]
    if not np.isfinite(carrier(red)[0]) or max(others_px) > red.shape[1]:
        raise DecodeError("no fringes cross the rows of the red image; the published stages need them")
    return [period_px, *others_px]


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
    return wrapped.phase_rad, *(_wrap(wrapped.repeated(phase)) for phase in others)


def _check_light(light: object, *, infrared: bool) -> None:
    channels = CHANNELS if infrared else CHANNELS[:3]
    if not isinstance(light, Mapping) or not set(channels) <= set(light):
        got = f"only {', '.join(map(str, light))}" if isinstance(light, Mapping) and light else brief(light)
        raise InputError(f"light: expected {', '.join(channels)} by name, as stages.linear_light gives them, got {got}")
    check_maps({name: light[name] for name in channels})


def _wrap(phase_rad: Map) -> Map:
    turn = np.float32(2 * np.pi)
    return (phase_rad - turn * np.round(phase_rad / turn)).astype(np.float32)


def _fringes(image: Map, rows: int, columns: int, period_px: float) -> tuple[Map, Map]:
    """Give block means minus their background, and the background by the mean envelope."""
    means = block_means(image, rows, columns)
    level = background(means, period_px / columns, kind="mean_envelope")
    return means - level, level
