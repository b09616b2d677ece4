"""Responses of camera and projectors, and crosstalk of the channels, from evenly lit captures.

The camera sees levels l (R, G, B, IR, shares of full light) at a relative exposure e as

    captured_i = dark_i + (e (sum_j M_ij l_j ^ gamma_j + ambient_i)) ^ (1 / kappa_i),

where M_ij is the light of projected channel j in captured channel i. The virtual bench renders by this model, and the
decoder inverts it before (S1) holds: dark level, camera response, crosstalk, projector response. The crosstalk matrix
is M with its columns scaled to 1 on the diagonal. Without infrared there are three channels; the row and the column of
infrared are then those of the identity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.calibration._params import (
    AMBIENT_MAX,
    CAMERA_PRIOR,
    CLIPPED,
    DARK_PRIOR,
    ROBUST,
    UNLIT,
    USABLE_LEVELS_MIN,
)
from quadfringe.calibration.levels import CHANNELS, LevelPlan, row4
from quadfringe.config import Matrix4, Response, Row4
from quadfringe.errors import InputError

__all__ = ["Channels", "fit_channels"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Channels:
    """Fitted responses and crosstalk, one standard deviation of each number, and the errors before and after.

    Errors are shares of the full light of the channel, (K, 4), or (K, 3) without infrared, NaN for captures that were
    not used. `level_before` and `level_after` compare the captured with the projected level; `stray_before` and
    `stray_after` are the light of the other channels while the channel itself is projected black.
    """

    dark: Row4
    response: Response
    crosstalk: Matrix4
    projector_response: Response
    camera_exponent_sd: Row4
    projector_exponent_sd: Row4
    crosstalk_sd: Matrix4
    level_before: Array
    level_after: Array
    stray_before: Array
    stray_after: Array

    @property
    def figures(self) -> dict[str, float]:
        """Worst stray light, and RMS and worst level error, before and after, by name, per cent."""
        found = {}
        for when in ("before", "after"):
            stray, level = (getattr(self, f"{kind}_{when}") for kind in ("stray", "level"))
            found[f"stray_{when}_percent"] = 100 * float(np.nanmax(np.abs(stray)))
            found[f"level_rms_{when}_percent"] = 100 * float(np.sqrt(np.nanmean(level**2)))
            found[f"level_worst_{when}_percent"] = 100 * float(np.nanmax(np.abs(level)))
        return found

    def keywords(self) -> dict[str, Any]:
        """Return what was fitted as the fields of a `Calibration`."""
        return {name: getattr(self, name) for name in ("dark", "response", "crosstalk", "projector_response")}


def fit_channels(plan: LevelPlan, captured: Array, dark: Sequence[float] = (0.0,) * 4) -> Channels:
    """Fit responses and crosstalk to the mean captured levels (K, 4), shares of full scale, NaN where saturated.

    A plan without infrared has levels (K, 3).

    `dark` is the measured dark level, from which the fit starts. Raises `InputError` when captures of the plan are
    missing, when a camera channel does not see its projected channel, or when too few captures are unsaturated.
    """
    captured = np.asarray(captured, float)
    if captured.shape != plan.levels.shape:
        raise InputError(
            f"levels: expected {len(plan.levels)} captures of {plan.channels} channels, got an array of shape "
            f"{captured.shape}; "
            "capture every level of the plan"
        )
    seen = np.where(captured < CLIPPED, captured, np.nan)
    black = np.asarray(dark, float)[: plan.channels]
    _check_ramps(plan, seen - black)
    found, deviations = _solve(plan, seen, black)
    lit = seen - found.dark
    full_light = np.diag(found.mixing)
    crosstalk = found.mixing / full_light
    offset = np.linalg.solve(crosstalk, found.ambient).clip(0.0, AMBIENT_MAX)
    known: dict[str, Any] = {
        "dark": row4(found.dark),
        "response": Response.from_powers(np.zeros(4), row4(found.camera, 1.0)),
        "crosstalk": _matrix(crosstalk),
        "projector_response": Response.from_powers(row4(offset), row4(1 / found.projector, 1.0)),
    }
    return Channels(
        **known,
        camera_exponent_sd=row4(deviations.camera),
        projector_exponent_sd=row4(deviations.projector),
        crosstalk_sd=_matrix(deviations.mixing / full_light, 0.0),
        **_errors(plan, lit, captured, known),
    )


@dataclass(frozen=True)
class _Model:
    """Parameters of the model: exponents of camera and projector, light matrix M, ambient light and dark level."""

    camera: Array
    projector: Array
    mixing: Array
    ambient: Array
    dark: Array

    @classmethod
    def of(cls, numbers: Array) -> _Model:
        n = round((numbers.size + 4) ** 0.5) - 2  # channels: there are n^2 + 4 n numbers
        camera, projector, mixing, ambient, dark = np.split(numbers, np.cumsum([n, n, n * n, n]))
        return cls(camera, projector, mixing.reshape(n, n), ambient, dark)

    def numbers(self) -> Array:
        return np.concatenate([self.camera, self.projector, self.mixing.ravel(), self.ambient, self.dark])

    def captured(self, plan: LevelPlan) -> Array:
        light = plan.exposure[:, None] * (plan.levels**self.projector @ self.mixing.T + self.ambient)
        return np.asarray(self.dark + np.maximum(light, 0.0) ** (1 / self.camera))


def _solve(plan: LevelPlan, seen: Array, dark: Array) -> tuple[_Model, _Model]:
    """Return the fitted model and the standard deviations of its parameters."""
    from scipy.optimize import least_squares

    counts = np.isfinite(seen)

    def misses(numbers: Array) -> Array:
        model = _Model.of(numbers)
        priors = [CAMERA_PRIOR * (model.camera - 1), DARK_PRIOR * (model.dark - dark)]
        return np.concatenate([(model.captured(plan) - seen)[counts], *priors])

    start = _first_guess(plan, seen - dark, dark).numbers()
    n = plan.channels
    low = np.concatenate([np.full(2 * n, 0.2), np.full(n * n + n, -0.2), np.zeros(n)])
    high = np.concatenate([np.full(2 * n, 5.0), np.full(n * n + n, 3.0), np.full(n, 0.5)])
    start = start.clip(low + 1e-9, high - 1e-9)
    found = least_squares(
        misses, start, bounds=(low, high), x_scale="jac", xtol=1e-12, loss="soft_l1", f_scale=ROBUST, max_nfev=300
    )
    spare = max(int(counts.sum()) - start.size, 1)
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * 2 * found.cost / spare
    return _Model.of(found.x), _Model.of(np.sqrt(np.diag(covariance)))


def _first_guess(plan: LevelPlan, lit: Array, dark: Array) -> _Model:
    """Start from a linear camera: the power law of each ramp, and its brightest unsaturated level as its light."""
    black = np.nan_to_num(lit[_black(plan)].mean(axis=0))
    mixing, projector = np.eye(plan.channels), np.ones(plan.channels)
    for channel in range(plan.channels):
        rows = _ramp(plan, channel)
        light = np.where(np.isfinite(lit[rows]), lit[rows] - black, np.nan)
        level, seen = plan.levels[rows, channel], light[:, channel]
        usable = np.isfinite(seen) & (seen > ROBUST)
        slope, height = np.polyfit(np.log(level[usable]), np.log(seen[usable]), 1)
        projector[channel] = slope
        top = int(np.flatnonzero(np.isfinite(seen))[-1])
        mixing[:, channel] = np.nan_to_num(light[top]) / level[top] ** slope
        mixing[channel, channel] = np.exp(height)
    return _Model(np.ones(plan.channels), projector, mixing, black, dark)


def _black(plan: LevelPlan) -> NDArray[np.intp]:
    return np.flatnonzero(~plan.levels.any(axis=1))


def _ramp(plan: LevelPlan, channel: int) -> NDArray[np.intp]:
    """Return the captures that light this channel alone at full exposure, from dark to bright."""
    others = np.delete(plan.levels, channel, axis=1).any(axis=1)
    rows = np.flatnonzero((plan.levels[:, channel] > 0) & ~others & (plan.exposure == 1))
    return rows[np.argsort(plan.levels[rows, channel])]


def _check_ramps(plan: LevelPlan, lit: Array) -> None:
    black = _black(plan)
    if not black.size:
        raise InputError("levels: no capture is black; add one with all projectors showing black")
    for channel, name in enumerate(CHANNELS[: plan.channels]):
        ramp = lit[_ramp(plan, channel)]
        usable = np.isfinite(ramp[:, channel]).sum()
        if usable < USABLE_LEVELS_MIN or np.isnan(lit[black, channel]).all():
            raise InputError(
                f"levels: {name} is saturated in all but {usable} captures of its ramp, {USABLE_LEVELS_MIN} are "
                "needed; "
                f"shorten the exposure until the brightest capture stays below {CLIPPED:.0%} of full scale"
            )
        seen = ramp[:, channel] - np.nanmean(lit[black, channel])
        if np.nanmax(seen) < UNLIT:
            brightest = CHANNELS[int(np.nanargmax(np.nanmax(ramp, axis=0)))]
            raise InputError(
                f"levels: camera channel {name} sees only {np.nanmax(seen):.1%} of full scale while {name} is "
                "projected, "
                f"and {brightest} sees most of it; put the channels into the order red, green, blue, ir"
            )


def _errors(plan: LevelPlan, lit: Array, captured: Array, known: dict[str, Any]) -> dict[str, Any]:
    """Return level and stray errors before and after, shares of the full light of the channel, using the kernel."""
    counts = (plan.exposure == 1)[:, None] & np.isfinite(lit)
    after = _conditioned(captured, known)
    before = np.where(counts, lit, np.nan)
    after = np.where(counts & np.isfinite(lit).all(axis=1, keepdims=True), after, np.nan)
    # Stray light is judged before the projector response is undone, because the slope of its inverse vanishes at black.
    light = _conditioned(captured, {name: known[name] for name in ("dark", "response", "crosstalk")})
    light = np.where(np.isfinite(after), light, np.nan)
    unlit = plan.levels == 0
    return {
        "level_before": _level_error(plan, before - np.nanmean(before[_black(plan)], axis=0)),
        "level_after": _level_error(plan, after),
        "stray_before": np.where(unlit, _per_full_light(plan, before), np.nan),
        "stray_after": np.where(unlit, _per_full_light(plan, light), np.nan),
    }


def _conditioned(captured: Array, known: dict[str, Any]) -> Array:
    """Condition mean intensities (K, channels) as the decoder conditions pixels; returns linear light of that shape."""
    images = [np.ascontiguousarray(column[None], np.float32) for column in np.nan_to_num(captured).T]
    rows: dict[str, Any] = {name: value.rows if isinstance(value, Response) else value for name, value in known.items()}
    light = _core.linear_light(*images, **rows)
    return np.stack([values[0] for values in light.values()], axis=1).astype(float)


def _full_light(plan: LevelPlan, seen: Array) -> Array:
    """Extrapolate the brightest unsaturated capture of each ramp to the full light of the channel, (channels,)."""
    tops = []
    for channel in range(plan.channels):
        rows = _ramp(plan, channel)
        usable = rows[np.isfinite(seen[rows, channel])]
        tops.append(seen[usable[-1], channel] / plan.levels[usable[-1], channel])
    return np.array(tops)


def _per_full_light(plan: LevelPlan, seen: Array) -> Array:
    return np.asarray((seen - np.nanmean(seen[_black(plan)], axis=0)) / _full_light(plan, seen))


def _level_error(plan: LevelPlan, seen: Array) -> Array:
    """Return the error of lit captures against a line through zero, shares of full light; NaN for unlit channels."""
    lit = np.isfinite(seen) & (plan.levels > 0)
    found = np.full(seen.shape, np.nan)
    for channel in range(plan.channels):
        rows = lit[:, channel]
        level, value = plan.levels[rows, channel], seen[rows, channel]
        found[rows, channel] = value / (value @ level / (level @ level)) - level
    return found


def _matrix(values: Array, absent: float = 1.0) -> Matrix4:
    """Convert to rows of four; without infrared its row and column are 0, but for `absent` on the diagonal."""
    red, green, blue, ir = (*(row4(row) for row in values), (0.0, 0.0, 0.0, absent))[:4]
    return red, green, blue, ir
