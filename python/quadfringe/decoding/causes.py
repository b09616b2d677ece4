"""The likeliest cause of a fault of a shot, by a test of each cause.

`before_order` tests what needs no fringe orders, from the data format to the registration of infrared. `after_order`
tests the waves of a decoded shot, for which the phase of red and blue suffices even where orders are wrong.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from quadfringe import _core
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import fit_params, params, symptoms
from quadfringe.decoding.blur import blur
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.fringe_fit import Fit, fit_fringes
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.stages import carrier
from quadfringe.decoding.symptoms import Closure

__all__ = [
    "NUMBERS_FIX",
    "after_order",
    "along_rows",
    "before_order",
    "channels_fit",
    "family",
    "listed",
    "other_numbers",
    "period_fix",
    "registration",
    "strange",
    "too_bright",
    "wrong_bits",
    "wrong_numbers",
    "wrong_order_rad",
]

FringeNumbers = tuple[float, ...]
# Lit share below which the object may be narrower than a few fringes, whose period is then worth stating. An object of
# 0.1 of the frame spans four fringes of a twelfth of its width. Not measured: it only adds a line to the fix.
FEW_LIT = 0.1
NUMBERS_FIX = "give the numbers that were projected (--fringes), or project these"
TURN_FIX = "turn the images, or the camera, by 90 degrees, or decode with the joint method (--method joint)"
SMALLEST_ROOT, LARGEST_ROOT = 4, 12  # 16, 15, 12 and 144, 143, 132: coarser or finer fringes measure nothing
SMALLEST_PAIR, LARGEST_PAIR = 6, 20  # N, N - 1 without infrared: finer fringes look alike after one of them


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
    waves = symptoms.waves_of({name: np.ascontiguousarray(image.T) for name, image in light.items()}, plan)
    closure = None if waves is None else symptoms.closure_of_waves(waves, plan)
    # Fringes may run up or down, so that the sign tells nothing.
    if closure is None or max(abs(abs(ratio) - 1) for ratio in (closure.green, closure.infrared)) > params.RATIO_OFF:
        return None
    words = "the images seem to be turned by 90 degrees: fringes run along the rows, one every "
    return Cause("turned images", words + f"{column_px:.1f} px of a column", TURN_FIX)


def channels_fit(closure: Closure | None) -> bool:
    """Say whether every channel has the frequency of its fringe number, and red and blue are in order."""
    return closure is not None and closure.angle.agreement > params.AGREEMENT_MIN and closure.off < params.RATIO_OFF


def strange(closure: Closure | None) -> bool:
    """Say whether a channel has a frequency that no other fringe numbers explain, as an exchanged one has."""
    return closure is not None and closure.off >= params.RATIO_STRANGE


def wrong_bits(shot: AnyShot) -> Cause | None:
    """Find 16-bit data that hold fewer bits of a camera; fatal where less light does not explain it as well."""
    bits = symptoms.bits_in_use(shot)
    if bits is None:
        return None
    words = f"no pixel of the 16-bit images is above {bits.top}: they hold {bits.held} bits and were read as 16"
    words += "" if bits.sure else ", or have at most a quarter of the light"
    fix = f"read them with bits={bits.held}, on the command line --bits {bits.held}"
    fix += "" if bits.sure else "; if the camera delivers 16 bits, lengthen the exposure or open the aperture"
    return Cause("bits", words, fix, fatal=bits.sure)


def registration(shot: AnyShot, plan: Plan, closure: Closure | None) -> Cause | None:
    """Find an infrared image that is shifted from the visible one, and the shift that mends it.

    It is fatal from half the angle of a wrong order on: then orders are wrong, or nearly so. A shift along y leaves
    upright fringes where they are, and does harm at edges only.
    """
    if closure is None or not plan.fringes.infrared or not channels_fit(closure):
        return None
    turned = abs(closure.angle.rad) > params.CLOSURE_RAD and closure.angle.steady > params.STEADY_MIN
    columns = closure.shift_px if turned else 0.0
    rows = symptoms.rows_match(shot, plan, columns)
    fatal = turned and abs(closure.angle.rad) > 0.5 * wrong_order_rad(plan.fringes.numbers)
    if turned and rows is not None and rows.still > rows.moved + params.CORRELATION_MORE:
        return replace(_pair_moved(columns), fatal=fatal)
    if turned or (rows is not None and abs(rows.shift_px) > params.SHIFT_MIN_PX):
        shift_px = None if rows is None or rows.moved < params.CORRELATION_MIN else rows.shift_px
        return replace(_shifted(columns if turned else None, shift_px), fatal=fatal)
    return None


def wrong_order_rad(numbers: FringeNumbers) -> float:
    """Give the angle by which a wrong order puts the fringes of the third channel off."""
    return 2 * np.pi * (numbers[0] - numbers[2]) / numbers[0]


def _shifted(columns: float | None, rows: float | None) -> Cause:
    shifts = {"x": columns, "y": rows}
    mend = " and ".join(f"{-shift:+.1f} px along {axis}" for axis, shift in shifts.items() if shift is not None)
    words = f"the infrared image does not lie on the visible one: a shift of {mend} would mend it"
    words += "" if rows is not None else " (up to whole fringes; the scene has no edges that show a shift along y)"
    words += "" if columns is not None else "; along y, fringes do not shift, and only edges of the object suffer"
    return Cause(
        "infrared registration",
        words,
        "register the chips: quadfringe calibrate run with its step registration, and decode with that calibration; if "
        "edges lie at the same place in all channels, the infrared projector has moved: calibrate the pair again",
    )


def _pair_moved(columns: float) -> Cause:
    words = f"infrared fringes lie {columns:+.1f} px away from the visible ones, and the edges of the images agree: "
    words += "the infrared projector has moved"
    fix = "calibrate the pair again, and project the pre-deformed infrared pattern (--predeformed-z-mm)"
    return Cause("infrared projector", words, fix)


def wrong_numbers(plan: Plan, closure: Closure | None) -> Cause | None:
    """Find fringes whose ratios are not those of the fringe numbers, and the numbers that fit."""
    if closure is None or closure.angle.agreement < params.AGREEMENT_MIN:
        return None
    if not params.RATIO_OFF < closure.off < params.RATIO_STRANGE:
        return None
    first, second, *others = plan.fringes.numbers
    words = f"the fringe numbers {listed(plan.fringes.numbers)} are not those of this shot: for {first:g} fringes of "
    seen, last = ("red and blue", "infrared") if plan.fringes.quadrature else ("red", "blue")
    words += f"{seen} it has {closure.green * second:.2f} of green"
    words += "".join(f" and {closure.infrared * third:.2f} of {last}" for third in others)
    if not others:
        return Cause("fringe numbers", words, NUMBERS_FIX)
    root = _root(plan, closure)
    fits = f", which fits {listed(family(round(root)))}" if abs(root - round(root)) < 0.25 else ""
    return Cause("fringe numbers", words + fits, NUMBERS_FIX)


def other_numbers(plan: Plan, closure: Closure) -> list[FringeNumbers]:
    """Give the numbers n, n - 1, n - k of k^2 = n next to the ratio of infrared to red, without those of the plan.

    With two numbers, give n, n - 1 next to the ratio of green to red.
    """
    first, second, *others = plan.fringes.numbers
    if not others:
        whole = round(1 / max(1 - closure.green * second / first, 1e-3))
        pairs = [(float(n), float(n - 1)) for n in (whole - 1, whole, whole + 1) if SMALLEST_PAIR <= n <= LARGEST_PAIR]
        return [numbers for numbers in pairs if numbers != plan.fringes.numbers and _covers(numbers, plan)]
    root = _root(plan, closure)
    families = [family(whole) for whole in {int(root), int(root) + 1} if SMALLEST_ROOT <= whole <= LARGEST_ROOT]
    return [numbers for numbers in families if numbers != plan.fringes.numbers and _covers(numbers, plan)]


def _root(plan: Plan, closure: Closure) -> float:
    """Give the k of n, n - 1, n - k with n = k^2, for which the third has this frequency relative to red."""
    return 1 / max(1 - closure.infrared * plan.fringes.numbers[2] / plan.fringes.numbers[0], 1e-3)


def family(root: int) -> FringeNumbers:
    """Give the numbers n, n - 1, n - k of k^2 = n."""
    return float(root**2), float(root**2 - 1), float(root**2 - root)


def _covers(numbers: FringeNumbers, plan: Plan) -> bool:
    """Say whether these numbers distinguish the columns of the projector."""
    try:
        _core.check_code(numbers, plan.projector_width_px, columns_px=plan.fringes.columns_px)
    except ValueError:
        return False
    return True


def listed(numbers: FringeNumbers) -> str:
    """Write fringe numbers."""
    return ", ".join(f"{number:g}" for number in numbers)


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
