"""How sharp the images of a shot are, measured without fringe orders: detail of a few px, and contrast."""

from __future__ import annotations

import numpy as np

from quadfringe.data import AnyShot
from quadfringe.decoding import params
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["coarse_contrast", "fine_over_coarse", "sharpness", "steepness"]


def sharpness(shot: AnyShot) -> float:
    """Give the strongest detail of a few px over the noise of the same scale; about 1.4 when there is only noise."""
    import cv2

    found = []
    for image in shot.channels.values():
        light = image.astype(np.float32)
        detail = cv2.GaussianBlur(light, (0, 0), 1.5) - cv2.GaussianBlur(light, (0, 0), 3.0)
        noise = 1.4826 * float(np.median(np.abs(detail - np.median(detail))))
        found.append(float(np.quantile(np.abs(detail), 0.995)) / max(noise, 1e-9))
    return float(np.median(found))


def steepness(shot: AnyShot) -> float:
    """Give the strongest detail of 1.5 to 3 px over the strongest of 3 to 6 px next to it, median of the channels.

    A sharp edge has 1 at any brightness, one that is blurred by 3 px has half of that. A bright highlight is stronger
    than all noise, and no steeper than its reflection.
    """
    import cv2

    found = []
    for image in shot.channels.values():
        smooth = [cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma) for sigma in (1.5, 3.0, 6.0)]
        fine, near = smooth[0] - smooth[1], cv2.dilate(np.abs(smooth[1] - smooth[2]), np.ones((13, 13), np.uint8))
        noise = 1.4826 * float(np.median(np.abs(fine - np.median(fine))))
        strongest = np.abs(fine) >= np.quantile(np.abs(fine), 0.995)
        power = float(np.mean(fine[strongest] ** 2)) - noise**2
        found.append(np.sqrt(max(power, 0.0) / max(float(np.mean(near[strongest] ** 2)), 1e-9)))
    return float(np.median(found))


def coarse_contrast(shot: AnyShot, plan: Plan) -> float:
    """Give the contrast of whatever is wider than a pixel, median of the channels: at least that of the fringes.

    The product of neighbours leaves out noise.
    """
    import cv2

    found = []
    for light in linear_light_of(shot, plan).values():
        light = np.nan_to_num(light)
        mean = cv2.GaussianBlur(light, (0, 0), params.MEAN_PX)
        lit = mean > params.LIT_SHARE * float(np.quantile(mean[::4, ::4], 0.99))
        wave = np.where(lit, light / np.maximum(mean, 1e-6) - 1, 0)
        both = lit[:, 1:] & lit[:, :-1]
        found.append(float(np.sqrt(max(2 * np.mean((wave[:, 1:] * wave[:, :-1])[both]), 0.0))) if both.any() else 0.0)
    return float(np.median(found))


def fine_over_coarse(shot: AnyShot) -> float:
    """Give the strongest detail of a few px over that of four times the size: 1 for sharp edges, less with blur."""
    import cv2

    found = []
    for image in shot.channels.values():
        smooth = [cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma) for sigma in (1.5, 3.0, 6.0, 12.0)]
        fine, coarse = (np.quantile(np.abs(smooth[i] - smooth[i + 1]), 0.995) for i in (0, 2))
        found.append(float(fine) / max(float(coarse), 1e-9))
    return float(np.median(found))
