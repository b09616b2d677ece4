"""The results: `ShapeComparison` pixel by pixel, `MeshComparison` against a surface, and `Explanation` for a cause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from quadfringe.decoding.compare.deviations import Bands, Deviations
from quadfringe.decoding.compare.profiles import Profile

__all__ = ["Explanation", "MeshComparison", "ShapeComparison"]

Map = NDArray[np.float32]


@dataclass(frozen=True)
class Explanation:
    """A cause of a difference: its name, the evidence in words, and its share of the mean squared difference, 0 to 1.

    `size` is how strong the fault is, in the unit that `evidence` names: a difference of exponents (gamma), a share of
    the light of another channel (crosstalk), px (defocus), pixels (wrong orders, another surface), the RMS of the
    smooth part otherwise.
    """

    name: str
    evidence: str
    share: float
    size: float


@dataclass(frozen=True, repr=False)
class ShapeComparison:
    """Shape A less B, pixel by pixel, over the pixels away from edges.

    difference_mm: difference of depth, A less B, (H, W) float32, mm, positive where A is farther from the camera; NaN
    where one of them has no depth, and None when one holds phase only. difference_rad: the same of the phase, rad.
    wrong_order: True where the columns of the projector differ by half a fringe or more, or where A returns what
    the truth knows as dark, (H, W).
    edge: True near steps of half a fringe or more, whose pixels mix two sides; they are in no figure, (H, W).
    overall: figures in mm, or in rad without depths, of all pixels that both return. right: of those with one order.
    bands: slow and fast part of `right`. profiles: bias of `right` over modulation, angle and so on, by name.
    returned_percent: share of the pixels that B returns (the truth: lights) that A returns too.
    Edges count in all shares.
    both_percent, only_a_percent, only_b_percent: shares of the pixels that one of them returns.
    wrong_order_percent: share of `wrong_order` among the pixels that both return (the truth: that A returns).
    causes: the likeliest first; empty when nothing stands out, or when they were not asked for.
    warnings: what makes the comparison doubtful, in words.
    """

    difference_mm: Map | None
    difference_rad: Map
    wrong_order: NDArray[np.bool_]
    edge: NDArray[np.bool_]
    overall: Deviations
    right: Deviations
    bands: Bands
    returned_percent: float
    both_percent: float
    only_a_percent: float
    only_b_percent: float
    wrong_order_percent: float
    profiles: Mapping[str, Profile] = field(default_factory=dict)
    causes: tuple[Explanation, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def difference(self) -> Map:
        """The difference in the unit of the figures, (H, W): mm, or rad without depths."""
        return self.difference_rad if self.difference_mm is None else self.difference_mm

    def __repr__(self) -> str:
        return f"ShapeComparison({_words(self.overall)}, {_more(self)}, causes {_names(self.causes)})"

    def figures(self) -> dict[str, float]:
        """Give the key figures by name with unit; those that begin with `right` leave wrong orders out."""
        unit = self.overall.unit
        names = ("returned_percent", "both_percent", "only_a_percent", "only_b_percent", "wrong_order_percent")
        return (
            self.overall.figures()
            | {f"right_{name}": value for name, value in self.right.figures().items()}
            | {f"form_rms_{unit}": self.bands.form_rms, f"noise_rms_{unit}": self.bands.noise_rms}
            | {name: getattr(self, name) for name in names}
        )


@dataclass(frozen=True, repr=False)
class MeshComparison:
    """Distances of the points of a shape from a surface.

    distance_mm: signed distance from the closest point of the surface, (H, W) float32, mm; positive on the side of the
    camera, where there is too much material. NaN for no data and for points farther than the reach.
    overall: its figures. bands: its slow and fast part. profiles: its bias over modulation, angle and so on.
    matched_percent: share of the points that lie within the reach of the surface.
    transform: the rigid motion that was applied to the points, (4, 4), mm, T_surface_camera; the identity without
    `align`. causes: as of `ShapeComparison`, only those that need no second shape.
    """

    distance_mm: Map
    overall: Deviations
    bands: Bands
    matched_percent: float
    transform: NDArray[np.float64]
    profiles: Mapping[str, Profile] = field(default_factory=dict)
    causes: tuple[Explanation, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def difference(self) -> Map:
        """The distance, by the name that it has in `ShapeComparison`."""
        return self.distance_mm

    def __repr__(self) -> str:
        return f"MeshComparison({_words(self.overall)}, {self.matched_percent:.1f} % matched)"

    def figures(self) -> dict[str, float]:
        """Give the key figures by name with unit."""
        bands = {"form_rms_mm": self.bands.form_rms, "noise_rms_mm": self.bands.noise_rms}
        return self.overall.figures() | bands | {"matched_percent": self.matched_percent}


def _words(found: Deviations) -> str:
    return f"bias {found.bias:+.4g} {found.unit}, RMS {found.rms:.4g} {found.unit}"


def _more(found: ShapeComparison) -> str:
    return f"both return {found.both_percent:.1f} %, wrong orders {found.wrong_order_percent:.3g} %"


def _names(causes: tuple[Explanation, ...]) -> str:
    return ", ".join(cause.name for cause in causes) or "none"
