"""The findings of the doctor, one for each check, including the good ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from quadfringe.decoding.cause import Cause

__all__ = ["Finding", "Grade", "graded", "told"]

Grade = Literal["good", "note", "warning", "fault"]


@dataclass(frozen=True)
class Finding:
    """The result of one check: its name, grade, what was found, and the fix, which is empty for a good grade.

    A note says what the shot cannot show, or not before another fault is mended, and what to do. It is no sign of a
    fault.
    """

    name: str
    grade: Grade
    found: str
    fix: str = ""
    value: float | None = None


def graded(name: str, value: float, limits: tuple[float, float], found: str, fix: str) -> Finding:
    """Grade a value by its limits for a warning and for a fault; decreasing limits are lower bounds.

    >>> from quadfringe.doctor.finding import graded
    >>> graded("saturation", 0.02, (0.01, 0.1), "2 % of the pixels", "shorten the exposure").grade
    'warning'
    """
    warning, fault = limits
    sign = 1 if fault > warning else -1
    beyond = [sign * value > sign * limit for limit in (warning, fault)]
    grade: Grade = "fault" if beyond[1] else "warning" if beyond[0] else "good"
    return Finding(name, grade, found, "" if grade == "good" else fix, value)


def told(causes: Iterable[Cause | None]) -> list[Finding]:
    """Give the causes that a test found as findings: a fault when the shape cannot be trusted, else a warning."""
    return [
        Finding(cause.name, "fault" if cause.fatal else "warning", cause.found, cause.fix) for cause in causes if cause
    ]
