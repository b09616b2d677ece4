"""The outcome of a step of the guided calibration: calibration fields, record, and data for its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from quadfringe.data import CalibrationStep

__all__ = ["Outcome", "record", "worse"]


@dataclass(frozen=True)
class Outcome:
    """The record of a step, the `Calibration` fields that it determines, and the data for its picture."""

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
    remarks: Sequence[str] = (),
) -> CalibrationStep:
    """Make the record of a step: good with the text `good`, or not good with its problems; `remarks` follow either."""
    rounded = {name: float(f"{value:.6g}") for name, value in figures.items()}
    verdict = "; ".join([*(problems or [good]), *remarks])
    return CalibrationStep(
        name=name, inputs=inputs, settings=dict(settings or {}), figures=rounded, good=not problems, verdict=verdict
    )


def worse(what: str, before: float, after: float) -> list[str]:
    """Say that a correction made things worse; nothing when it did not.

    >>> worse("crosstalk", 0.2, 0.3)
    ['crosstalk is worse after the correction than before it: leave the correction out']
    >>> worse("crosstalk", 0.3, 0.2)
    []
    """
    return [f"{what} is worse after the correction than before it: leave the correction out"] if after > before else []
