"""Whether a shot may have the black of a stated response: light that is measured cannot be darker than no light.

The offset of a response is the intensity without fringes: the dark level, and the light that projector and room add. A
response that was measured with more light than a shot has takes too much off, so that dark fringes become black.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import Response
from quadfringe.data import AnyShot, Calibration
from quadfringe.decoding import params
from quadfringe.decoding.cause import Cause

__all__ = ["below_black", "too_black", "too_dark"]

Map = NDArray[np.float32]


def below_black(shot: AnyShot, response: Response | Literal["linear"], known: Calibration | None = None) -> float:
    """Give the share of the bright places of a shot where a channel is darker than the black of a response, 0 to 1.

    Pixels are averaged in squares. A channel counts as darker when it lies below black by a good part of it and by more
    than the noise. The dark level comes from the calibration `known`.
    """
    if response == "linear" or not any(offset for offset, *_ in response.rows):
        return 0.0
    black = np.array([offset for offset, *_ in response.rows], np.float32)
    if known is not None and known.dark is not None:
        black += np.array(known.dark, np.float32)
    return _share_below(shot, black)


def too_dark(shot: AnyShot, known: Calibration | None) -> Cause | None:
    """Name a dark level of a calibration that the shot contradicts: light that is measured is not below it."""
    if known is None or known.dark is None or not any(known.dark):
        return None
    share = _share_below(shot, np.array(known.dark, np.float32))
    if share < params.BELOW_SHARE:
        return None
    words = (
        f"{share:.0%} of the bright places have a channel that is darker than the dark level of the calibration, so "
    )
    words += "that its dark fringes are cut off"
    return Cause(
        "calibration dark level", words, "give dark as a fraction of full scale, or measure it again", fatal=False
    )


def _share_below(shot: AnyShot, black: Map) -> float:
    """Give the share of the bright places of a shot where a channel is darker than this black of R, G, B, IR."""
    light = np.stack([_squares(image, shot) for image in shot.channels.values()])
    brightest = light.max(axis=0)
    bright = brightest > params.BRIGHT_SHARE * np.quantile(brightest[:, ::4], params.BRIGHT_QUANTILE)
    black = black[: len(light)]  # no infrared, no black of it
    beyond = np.maximum(params.BELOW_BLACK * black, params.BELOW_NOISES * _noise(shot) / params.SQUARE_PX)
    below = (light < (black - beyond)[:, None, None]).any(axis=0)
    return float(below[bright].mean()) if bright.any() else 0.0


def too_black(share: float) -> Cause | None:
    """Name a response that was measured with other light, from the share of places that are darker than its black."""
    if share < params.BELOW_SHARE:
        return None
    words = f"{share:.0%} of the bright places have a channel that is darker than the black of the response, which was "
    words += "measured with more light; the response was estimated from the shot instead"
    return Cause("response", words, "measure it with this exposure: quadfringe calibrate response", fatal=False)


def _squares(image: NDArray[Any], shot: AnyShot) -> Map:
    """Average an image over squares of SQUARE_PX pixels of the shot, in some rows of them; shares of full scale."""
    import cv2

    rows, columns = (max(size // params.SQUARE_PX, 1) for size in shot.first.shape)
    side = image.shape[0] // rows
    bands = image[: rows * side].reshape(rows, side, -1)[:: params.SQUARE_ROWS].reshape(-1, image.shape[1])
    squares = cv2.resize(bands, (columns, len(bands) // side), interpolation=cv2.INTER_AREA)
    return np.asarray(squares / shot.full_scale_value, np.float32)


def _noise(shot: AnyShot) -> float:
    """Give the standard deviation of the noise of infrared pixels, from differences in which smooth light cancels.

    Without infrared they are those of green.
    """
    image = shot.channels["green"] if shot.ir is None else shot.ir
    rows = image[:: 2 * params.SQUARE_ROWS * params.SQUARE_PX].astype(np.float32) / np.float32(shot.full_scale_value)
    bend = np.diff(rows, n=3, axis=1)
    return float(np.median(np.abs(bend)) / (params.MEDIAN_OF_NORMAL * np.sqrt(20.0)))
