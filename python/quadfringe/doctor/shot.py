"""Checks of a shot: exposure, channels, response, crosstalk, fringe orders and coaxial pair."""

from __future__ import annotations

import numpy as np

from quadfringe.config import Response
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.plan import stated_response
from quadfringe.doctor._fringes import Fit, fit_fringes, infrared_drift
from quadfringe.doctor.finding import Finding, graded
from quadfringe.errors import DecodeError

__all__ = ["examine_shot"]

# Limits for a warning and for a fault; pytest tests/test_doctor.py checks them on shots with known defects.
SATURATED = (0.01, 0.2)  # share of pixels
BRIGHTNESS = (0.3, 0.05)  # brightest pixels, share of full scale
CONTRAST = (0.10, 0.04)  # amplitude of the fringes, share of full scale
NOT_LINEAR = (0.04, 0.08)  # ratio of the second harmonic to the first
CROSSTALK = (0.04, 0.15)  # relative amplitude of the fringes of another channel
MARGIN = (0.7, 0.5)  # median order margin, in [0, 1]
RETURNED = (0.8, 0.3)  # share of lit pixels
OFF_MAX = 0.1  # share of the image whose orders are wrong by whole fringes
DRIFT_PX = (1.0, 2.5)  # offset of the infrared fringes from their expected position, projector px


def examine_shot(shot: AnyShot, plan: Plan) -> list[Finding]:
    """Check a shot as `plan` decodes it; a shot that cannot be decoded gives a fault with the cause.

    Raises `InputError` or ValueError when the plan does not suit the shot.
    """
    found = [*_saturation(shot), *_black(shot)]
    try:
        shape = Decoder(shot, plan).decode(shot)
    except DecodeError as error:
        fix = "fix this first; the remaining checks need a shot that decodes"
        return [*found, Finding("fringe orders", "fault", str(error), fix)]
    found += _orders(shape)
    fit = fit_fringes(shot, shape, plan)
    if fit is None:
        words = "too few pixels carry fringes to check response and crosstalk"
        return [*found, Finding("fringes", "warning", words, "fill more of the field with the object")]
    return [*found, *_amplitudes(fit), _linearity(fit, plan), _crosstalk(fit, plan), _drift(shot, shape, plan)]


def _saturation(shot: AnyShot) -> list[Finding]:
    top = 0.998 * shot.full_scale_value
    found = []
    for name, image in shot.channels.items():
        share = float(np.mean(image >= top))
        fix = f"shorten the exposure or lower the {name} light until no crest is saturated; powder shiny parts"
        found.append(graded(f"saturation {name}", share, SATURATED, f"{share:.1%} of the pixels are saturated", fix))
    return found


def _black(shot: AnyShot) -> list[Finding]:
    found = []
    for name, image in shot.channels.items():
        top = float(np.quantile(image[::4, ::4], 0.99)) / shot.full_scale_value
        words = f"the brightest pixels reach {top:.0%} of full scale"
        fix = f"lengthen the exposure, open the aperture, or check that the {name} light is on and its cable connected"
        found.append(graded(f"brightness {name}", top, BRIGHTNESS, words, fix))
    return found


def _orders(shape: Shape) -> list[Finding]:
    quality = shape.quality[np.isfinite(shape.quality)]
    lit = max(int(quality.size), 1)
    margin = float(np.median(quality)) if quality.size else 0.0
    returned = int(shape.returned.sum()) / lit
    return [
        graded(
            "order margin",
            margin,
            MARGIN,
            f"half of the lit pixels have a margin above {margin:.2f} of 1",
            "increase the light (less noise) or the contrast, or calibrate response and crosstalk; each raises the "
            "margin",
        ),
        graded(
            "returned",
            returned,
            RETURNED,
            f"{returned:.1%} of the lit pixels are returned",
            "look at the quality map and light its dark regions: shadows, shiny spots and dark paint are lost first",
        ),
    ]


def _amplitudes(fit: Fit) -> list[Finding]:
    found = []
    for name, amplitude in zip(fit.names, fit.amplitude, strict=True):
        words = f"the fringes have an amplitude of {amplitude:.1%} of full scale"
        fix = f"focus the {name} projector and the camera, darken the room, or increase the {name} light"
        found.append(graded(f"modulation {name}", amplitude, CONTRAST, words, fix))
    return found


def _linearity(fit: Fit, plan: Plan) -> Finding:
    worst = int(np.argmax(fit.harmonic))
    value = float(fit.harmonic[worst])
    words = f"the second harmonic of {fit.names[worst]} is {value:.1%} of the first"
    known = isinstance(stated_response(plan.response, plan.calibration), Response)
    again = "estimate it again" if known else "estimate it"
    fix = f"switch off the gamma table of the projector, or {again}: quadfringe calibrate response"
    return graded("response", value, NOT_LINEAR, words, fix)


def _crosstalk(fit: Fit, plan: Plan) -> Finding:
    stray = np.abs(fit.crosstalk - np.diag(np.diag(fit.crosstalk)))
    to, of = np.unravel_index(int(np.argmax(stray)), stray.shape)
    value = float(stray[to, of])
    words = f"{fit.names[int(to)]} sees {value:.1%} of the fringes of {fit.names[int(of)]}"
    known = plan.calibration is not None and plan.calibration.crosstalk is not None
    fix = "add band-pass filters, or " + ("calibrate it again" if known else "calibrate it") + ": quadfringe calibrate"
    return graded("crosstalk", value, CROSSTALK, words, fix)


def _drift(shot: AnyShot, shape: Shape, plan: Plan) -> Finding:
    drift = infrared_drift(shot, shape, plan)
    if drift is None:
        words = "too few pixels carry fringes to check the coaxial pair"
        return Finding("coaxial pair", "warning", words, "fill more of the field with the object")
    fix = "one projector has moved: calibrate the pair again, and project the pre-deformed infrared pattern"
    words = f"infrared fringes are off by {drift.median_px:+.2f} projector px (median), at most by {drift.worst_px:.2f}"
    if drift.off > OFF_MAX:
        words += f"; the fringe orders are wrong by whole fringes in {drift.off:.0%} of the image"
        return Finding("coaxial pair", "fault", words, fix, drift.worst_px)
    return graded("coaxial pair", drift.worst_px, DRIFT_PX, words, fix)
