"""How sharp the images of a shot are, measured without fringe orders: detail of a few px, and contrast."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import AnyShot
from quadfringe.decoding import params
from quadfringe.decoding.plan import Plan
from quadfringe.decoding.symptoms import linear_light_of

__all__ = ["coarse_contrast", "fine_over_coarse", "sharpness", "steepness"]


def sharpness(shot: AnyShot) -> float:
    """Give the strongest detail of a few px over the noise of the same scale; about 1.4 when there is only noise."""
    fine = (_between(image, 1.5, 3.0) for image in shot.channels.values())
    return float(np.median([float(np.quantile(np.abs(one), 0.995)) / max(_noise(one), 1e-9) for one in fine]))


def steepness(shot: AnyShot) -> float:
    """Give the strongest detail of 1.5 to 3 px over the strongest of 3 to 6 px next to it, median of the channels.

    A sharp edge has 1 at any brightness, one that is blurred by 3 px has half of that. A bright highlight is stronger
    than all noise, and no steeper than its reflection.
    """
    import cv2

    found = []
    for image in shot.channels.values():
        detail, near = (_between(image, *sigmas) for sigmas in ((1.5, 3.0), (3.0, 6.0)))
        fine, near = np.abs(detail), cv2.dilate(np.abs(near), np.ones((13, 13), np.uint8))
        strongest = fine >= np.quantile(fine, 0.995)
        power = float(np.mean(fine[strongest] ** 2)) - _noise(detail) ** 2
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
    found = []
    for image in shot.channels.values():
        fine, coarse = (np.quantile(np.abs(_between(image, *sigmas)), 0.995) for sigmas in ((1.5, 3.0), (6.0, 12.0)))
        found.append(float(fine) / max(float(coarse), 1e-9))
    return float(np.median(found))


def _between(image: NDArray[Any], fine_px: float, coarse_px: float) -> NDArray[np.float32]:
    """Give the detail of an image between two standard deviations of a Gaussian."""
    import cv2

    light = image.astype(np.float32)
    return np.asarray(cv2.GaussianBlur(light, (0, 0), fine_px) - cv2.GaussianBlur(light, (0, 0), coarse_px), np.float32)


def _noise(detail: NDArray[np.float32]) -> float:
    """Give the standard deviation of the noise in detail that covers little of an image, from its median deviation."""
    return 1.4826 * float(np.median(np.abs(detail - np.median(detail))))
