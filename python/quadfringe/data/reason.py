"""`Reason`: why a pixel of a shape has no data."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["Reason"]


class Reason(IntEnum):
    """Why a pixel has no data, as the values of `Shape.reason`; of several, the first in this list.

    >>> Reason(3).words
    'too little light'
    """

    RETURNED = 0
    """The pixel has data."""
    NO_IMAGE = 1
    """One of the two camera chips does not see it."""
    SATURATED = 2
    """A channel is saturated."""
    SHADOW = 3
    """Too little light for the least modulation: a shadow, or a dark surface."""
    LOW_MODULATION = 4
    """Light without fringes: ambient light, defocus, or a surface that scatters light inside."""
    DISCONTINUITY = 5
    """At a step in depth, where the pixel sees two surfaces or the order of one side is wrong."""
    MISFIT = 6
    """The four channels contradict one surface: light from elsewhere, gloss, motion, or a wrong response."""
    DOUBTFUL_ORDER = 7
    """Another fringe order explains the light nearly as well."""
    SMALL_PIECE = 8
    """Part of a strip or piece of surface that is too small to be trusted."""
    MOVED = 9
    """It moved too fast between the exposures of the channels."""
    OUT_OF_RANGE = 10
    """Outside the image of the projector or the stated depths, or the rays do not meet."""

    @property
    def words(self) -> str:
        """A short phrase for people."""
        return _WORDS[self]


_WORDS = {
    Reason.RETURNED: "returned",
    Reason.NO_IMAGE: "not seen by both chips",
    Reason.SATURATED: "saturated",
    Reason.SHADOW: "too little light",
    Reason.LOW_MODULATION: "light without fringes",
    Reason.DISCONTINUITY: "at a step in depth",
    Reason.MISFIT: "channels contradict each other",
    Reason.DOUBTFUL_ORDER: "doubtful fringe order",
    Reason.SMALL_PIECE: "piece too small",
    Reason.MOVED: "moved too fast",
    Reason.OUT_OF_RANGE: "outside the measuring range",
}
