"""The likeliest cause of a fault of a shot, by a test of each cause.

`before_order` tests what needs no fringe orders, from the data format to the registration of infrared. `after_order`
tests the waves of a decoded shot, for which the phase of red and blue suffices even where orders are wrong.
"""

from __future__ import annotations

import numpy as np

from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import fit_params, params, symptoms
from quadfringe.decoding.blur import blur
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.closures import Closure, closure_of_waves, waves_of
from quadfringe.decoding.fringe_fit import Fit, fit_fringes
from quadfringe.decoding.number_ratios import wrong_numbers
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.registration import registration
from quadfringe.decoding.stages import carrier

__all__ = [
    "after_order",
    "along_rows",
    "before_order",
    "period_fix",
    "too_bright",
    "wrong_bits",
]

# Lit share below which the object may be narrower than a few fringes, whose period is then worth stating. An object of
# 0.1 of the frame spans four fringes of a twelfth of its width. Not measured: it only adds a line to the fix.
FEW_LIT = 0.1
TURN_FIX = "turn the images, or the camera, by 90 degrees, or decode with the joint method (--method joint)"
USUAL_BITS = 8, 12, 14  # of cameras; 10 bits are rare, and a dim shot of 12 bits looks like them


def period_fix(share: float) -> str:
    """Give what to do if an object that fills this share of the image is narrower than a few fringes; else no words."""
    words = (
        "; if the object is narrower than a few fringes, give their period, or the shortest and the longest one, in "
    )
    return words + "camera pixels (period_px, --period-px)" if 0 < share < FEW_LIT else ""


def before_order(shot: AnyShot, plan: Plan, closure: Closure | None) -> Cause | None:
    """Name the likeliest cause that shows without fringe orders; None when no test finds one."""
    bits = wrong_bits(shot)
    tests = (_too_dark(shot, params.DARK), too_bright(shot), registration(shot, plan, closure))
    return next((cause for cause in (bits if bits and bits.fatal else None, *tests) if cause is not None), None)


def after_order(shot: AnyShot, shape: Shape, plan: Plan, closure: Closure | None) -> Cause | None:
    """Name the likeliest cause that shows in the waves of a decoded shot; None when no test finds one."""
    if numbers := wrong_numbers(plan, closure):
        return numbers
    fit = fit_fringes(shot, shape, plan)
    if blurred := blur(shot, fit, plan, closure):
        return blurred
    waves = () if fit is None else (_not_linear(fit), _crosstalk(fit))
    return next((cause for cause in (*waves, wrong_bits(shot), _too_dark(shot, params.DIM)) if cause is not None), None)


def along_rows(shot: AnyShot, plan: Plan) -> Cause | None:
    """Find fringes that run along the rows: each channel has the frequency of its number along the columns.

    The joint method decodes them; the published one looks for fringes along the rows only.
    """
    if plan.decode.method != "published":
        return None
    light = symptoms.linear_light_of(shot, plan)
    row_px, column_px = carrier(np.nan_to_num(light["red"]))
    if row_px < params.ALONG_ROWS * column_px or not np.isfinite(column_px):
        return None
    waves = waves_of({name: np.ascontiguousarray(image.T) for name, image in light.items()}, plan)
    closure = None if waves is None else closure_of_waves(waves, plan)
    # Fringes may run up or down, so that the sign tells nothing.
    if closure is None or max(abs(abs(ratio) - 1) for ratio in (closure.green, closure.infrared)) > params.RATIO_OFF:
        return None
    words = "the images seem to be turned by 90 degrees: fringes run along the rows, one every "
    return Cause("turned images", words + f"{column_px:.1f} px of a column", TURN_FIX)


def wrong_bits(shot: AnyShot) -> Cause | None:
    """Find 16-bit data that hold fewer bits of a camera; fatal where less light does not explain it as well."""
    bits = symptoms.bits_in_use(shot)
    if bits is None:
        return None
    least = "" if bits.exact else "at least "
    usual = bits.held if bits.exact else next(depth for depth in USUAL_BITS if depth >= bits.held)
    words = f"no pixel of the 16-bit images is above {bits.top}: they hold {least}{bits.held} bits and were read as 16"
    words += "" if bits.sure else ", or have at most a quarter of the light"
    fix = f"read them with bits={usual}, on the command line --bits {usual}"
    fix += "" if bits.exact else ", or as many as the camera delivers: a brighter shot may need more than this one"
    fix += "" if bits.sure else "; if it delivers 16 bits, lengthen the exposure or open the aperture"
    return Cause("bits", words, fix, fatal=bits.sure)


def _too_dark(shot: AnyShot, least: float) -> Cause | None:
    top = max(symptoms.brightness(shot).values())
    if top >= least:
        return None
    words = f"the images are too dark: their brightest pixels reach {top:.0%} of full scale"
    return Cause("brightness", words, "lengthen the exposure, open the aperture, or raise the light")


def too_bright(shot: AnyShot) -> Cause | None:
    """Find channels with so many saturated pixels that their light is measured from the others, or not at all."""
    shares = {n: share for n, share in symptoms.saturation(shot).items() if share > params.SATURATED}
    if not shares:
        return None
    words = "too much light: " + ", ".join(f"{share:.0%} of {name}" for name, share in shares.items()) + " is saturated"
    return Cause("saturation", words, "shorten the exposure or lower the light until no crest is saturated")


def _not_linear(fit: Fit) -> Cause | None:
    sure = np.where(fit.harmonic_least > fit_params.SOUND, fit.harmonic, 0)
    value = float(max(sure[0], sure[2]))
    if value < fit_params.HARMONIC:
        return None
    words = f"the light is not linear: the second harmonic of red or blue is {value:.0%} of the first"
    fix = "switch off the gamma table of the projector, or calibrate it: quadfringe calibrate response"
    return Cause("response", words, fix)


def _crosstalk(fit: Fit) -> Cause | None:
    to, of, value, least = fit.worst_stray
    if value < fit_params.STRAY or least < fit_params.SOUND:
        return None
    words = f"channels see one another: {to} sees {value:.0%} of the fringes of {of}"
    return Cause("crosstalk", words, "add band-pass filters, or calibrate crosstalk: quadfringe calibrate, step levels")
