"""Blur: fringes that are weak in every channel, and weaker the finer they are, without sharp detail."""

from __future__ import annotations

import numpy as np

from quadfringe.data import AnyShot
from quadfringe.decoding import detail, params
from quadfringe.decoding.cause import Cause
from quadfringe.decoding.closures import Closure
from quadfringe.decoding.fringe_fit import Fit
from quadfringe.decoding.plan import Plan

__all__ = ["blur", "vanishing"]

FOCUS = "focus the camera and the projectors on the object, close the aperture, and hold the object still"


def blur(shot: AnyShot, fit: Fit | None, plan: Plan, closure: Closure | None) -> Cause | None:
    """Find blur: weak fringes, weaker the finer they are, in images without sharp detail; or fringes that vanish."""
    return _measured_blur(shot, fit, plan, closure) or vanishing(shot, plan)


def vanishing(shot: AnyShot, plan: Plan) -> Cause | None:
    """Find a blur as wide as the fringes, which leaves little of them and no edge of the object sharp."""
    contrast = detail.coarse_contrast(shot, plan)
    if contrast > params.VANISHING_CONTRAST or detail.fine_over_coarse(shot) > params.UNSHARP:
        return None
    words = f"the images are so blurred that the fringes nearly vanish: their contrast is at most {contrast:.0%}, and "
    return Cause("blur", words + "no edge is sharp", FOCUS)


def _measured_blur(shot: AnyShot, fit: Fit | None, plan: Plan, closure: Closure | None) -> Cause | None:
    """Find the blur that the contrasts of fine and coarse fringes show together.

    Without infrared all fringes are about equally fine, and nothing is found.
    """
    if fit is None or closure is None or not plan.fringes.infrared or closure.off >= params.RATIO_STRANGE:
        return None
    ir = float(fit.contrast[3])
    visible = float(fit.contrast[:3].max())  # blur spares no channel, crosstalk does
    if visible > params.BLURRED_CONTRAST or _sharp(shot):
        return None
    coarse_px = closure.infrared_px
    fine_px = coarse_px * plan.fringes.numbers[2] / plan.fringes.numbers[0]
    lost = np.log(max(ir, 1e-3) / max(visible, 1e-3)) / (2 * np.pi**2 * (fine_px**-2 - coarse_px**-2))
    sigma_px = float(np.sqrt(max(lost, 0.0)))
    if sigma_px < params.BLUR_PX:
        return None
    # Full fringes cannot have lost more than this; the ratio is off where wrong orders weaken the infrared waves.
    sigma_px = min(sigma_px, float(np.sqrt(-np.log(max(visible, 1e-3)) / 2)) / np.pi * fine_px)
    words = f"the images are blurred by about {sigma_px:.1f} px: the contrast is {visible:.0%} for the finest fringes "
    return Cause("blur", words + f"and {ir:.0%} for the coarsest, and no detail is sharp", FOCUS)


def _sharp(shot: AnyShot) -> bool:
    """Say whether the images have detail that stands out of the noise and is as steep as a sharp edge."""
    return detail.sharpness(shot) > params.SHARP_MIN and detail.steepness(shot) > params.STEEP_MIN
