"""Checks of a shot: exposure, channels, response, crosstalk, fringe orders and coaxial pair."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np

from quadfringe.config import Response
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding import Decoder, Plan, fit_params
from quadfringe.decoding.blur import blur
from quadfringe.decoding.causes import wrong_bits
from quadfringe.decoding.channel_offsets import contradiction, decoded_closure
from quadfringe.decoding.closures import closure_of
from quadfringe.decoding.fringe_fit import Fit, fit_fringes
from quadfringe.decoding.light_border import BY_HAND, borders_of
from quadfringe.decoding.pair_drift import infrared_drift
from quadfringe.decoding.plan import stated_response
from quadfringe.decoding.plausibility import geometry_of, implausible
from quadfringe.decoding.registration import registration
from quadfringe.decoding.symptoms import brightness, saturation
from quadfringe.doctor.finding import Finding, graded, told
from quadfringe.errors import DecodeError, DecodeWarning

__all__ = ["examine_shot", "judged_linearity"]

# From cause to effect: what is named earlier brings about what follows. Wrong bits make an image dark, clipped crests
# have harmonics, and blur lets one channel seem to see another.
ROOTS = (
    *(
        "bits",
        "same image",
        "blind channel",
        "saturation",
        "brightness",
        "calibration units",
        "mirrored or rotated",
        "fringe orders",
    ),
    *("fringe numbers", "infrared registration", "infrared projector", "blur", "calibration", "depth range"),
    *("response", "crosstalk", "coaxial pair", "modulation", "order margin", "returned"),
)
GRADES = ("fault", "warning", "note", "good")
# Limits for a warning and for a fault; pytest tests/test_doctor.py checks them on shots with known defects.
# Share of pixels. A smaller share warns of glints, which cost a pixel where they are and nothing else.
SATURATED = (0.05, 0.2)
BRIGHTNESS = (0.25, 0.05)  # brightest pixels, share of full scale; a larger share warns of dark paint
CONTRAST = (0.10, 0.04)  # amplitude of the fringes, share of full scale
FULL_CONTRAST = 0.5  # amplitude over mean light, from which a weak amplitude comes from a dark object
NOT_LINEAR = (0.04, 0.08)  # ratio of the second harmonic to the first
CROSSTALK = (0.04, 0.15)  # relative amplitude of the fringes of another channel
MARGIN = (0.7, 0.5)  # median order margin, in [0, 1]
RETURNED = (0.8, 0.3)  # share of lit pixels
OFF_MAX = 0.1  # share of the image whose orders are wrong by whole fringes
DRIFT_PX = (1.0, 2.5)  # offset of the infrared fringes from their expected position, projector px


def examine_shot(shot: AnyShot, plan: Plan) -> list[Finding]:
    """Check a shot as `plan` decodes it; a shot that cannot be decoded gives a fault with the likeliest cause.

    Faults come first, then warnings; among either the likeliest cause comes first, because it explains what follows.
    Raises `InputError` or ValueError when the plan does not suit the shot.
    """
    found = [*_bits(shot), *_saturation(shot), *_black(shot)]
    try:
        with warnings.catch_warnings():  # told as findings
            warnings.simplefilter("ignore", DecodeWarning)
            shape = Decoder(shot, plan).decode(shot)
    except DecodeError as error:
        refused = Finding(error.reason or "fringe orders", "fault", str(error), error.fix)
        return [refused, *sorted((one for one in found if one.name != refused.name), key=_rank)]
    found += [*_geometry(shape, plan), *_orders(shape), *_waves(shot, shape, plan)]
    return sorted(found, key=_rank)


def _rank(one: Finding) -> tuple[int, int]:
    """Place a finding by its grade, and then by its place in the chain of causes."""
    root = next((i for i, name in enumerate(ROOTS) if one.name.startswith(name)), len(ROOTS))
    return GRADES.index(one.grade), root


def _waves(shot: AnyShot, shape: Shape, plan: Plan) -> list[Finding]:
    """Check the fringes of a decoded shot, channel by channel and against one another."""
    closure = closure_of(shot, plan, np.isfinite(shape.quality))
    fit = fit_fringes(shot, shape, plan)
    moved = contradiction(shape, shot, plan)
    if moved is None:
        pure = fit is None or fit.worst_stray.least <= fit_params.SOUND
        moved = registration(shot, plan, decoded_closure(closure, shape, shot, plan), pure=pure)
    named = [moved, blur(shot, fit, plan, closure)]
    if fit is None:
        words = "too few pixels carry fringes to check response and crosstalk"
        few = Finding("fringes", "warning", words, "fill more of the field with the object")
        return [few, *told(named)]
    return [
        *told(named),
        *_amplitudes(fit, brightness(shot)),
        _linearity(fit, plan),
        _crosstalk(fit, plan),
        *([_drift(shot, shape, plan, fit)] if plan.fringes.infrared else []),
    ]


def _bits(shot: AnyShot) -> list[Finding]:
    return told([wrong_bits(shot)])


def _geometry(shape: Shape, plan: Plan) -> list[Finding]:
    """Check a shape against its calibration; say what a calibration cannot show."""
    if doubts := told(implausible(shape, borders_of(shape))):
        return doubts
    measured = geometry_of(shape)
    if measured is None:
        return []
    words = "points lie inside the image of the projector"
    if plan.fringes.quadrature:
        words = f"columns run as the calibration demands, and {words}"
    else:
        words += (
            ". Three colours of different fringe numbers do not show mirrored images: check a mark at the left edge"
        )
    seen = Finding("geometry", "good", words, value=measured.backwards)
    if shape.geometry.startswith("rows checked"):
        return [seen, Finding("geometry along y", "good", shape.geometry)]
    return [seen, Finding("geometry along y", "note", shape.geometry, BY_HAND)]


def _saturation(shot: AnyShot) -> list[Finding]:
    found = []
    for name, share in saturation(shot).items():
        fix = f"shorten the exposure or lower the {name} light until no crest is saturated; powder shiny parts"
        found.append(graded(f"saturation {name}", share, SATURATED, f"{share:.1%} of the pixels are saturated", fix))
    return found


def _black(shot: AnyShot) -> list[Finding]:
    found = []
    for name, top in brightness(shot).items():
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


def _amplitudes(fit: Fit, tops: Mapping[str, float]) -> list[Finding]:
    """Grade the fringes; a dark object under good light has weak fringes of full contrast, and no light is missing."""
    found = []
    for name, amplitude, contrast in zip(fit.names, fit.amplitude, fit.contrast, strict=True):
        words = f"the fringes have an amplitude of {amplitude:.1%} of full scale"
        fix = f"focus the {name} projector and the camera, darken the room, or increase the {name} light"
        dark_object = contrast >= FULL_CONTRAST and tops[name] >= BRIGHTNESS[0] and amplitude >= CONTRAST[1]
        one = graded(f"modulation {name}", float(amplitude), CONTRAST, words, fix)
        found.append(Finding(one.name, "good", words, value=one.value) if dark_object else one)
    return found


def _linearity(fit: Fit, plan: Plan) -> Finding:
    sure = fit.harmonic_least > fit_params.SOUND
    worst = int(np.argmax(np.where(sure, fit.harmonic, 0) if sure.any() else fit.harmonic))
    found = judged_linearity("response", fit.names[worst], float(fit.harmonic[worst]), plan)
    return _if_sure(found, float(fit.harmonic_least[worst]))


def judged_linearity(name: str, channel: str, harmonic: float, plan: Plan) -> Finding:
    """Judge the ratio of the second harmonic of the fringes of a channel to the first, as the finding `name`."""
    words = f"the second harmonic of {channel} is {harmonic:.1%} of the first"
    known = isinstance(stated_response(plan.response, plan.calibration), Response)
    again = "estimate it again" if known else "estimate it"
    fix = f"switch off the gamma table of the projector, or {again}: quadfringe calibrate response"
    return graded(name, harmonic, NOT_LINEAR, words, fix)


def _crosstalk(fit: Fit, plan: Plan) -> Finding:
    to, of, value, least = fit.worst_stray
    words = f"{to} sees {value:.1%} of the fringes of {of}"
    known = plan.calibration is not None and plan.calibration.crosstalk is not None
    fix = "add band-pass filters, or " + ("calibrate it again" if known else "calibrate it") + ": quadfringe calibrate"
    return _if_sure(graded("crosstalk", value, CROSSTALK, words, fix), least)


def _if_sure(one: Finding, least: float) -> Finding:
    """Give a finding if the least that its value may be is more than sound shots have; else a note."""
    if one.grade == "good" or least > fit_params.SOUND:
        return one
    words = "cannot be measured: the object is too narrow, or its print too strong"
    return Finding(one.name, "note", words, "fill more of the field with an object of one colour", one.value)


def _drift(shot: AnyShot, shape: Shape, plan: Plan, fit: Fit) -> Finding:
    drift = infrared_drift(shot, shape, plan, fit)
    if drift is None:
        words = "too few pixels carry fringes to check the coaxial pair"
        return Finding("coaxial pair", "warning", words, "fill more of the field with the object")
    fix = "one projector has moved: calibrate the pair again, and project the pre-deformed infrared pattern"
    words = (
        f"infrared fringes are off by {drift.median_px:+.2f} projector px (median), by at most {drift.worst_px:.2f} "
    )
    words += "in three quarters of the image"
    if drift.off > OFF_MAX:
        words += f"; the fringe orders are wrong by whole fringes in {drift.off:.0%} of the image"
        return Finding("coaxial pair", "fault", words, fix, drift.worst_px)
    return graded("coaxial pair", drift.worst_px, DRIFT_PX, words, fix)
