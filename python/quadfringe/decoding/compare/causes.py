"""The causes of a difference, each named from separate evidence; a sound pair has none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shape
from quadfringe.decoding.compare import params
from quadfringe.decoding.compare.deviations import Deviations
from quadfringe.decoding.compare.forms import blur_of, fit_form, share_explained
from quadfringe.decoding.compare.pixels import Pair, combined_uncertainty, slopes, uncertainty_of
from quadfringe.decoding.compare.results import Explanation
from quadfringe.decoding.compare.waves import waves_of

__all__ = ["causes_of"]

Map = NDArray[np.float64]
Mask = NDArray[np.bool_]


def causes_of(pair: Pair, overall: Deviations) -> tuple[Explanation, ...]:
    """Name the causes of the difference of a pair, the largest share first."""
    orders = _wrong_orders(pair)
    right = pair.right
    if int(right.sum()) < params.PIXELS_MIN:
        return tuple(one for one in (orders,) if one)
    difference_px = np.where(right, pair.column_a_px - pair.column_b_px, np.nan)
    waves = waves_of(pair, difference_px)
    rest = difference_px - waves.explained_px
    form, form_px = _form(pair, difference_px, rest, overall)
    lost = _lost_modulation(pair, difference_px, rest - form_px, alone=not waves.found)
    found = [one for one in (orders, *waves.found, form, lost) if one is not None]
    return tuple(sorted(found, key=lambda one: -one.share))


def _wrong_orders(pair: Pair) -> Explanation | None:
    """Name wrong orders, which displace by whole fringes, or surfaces that differ by anything else as much."""
    counted = pair.counted
    wrong = counted & pair.wrong_order
    count, whole = int(wrong.sum()), max(1, int(counted.sum()))
    difference = (pair.column_a_px - pair.column_b_px)[counted]
    total = float(np.sum(difference**2))
    if 100 * count / whole < params.WRONG_PERCENT or total == 0:
        return None
    share = float(np.sum(difference[wrong[counted]] ** 2)) / total
    if share < params.WRONG_SHARE:
        return None
    fringes = difference[wrong[counted]] / pair.period_px
    usual = float(np.median(np.abs(fringes)))
    words = f"{100 * count / whole:.2g} % of the pixels are off by half a fringe or more"
    if float(np.median(np.abs(fringes - np.round(fringes)))) > params.WHOLE_OFF:
        fix = "the object was moved, or is another one; place it again, or align them"
        return Explanation("another surface", f"{words}, but not by whole fringes: {fix}", share, count)
    words += f", by {usual:.3g} fringes (median)"
    return Explanation("wrong orders", f"{words}: more light or contrast raises the margin of the order", share, count)


def _form(pair: Pair, difference_px: Map, rest_px: Map, overall: Deviations) -> tuple[Explanation | None, Map | float]:
    """Name a smooth difference; also give the form, px, or 0 when it is not named."""
    known = np.isfinite(rest_px)
    fitted = fit_form(rest_px)
    # What the waves are taken to be has a form as well: the rest may show one that the difference does not have.
    alone = share_explained(difference_px, fit_form(difference_px).form)
    share = min(alone, share_explained(difference_px, fitted.form, rest_px))
    size_px = float(np.sqrt(np.mean(fitted.form[known] ** 2)))
    sigma = combined_uncertainty(pair, "rad")
    typical = float(np.nanmedian(sigma[known])) * pair.period_px / (2 * np.pi) if sigma is not None else 0.0
    if share < params.FORM_SHARE or size_px < params.FORM_SIGMAS * typical:
        return None, 0.0
    c = fitted.coefficients
    scale = overall.bias / np.median(difference_px[known]) if np.median(difference_px[known]) else 1.0
    unit, factor = ("mm", scale) if overall.unit == "mm" and 0 < abs(scale) < 1e3 else ("columns", 1.0)
    tilt, bow = 2 * float(np.hypot(c[1], c[2])), float(np.abs(c[3:]).max())
    words = (
        f"the difference is smooth over the image: about {factor * c[0]:+.3g} {unit} in the middle, "
        f"{abs(factor) * tilt:.3g} {unit} of tilt across it and {abs(factor) * bow:.3g} {unit} of bow; "
    )
    other = isinstance(pair.b, Shape) and pair.a.calibration != pair.b.calibration
    words += (
        "the calibrations differ" if other else "the object or a part of the bench moved, or the calibration is off"
    )
    return Explanation("calibration or pose", words, share, size_px * abs(factor)), fitted.form


def _lost_modulation(pair: Pair, difference_px: Map, rest_px: Map, *, alone: bool) -> Explanation | None:
    """Name defocus, or less light, when one shape has less modulation and the errors that go with it."""
    if not isinstance(pair.b, Shape):
        return None
    with np.errstate(invalid="ignore", divide="ignore"):
        loss = np.log(pair.b.modulation.astype(np.float64) / pair.a.modulation)
    frequency = np.hypot(*slopes(pair.column_b_px)) / pair.period_px
    known = np.isfinite(rest_px) & np.isfinite(loss) & (frequency > 0)
    level = float(np.median(loss[known])) if int(known.sum()) >= params.PIXELS_MIN else 0.0
    name, strong = ("A", pair.b) if level > 0 else ("B", pair.a)
    loss, level = (loss, level) if level > 0 else (-loss, -level)
    if level < params.LOSS_MIN:
        return None
    blur_px2 = blur_of(loss[known], frequency[known])
    whole_px2 = level / (2 * np.pi**2 * float(np.median(frequency[known])) ** 2)
    fall = f"the fringes of {name} have {100 * (1 - np.exp(-level)):.0f} % less modulation"
    total, left = _middle(difference_px[known]), _middle(rest_px[known])
    added = left * (1 - np.exp(-2 * level)) / total if total > 0 else 0.0  # noise is inverse to the modulation
    if blur_px2 >= max(params.BLUR_PX2, params.BLUR_AGREES * whole_px2):
        # Blur also moves the phase where the surface bends: unless faults of the light are at work, what is left beyond
        # the noise comes with it.
        beyond = (left - _expected_px2(strong, pair.period_px, known)) / total if alone and total > 0 else 0.0
        words = f"{fall}, the more so the finer they are: a blur of about {whole_px2**0.5:.1f} px; focus camera and"
        found = Explanation("defocus", f"{words} projector", max(added, beyond), float(whole_px2**0.5))
    else:
        words = f"{fall}, fine and coarse ones alike: less light, or ambient light; lengthen the exposure or darken the"
        found = Explanation("less light", f"{words} room", float(added), level)
    return found if found.share >= params.LOSS_SHARE else None


def _expected_px2(strong: Shape, period_px: float, known: Mask) -> float:
    """Give the mean square that two shapes as good as the stronger one would differ by, px2."""
    sigma = uncertainty_of(strong, "rad", period_px)
    if sigma is None:
        return float("inf")
    return 2 * float(np.nanmedian((sigma[known] * period_px / (2 * np.pi)) ** 2))


def _middle(values: Map) -> float:
    """Give the mean square without the largest hundredth."""
    squares = np.sort(values**2)
    return float(squares[: max(1, int(0.99 * squares.size))].mean())
