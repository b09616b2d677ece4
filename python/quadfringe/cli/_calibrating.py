"""Progress of `quadfringe calibrate`: images read or rendered of all that a session needs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from quadfringe.cli._progress import Meter, meter

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from quadfringe.calibration.projector import ProjectorMap
    from quadfringe.calibration.session import Captures, Session
    from quadfringe.data import AnyShot

__all__ = ["RENDER_S", "images_of", "meter_of", "progress_of"]

RENDER_S, READ_S = 0.17, 0.05  # of an image by experience, on two cores, before the speed is known


def images_of(session: Session, step: str) -> int:
    """Return the number of images of one capture of a step."""
    return len(session.pose_images()) if step == "poses" else 1


def _total(session: Session, captures: Captures | None = None) -> int:
    """Return the images of all steps, of those without missing captures if the captures are given."""
    from quadfringe.calibration.session.settings import STEP_NAMES

    wanted = [step for step in STEP_NAMES if captures is None or not captures.missing(step)]
    return sum(len(session.captures(step)) * images_of(session, step) for step in wanted)


def meter_of(title: str, session: Session, image_s: float) -> AbstractContextManager[Meter]:
    """Show the progress over all images of a session."""
    total = _total(session)
    return meter(title, total, image_s * total)


@contextmanager
def progress_of(title: str, captures: Captures, *, rendered: bool) -> Iterator[Captures]:
    """Yield captures that show how many of their images have been taken; `rendered` ones take longer."""
    total = _total(captures.session, captures)
    with meter(title, total, (RENDER_S if rendered else READ_S) * total) as shown:
        yield _Counted(captures, shown)


class _Counted:
    """Captures that count the images they return."""

    def __init__(self, captures: Captures, shown: Meter) -> None:
        self.session, self._captures, self._shown = captures.session, captures, shown

    def missing(self, step: str) -> list[str]:
        return self._captures.missing(step)

    def shot(self, step: str, name: str) -> AnyShot:
        self._shown.begin(f"{step}/{name}")
        found = self._captures.shot(step, name)
        self._shown.advance()
        return found

    def pose(self, name: str) -> dict[str, ProjectorMap]:
        self._shown.begin(f"poses/{name}")
        found = self._captures.pose(name)
        self._shown.advance(images_of(self.session, "poses"))
        return found
