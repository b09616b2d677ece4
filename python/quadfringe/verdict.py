"""Whether a decoded shot can be trusted, and if not, why: black or saturated channels, channels exchanged."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from quadfringe.data import Map, Shape, Shot
from quadfringe.errors import DecodeError

__all__ = ["judge"]

DARK = 0.02  # a channel whose brightest pixels stay below this fraction of full scale is black
NEARLY_NONE = 5e-4  # share of pixels that may differ in a black or saturated channel
STRIDE = 4  # pixels that are looked at, along rows and columns: enough for quantiles, free of cost
RETURNED_MIN = 0.05  # share of modulated pixels that must come back
# Lower quartile of the order margin over modulated pixels. Phases that have nothing to do with one another leave
# 0.13 to the ladder; sound shots leave above 0.6, and 0.2 with an uncorrected response.
COLLAPSED, DOUBTFUL = 0.17, 0.5
CLEARLY_BETTER = 1.2  # ratio of mean margins that tells channels are exchanged

Decode = Callable[[Shot], Shape]


def judge(shape: Shape, shot: Shot, again: Decode | None) -> None:
    """Raise `DecodeError` that names the likely cause unless the orders of `shape` can be trusted.

    `again` decodes the shot with two channels exchanged, to find out which; None leaves that question out.
    """
    blind = _blind_channels(shot)
    if blind:
        raise DecodeError(f"no shape: {'; '.join(blind)}; check exposure, lens cap and light source")
    margin = shape.quality[::STRIDE, ::STRIDE]
    lit = margin[np.isfinite(margin)]
    if not lit.size:
        raise DecodeError("no shape: no pixel carries fringes in all channels; check focus and exposure")
    quartile = float(np.quantile(lit, 0.25))
    if again is not None and quartile < DOUBTFUL:
        _refuse_exchanged(shot, margin, again)
    returned = int(shape.returned.sum())
    if quartile < COLLAPSED or returned < RETURNED_MIN * lit.size * STRIDE**2:
        raise DecodeError(
            f"no shape: the order margin has collapsed: below {quartile:.2f} of 1 for a quarter of the modulated "
            "pixels; the channels may be swapped (red, green, blue, ir), or the fringe numbers, the projector "
            "width or the response are not those of this shot"
        )


def _blind_channels(shot: Shot) -> list[str]:
    """Name the channels that are black or saturated over nearly the whole frame."""
    full, found = shot.full_scale_value, []
    for name, image in shot.channels.items():
        low, high = (float(q) for q in np.quantile(image[::STRIDE, ::STRIDE], (NEARLY_NONE, 1 - NEARLY_NONE)))
        if high < DARK * full:
            found.append(f"channel {name} is black (hardly a pixel is above {high:g} of {full:g})")
        elif low >= full:
            found.append(f"channel {name} is saturated (hardly a pixel is below {full:g})")
    return found


def _refuse_exchanged(shot: Shot, margin: Map, again: Decode) -> None:
    """Raise when exchanging two channels makes the orders clearly surer."""
    found = {pair: _trust(again(_exchanged(shot, *pair)).quality[::STRIDE, ::STRIDE]) for pair in _pairs(shot)}
    best = max(found, key=lambda pair: found[pair])
    if found[best] > CLEARLY_BETTER * _trust(margin):
        raise DecodeError(
            f"no shape: {best[0]} and {best[1]} seem to be swapped: the mean order margin is {_trust(margin):.2f} "
            f"as given and {found[best]:.2f} with the two exchanged"
        )


def _pairs(shot: Shot) -> list[tuple[str, str]]:
    return list(combinations(shot.channels, 2))


def _exchanged(shot: Shot, first: str, second: str) -> Shot:
    images = shot.channels
    images[first], images[second] = images[second], images[first]
    return Shot(images["red"], images["green"], images["blue"], images["ir"], shot.full_scale)


def _trust(margin: Map) -> float:
    """Mean margin; a pixel without light has none."""
    return float(np.nan_to_num(margin).mean())
