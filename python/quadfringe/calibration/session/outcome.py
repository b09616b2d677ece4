"""What a step of the guided calibration gives: its part of the calibration, its record, and what to draw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from quadfringe.data import CalibrationStep

__all__ = ["Outcome", "record"]


@dataclass(frozen=True)
class Outcome:
    """Fields of the `Calibration` that a step gives, its record, and the records that its pictures are drawn from."""

    step: CalibrationStep
    fields: Mapping[str, Any] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict, repr=False)


def record(
    name: str,
    inputs: tuple[str, ...],
    figures: Mapping[str, float],
    problems: list[str],
    good: str,
    settings: Mapping[str, Any] | None = None,
) -> CalibrationStep:
    """Give the record of a step: good with the words for it, or not good with its problems."""
    rounded = {name: float(f"{value:.6g}") for name, value in figures.items()}
    verdict = "; ".join(problems) if problems else good
    return CalibrationStep(
        name=name, inputs=inputs, settings=dict(settings or {}), figures=rounded, good=not problems, verdict=verdict
    )
