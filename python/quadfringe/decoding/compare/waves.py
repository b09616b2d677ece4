"""Gamma and crosstalk: how much of a difference these faults explain.

`synthesis` makes the pattern of every fault. The fit is least squares over offset, tilt, bow and the patterns together
(D4), so that what is smooth over the image speaks for no fault. Decoders are not linear: what a family explains is
measured with one more shot, which has all its faults in the sizes that were found, scaled to the difference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.decoding.compare import params
from quadfringe.decoding.compare.forms import polynomials, share_explained
from quadfringe.decoding.compare.pixels import Pair
from quadfringe.decoding.compare.results import Explanation
from quadfringe.decoding.compare.synthesis import CHANNELS, GAMMAS, STRAYS, Faults, Maker, Member, recipe_of
from quadfringe.decoding.plan import Plan

__all__ = ["Family", "Waves", "waves_of"]

Map = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Family:
    """The faults of one kind: members, their patterns (H, W, N), px, their sizes (N,) in the faulty shape, and shares.

    `alone` is the share of the difference, without its smooth part, that the family explains by itself, and `more` what
    it adds once the other family has explained what it can.
    """

    name: str
    members: tuple[Member, ...]
    patterns: Map
    sizes: Map
    alone: float
    more: float = 0.0

    @property
    def size(self) -> float:
        """The largest fault."""
        sizes = np.cumsum(self.sizes) if self.name == "gamma" else self.sizes  # its second member adds to the first
        return float(np.abs(sizes).max())


@dataclass(frozen=True)
class Waves:
    """What was found: explanations, the columns that they explain, (H, W) px, and both families, the first one first.

    The columns are 0 when nothing is named, and NaN outside the band of rows for which shots were made otherwise.
    """

    found: tuple[Explanation, ...] = ()
    explained_px: Map | float = 0.0
    families: tuple[Family, ...] = ()


def waves_of(pair: Pair, difference_px: Map) -> Waves:
    """Name gamma and crosstalk of the single shot, A or B, whose light may be at fault; nothing without one."""
    difference_px = _trimmed(difference_px)
    band = _band(np.isfinite(difference_px))
    source = _source(pair, np.isfinite(difference_px))
    if source is None or int(np.isfinite(difference_px[band]).sum()) < params.PIXELS_MIN:
        return Waves()
    shape, plan, sign = source.shape, source.plan, source.sign
    maker = Maker(source.column_px[band], shape.modulation[band].astype(np.float64), plan)
    values = sign * difference_px[band]  # of the source over the other
    families = _families(maker, values, pair.period_px)
    found, explained = [], np.zeros(values.shape)
    for number, family in enumerate(families):
        if not _is_named(family, number):
            break
        part = _confirmed(maker, family, values - explained)
        words = _gamma_words if family.name == "gamma" else _crosstalk_words
        share = share_explained(values, part, values - explained)
        if share < params.WAVES_MORE:
            break
        found.append(Explanation(family.name, words(sign * family.sizes, family), share, family.size))
        explained = explained + part
    if not found:
        return Waves(families=families)
    whole = np.full(difference_px.shape, np.nan)
    whole[band] = sign * explained
    return Waves(tuple(found), whole, families)


@dataclass(frozen=True)
class _Source:
    """The shape whose light is at fault if any is, its plan, its sign in A less B, and the columns of the other one."""

    shape: Shape
    plan: Plan
    sign: int
    column_px: Map


def _source(pair: Pair, known: Mask) -> _Source | None:
    """Choose the shape of a single shot whose albedo keeps more of the fringes; None when neither is a single shot."""
    a, b = pair.column_a_px, pair.column_b_px
    sources = [
        _Source(shape, plan, sign, np.where(np.isfinite(other), other, its))
        for shape, sign, its, other in ((pair.a, 1, a, b), (pair.b, -1, b, a))
        if isinstance(shape, Shape) and (plan := recipe_of(shape)) is not None
    ]
    return max(sources, key=lambda one: _fringes_left(one.shape, one.plan, known), default=None)


def _fringes_left(shape: Shape, plan: Plan, known: Mask) -> float:
    """Give the largest amplitude of the fringes of a channel in its albedo, relative to it; 0 without albedo.

    Light that is linear and of one channel alone leaves none, while gamma leaves them in all channels.
    """
    if shape.albedo is None:
        return 0.0
    turns = 2 * np.pi * shape.column_px[known].astype(np.float64) / plan.projector_width_px
    found = [0.0]
    for channel, number in enumerate(plan.fringes.channel_numbers):
        light = shape.albedo[..., channel][known].astype(np.float64)
        seen = np.isfinite(light)
        if light[seen].any():  # 0 everywhere: a channel without light
            relative = light[seen] / light[seen].mean() - 1
            found.append(2 * abs(np.mean(relative * np.exp(1j * number * turns[seen]))))
    return float(max(found))


def _is_named(family: Family, number: int) -> bool:
    enough = family.alone >= params.WAVES_SHARE if number == 0 else family.more >= params.WAVES_MORE
    return enough and family.size >= (params.GAMMA_MIN if family.name == "gamma" else params.STRAY_MIN)


def _families(maker: Maker, values: Map, period_px: float) -> tuple[Family, Family]:
    """Fit both families, each alone; then the weaker one to what the stronger one leaves."""
    kinds = (("gamma", GAMMAS), ("crosstalk", STRAYS))
    fitted = [_fitted(name, members, maker.patterns(name, members), values, period_px) for name, members in kinds]
    first, second = sorted(fitted, key=lambda family: -family.alone)
    if first.alone < params.WAVES_SHARE:
        return first, second
    rest = values - _confirmed(maker, first, values)
    again = _fitted(second.name, second.members, second.patterns, rest, period_px)
    more = again.alone * _ratio(rest, values)
    return first, Family(second.name, second.members, second.patterns, again.sizes, second.alone, more)


def _ratio(rest: Map, values: Map) -> float:
    """Give the mean square of what is left over that of the whole, both without their smooth parts."""
    known = np.isfinite(rest) & np.isfinite(values)
    whole, left = (float(np.mean(_smoothed_out(np.where(known, m, np.nan))[known] ** 2)) for m in (values, rest))
    return left / whole if whole > 0 else 0.0


def _confirmed(maker: Maker, family: Family, values: Map) -> Map:
    """Make the shot with all faults of a family, and give the columns that they add, (H, W) px, scaled to the values.

    The sizes are linear estimates: the decoder may add several times of what they would.
    """
    part = maker.columns_off_px(Faults.from_sizes(family.name, family.members, family.sizes))
    known = np.isfinite(part) & np.isfinite(values)
    added, plain = (_smoothed_out(np.where(known, m, np.nan))[known] for m in (part, values))
    power = float(added @ added)
    return part * max(0.0, float(added @ plain) / power) if power > 0 else part


def _fitted(name: str, members: tuple[Member, ...], patterns: Map, values: Map, period_px: float) -> Family:
    known = np.isfinite(values) & np.isfinite(patterns).all(axis=-1)
    known &= (np.abs(patterns) < 2 * period_px).all(axis=-1)  # a wrong order in a made shot
    basis = np.linalg.qr(polynomials((values.shape[0], values.shape[1]))[known])[0]
    stack, plain = _without(patterns[known], basis), _without(values[known], basis)
    sizes = np.asarray(np.linalg.lstsq(stack, plain, rcond=None)[0], np.float64)
    total, rest = float(plain @ plain), plain - stack @ sizes
    return Family(name, members, patterns, sizes, 1 - float(rest @ rest) / total if total > 0 else 0.0)


def _without(values: Map, basis: Map) -> Map:
    return np.asarray(values - basis @ (basis.T @ values))


def _smoothed_out(values: Map) -> Map:
    """Take offset, tilt and bow out of a map (H, W)."""
    known = np.isfinite(values)
    out = np.full(values.shape, np.nan)
    out[known] = _without(values[known], np.linalg.qr(polynomials((values.shape[0], values.shape[1]))[known])[0])
    return out


def _trimmed(difference_px: Map) -> Map:
    """Leave single pixels out that would outweigh the rest."""
    away = np.abs(difference_px - np.nanmedian(difference_px))
    limit = params.OUTLIER_SIGMAS * params.NORMAL * float(np.nanmedian(away))
    return np.where(away <= limit, difference_px, np.nan)


def _band(known: Mask) -> slice:
    """Choose the rows with most pixels."""
    rows = known.shape[0]
    if rows <= params.ROWS:
        return slice(0, rows)
    sums = np.concatenate([[0], np.cumsum(known.sum(axis=1))])
    first = int(np.argmax(sums[params.ROWS :] - sums[: -params.ROWS]))
    return slice(first, first + params.ROWS)


def _gamma_words(sizes: Map, _family: Family) -> str:
    infrared, visible = float(sizes[0]), float(sizes.sum())
    return (
        "the difference follows the fringes as a response that is not linear makes it: exponents of A less those of B "
        f"are about {visible:+.2f} (visible) and {infrared:+.2f} (infrared); switch off the gamma table of the "
        "projector, or run quadfringe calibrate response"
    )


def _crosstalk_words(sizes: Map, family: Family) -> str:
    least = max(params.STRAY_MIN, 0.25 * family.size)
    order = [i for i in np.argsort(-np.abs(sizes))[:4] if abs(sizes[i]) >= least]
    seen = [
        f"{CHANNELS[family.members[i][0]]} sees {abs(sizes[i]):.1%} {'more' if sizes[i] > 0 else 'less'} of the light "
        f"of {CHANNELS[family.members[i][1]]}"
        for i in order
    ]
    return (
        "the difference beats as the light of one channel in another makes it: in A, "
        f"{', '.join(seen)} than in B; calibrate the crosstalk, or add band-pass filters"
    )
