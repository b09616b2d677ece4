"""Compare stated probabilities of a wrong order with the true share of wrong orders, over many shapes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from quadfringe.data import Shape
from quadfringe.evaluation.world.scenes import Take

BOUNDS = (0.0, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)


class Doubts:
    """Counts of returned pixels and of wrong orders among them, by the probability that the decoder stated."""

    def __init__(self) -> None:
        size = len(BOUNDS) - 1
        self.pixels, self.wrong, self.stated = np.zeros(size, np.int64), np.zeros(size, np.int64), np.zeros(size)

    def add(self, shape: Shape, take: Take) -> None:
        """Count the pixels of a shape that `Take.counted` marks."""
        assert shape.wrong_order_probability is not None
        used = shape.returned & take.counted
        stated = shape.wrong_order_probability[used].astype(np.float64)
        wrong = np.abs(shape.phase_rad[used] - take.phase_rad[used]) >= np.pi
        bins = np.clip(np.searchsorted(BOUNDS, stated, side="right") - 1, 0, len(self.pixels) - 1)
        self.pixels += np.bincount(bins, minlength=len(self.pixels))
        self.wrong += np.bincount(bins[wrong], minlength=len(self.pixels))
        self.stated += np.bincount(bins, stated, len(self.pixels))

    def rows(self) -> list[tuple[str, int, float, float]]:
        """Give for every range of stated probability: its name, the pixels, the mean stated and the true share."""
        names = [f"{low:g} to {high:g}" for low, high in pairwise(BOUNDS)]
        count = np.maximum(self.pixels, 1)
        stated, true = (self.stated / count).tolist(), (self.wrong / count).tolist()
        return list(zip(names, self.pixels.tolist(), stated, true, strict=True))
