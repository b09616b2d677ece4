"""The response that one shot shows, with how certain it is: standard errors, and the second harmonic that it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import hypot, sqrt
from typing import Any, Literal

from quadfringe import _core
from quadfringe.config import ChannelResponse, Response
from quadfringe.decoding._wrapped import FringeNumbers, Map

__all__ = ["ShotResponse", "shot_response"]

EVIDENCE = ("exponent_sd", "second_harmonic_before", "second_harmonic_after")


@dataclass(frozen=True)
class ShotResponse:
    """The response of the channels, "linear" where a shot shows none, and its evidence by channel.

    `exponent_sd` is the standard error of the exponent, `second_harmonic_before` and `second_harmonic_after` the second
    harmonic of the fringes over the first one, without and with the correction; a change of its sign means that the
    correction went too far.
    """

    response: Response | Literal["linear"] = "linear"
    evidence: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def described(self) -> dict[str, Any]:
        """The evidence, and the phase that it leaves in doubt, for the settings of a shape; empty for linear light."""
        if not self.evidence:
            return {}
        return {"response_evidence": {**self.evidence, "phase_rad": self.phase_rad}}

    @property
    def phase_rad(self) -> float:
        """RMS error of the phase, rad, that the worst channel alone would make.

        Fringes of gamma g have the second harmonic (g - 1) / (g + 2), and two steps a quarter period apart make of a
        harmonic h a phase error of h / sqrt(2). Other channels and neighbouring pixels make it smaller.
        """
        left = 0.0
        for name, figures in self.evidence.items():
            assert isinstance(self.response, Response)
            doubt = figures["exponent_sd"] / getattr(self.response, name).exponent / 3
            left = max(left, hypot(doubt, figures["second_harmonic_after"]) / sqrt(2))
        return left


def shot_response(
    light: Mapping[str, Map],
    phase_rad: Map,
    fringe_numbers: FringeNumbers,
    projector_width_px: int,
    columns_px: tuple[float, float] | None,
) -> ShotResponse:
    """Estimate the response from captured light, (H, W) by channel, and the phase of the first fringe number."""
    channels = (light["red"], light["green"], light["blue"], light.get("ir"))
    found = _core.estimate_response_of_shot(
        *channels, phase_rad, fringe_numbers, projector_width_px, columns_px=columns_px
    )
    numbers = ChannelResponse.model_fields
    responses = {name: ChannelResponse(**{n: figures[n] for n in numbers}) for name, figures in found.items()}
    if not responses:
        return ShotResponse()
    evidence = {name: {n: float(f"{figures[n]:.4g}") for n in EVIDENCE} for name, figures in found.items()}
    return ShotResponse(Response(**responses), evidence)
