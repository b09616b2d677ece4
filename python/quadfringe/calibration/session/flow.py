"""From the captures of a session to one calibration: the steps in order, each reported in plain words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from quadfringe import _core
from quadfringe.calibration.session import geometry, light
from quadfringe.calibration.session.captures import Captures
from quadfringe.calibration.session.outcome import Outcome
from quadfringe.calibration.session.settings import STEPS, Step
from quadfringe.data import Calibration, CalibrationRecord
from quadfringe.devices.region import region_step

__all__ = ["Guided", "guide"]

LISTED = 6  # missing captures that are listed by name; the others are counted


@dataclass(frozen=True)
class Guided:
    """The result of a guided calibration: the outcome of every step, and the missing captures by step.

    `calibration` is None when a needed step lacks captures.
    """

    calibration: Calibration | None
    outcomes: tuple[Outcome, ...]
    missing: Mapping[str, tuple[str, ...]]

    @property
    def good(self) -> bool:
        """Whether there is a calibration and every completed step is good."""
        return self.calibration is not None and all(outcome.step.good for outcome in self.outcomes)

    def outcome(self, name: str) -> Outcome | None:
        """Return the outcome of a step; None when the step was not done."""
        return next((outcome for outcome in self.outcomes if outcome.step.name == name), None)


def guide(
    captures: Captures,
    say: Callable[[str], None] = lambda _: None,
    done: Callable[[Outcome], None] = lambda _: None,
) -> Guided:
    """Do every step whose captures exist; call `say` with instructions, missing captures and results.

    `done` is called with the outcome of every step at once, before a later one may fail. Raises `InputError` for
    captures that cannot be read, and `CalibrationError` for captures that do not give a trustworthy calibration.
    Writes no file.
    """
    walk = _Walk(captures, say, done)
    for step in STEPS:
        walk.take(step)
    return Guided(walk.calibration(), tuple(walk.outcomes), walk.missing)


class _Walk:
    """The state of a session while its steps are done."""

    def __init__(self, captures: Captures, say: Callable[[str], None], done: Callable[[Outcome], None]) -> None:
        self.captures, self.say, self.done = captures, say, done
        self.outcomes: list[Outcome] = []
        self.missing: dict[str, tuple[str, ...]] = {}
        self.fields: dict[str, Any] = {}

    def take(self, step: Step) -> None:
        """Do a step, or report what it lacks."""
        lacks = tuple(self.captures.missing(step.name))
        self.say(f"{step.name}: {step.title}")
        if lacks:
            self.missing[step.name] = lacks
            more = f" and {len(lacks) - LISTED} more" if len(lacks) > LISTED else ""
            need = "needed" if step.needed else "optional"
            self.say(f"  missing ({need}): {', '.join(lacks[:LISTED])}{more}\n  {step.how}")
            return
        if step.name in ("planes", "acceptance") and self.calibration() is None:
            self.say("  needs the calibration of the steps before; take their captures first")
            return
        for outcome in self._outcomes(step.name):
            self.outcomes.append(outcome)
            self.fields |= outcome.fields
            word = "good" if outcome.step.good else "NOT GOOD"
            self.say(f"  {outcome.step.name}: {word}: {outcome.step.verdict}")
            self.done(outcome)

    def _outcomes(self, name: str) -> Iterable[Outcome]:
        dark = self.fields.get("dark", (0.0,) * 4)
        if name == "dark":
            return [light.dark(self.captures)]
        if name == "levels":
            return [light.levels(self.captures, dark)]
        if name == "flat":
            return [light.flat(self.captures, dark)]
        if name == "poses":
            return self._poses()
        calibration = self.calibration()
        assert calibration is not None
        work = geometry.planes if name == "planes" else geometry.acceptance
        return [work(self.captures, calibration)]

    def _poses(self) -> Iterator[Outcome]:
        maps = {}
        for name in self.captures.session.captures("poses"):
            maps[name] = self.captures.pose(name)
            self.say(f"  pose {name}: read")
        registered = geometry.registration(self.captures, maps) if len(self.captures.session.beams) > 1 else None
        if registered is not None:
            yield registered  # before the poses, which may fail
        found = None if registered is None else registered.details["registration"]
        yield geometry.poses(self.captures, maps, found)

    def calibration(self) -> Calibration | None:
        """Return the calibration from the completed steps; None while a needed step is missing."""
        done = {outcome.step.name for outcome in self.outcomes}
        if not {step.name for step in STEPS if step.needed} <= done:
            return None
        offset_px = self.captures.session.offset_px
        region = () if offset_px is None else (region_step(offset_px),)
        made = CalibrationRecord(
            made_utc=datetime.now(UTC).isoformat(timespec="seconds"),
            quadfringe_version=_core.__version__,
            rig=self.captures.session.rig,
            steps=(*(outcome.step for outcome in self.outcomes), *region),
        )
        return Calibration(**self.fields, record=made)
