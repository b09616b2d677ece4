"""The captures of a session: read from a folder of images, or from any object that returns shots by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.levels import row4
from quadfringe.calibration.projector import AXES, ProjectorMap, projector_map
from quadfringe.calibration.session.settings import FILE, Session
from quadfringe.data import AnyShot
from quadfringe.data.shot_files import SUFFIXES, read_shot
from quadfringe.devices.light import Levels, Light, Step
from quadfringe.errors import InputError
from quadfringe.io.images import full_scale, read_grey

__all__ = ["Captures", "Exposure", "FolderCaptures", "light_of", "pose_light", "pose_maps"]

# Projected level of the flat field, share of full light: a white surface then reaches about half of full scale.
FLAT_LEVEL = 0.6


class Captures(Protocol):
    """Returns the captures of a session by step and name; raises `InputError` for a missing capture."""

    session: Session

    def missing(self, step: str) -> list[str]:
        """Return the names of the missing captures of a step."""

    def shot(self, step: str, name: str) -> AnyShot:
        """Return one shot."""

    def pose(self, name: str) -> dict[str, ProjectorMap]:
        """Return the projector maps of one pose of the board, by projector."""


class FolderCaptures:
    """The captures in a folder with `session.json`; raises `InputError` when that file is missing.

    `rig` is the name of the bench to calibrate; the session of another bench raises `InputError`.
    """

    def __init__(self, folder: Path, rig: str | None = None) -> None:
        if not (folder / FILE).is_file():
            raise InputError(f"{folder}: no {FILE}; create it with quadfringe calibrate plan {folder}")
        self.folder = folder
        self.session = Session.load(folder / FILE)
        if rig is not None and rig != self.session.rig:
            raise InputError(
                f"{folder}: captures of {self.session.rig!r}, not of {rig!r}; use one folder for each bench"
            )
        self._size: tuple[int, ...] | None = None

    def missing(self, step: str) -> list[str]:
        """Return the captures without folder or images; a pose that lacks only some images lists them."""
        names = self.session.captures(step)
        if step != "poses":
            return [name for name in names if not _has_images(self.folder / step / name)]
        found = []
        for name in names:
            lacks = self.lacking_images(name)
            if lacks:
                found.append(name if len(lacks) == len(self.session.pose_images()) else f"{name} ({_some(lacks)})")
        return found

    def lacking_images(self, pose: str) -> list[str]:
        """Return the names of the missing fringe images of a pose, such as visible/columns_36_0."""
        return [image for image in self.session.pose_images() if _file(self.folder / "poses" / pose, image) is None]

    def shot(self, step: str, name: str) -> AnyShot:
        """Read one shot."""
        shot = read_shot(self.folder / step / name, self.session.bits, bayer=self.session.bayer)
        self._check_channels(shot, f"{step}/{name}")
        self._check_size(next(iter(shot.images.values())), f"{step}/{name}")
        return shot

    def pose(self, name: str) -> dict[str, ProjectorMap]:
        """Read the fringe images of a pose."""
        return pose_maps(self.session, lambda image: self._fringes(name, image))

    def _fringes(self, pose: str, image: str) -> NDArray[np.float32]:
        folder = self.folder / "poses" / pose
        path = _file(folder, image)
        if path is None:
            raise InputError(f"{folder}: no {image}.png")
        grey = read_grey(path)
        self._check_size(grey, str(path))
        top = 2**self.session.bits - 1 if self.session.bits and grey.dtype == np.uint16 else full_scale(grey)
        return (grey / np.float32(top)).astype(np.float32)

    def _check_channels(self, shot: AnyShot, name: str) -> None:
        infrared = self.session.fringes.infrared
        if infrared and shot.ir is None:
            raise InputError(f"{name}: no image for ir, the infrared channel: add ir.png")
        if shot.ir is not None and not infrared:
            raise InputError(f"{name}: an image for ir, and the session is without infrared: leave it out")

    def _check_size(self, image: NDArray[Any], name: str) -> None:
        self._size = self._size or image.shape
        if image.shape != self._size:
            raise InputError(
                f"{name}: {image.shape[1]} x {image.shape[0]} pixels, the captures before it have {self._size[1]} x "
                f"{self._size[0]}; take all captures of a session with one camera at one image size"
            )


class Exposure(NamedTuple):
    """The projected light of a capture, and the exposure relative to that of the system."""

    light: Light
    share: float


def light_of(session: Session, step: str, name: str) -> Exposure:
    """Return the projected light and the relative exposure of a capture that is one shot."""
    if step == "levels":
        plan = session.level_plan
        row = plan.names.index(name)
        return Exposure(Levels(row4(plan.levels[row])), float(plan.exposure[row]))
    if step in ("dark", "flat"):
        return Exposure(Levels((FLAT_LEVEL if step == "flat" else 0.0,) * 4), 1.0)
    return Exposure(session.fringes, 1.0)


def pose_light(session: Session, image: str) -> Step:
    """Return the projected light of an image of a pose, such as visible/columns_36_0."""
    beam, _, name = image.partition("/")
    axis, number, step = name.split("_")
    shift_rad = session.step_plan.shift_rad(int(step))
    return Step(float(number), shift_rad, axis, beam, session.fringes.layout)


def pose_maps(session: Session, image: Callable[[str], NDArray[np.float32]]) -> dict[str, ProjectorMap]:
    """Compute the projector maps of a pose; `image` returns an image by its name, (H, W), share of full scale."""
    plan = session.step_plan
    found = {}
    for beam in session.beams:
        columns, rows = (
            [
                np.stack([image(f"{beam}/{axis}_{number:g}_{step}") for step in range(plan.steps)])
                for number in plan.fringes.numbers
            ]
            for axis in AXES
        )
        found[beam] = projector_map(columns, rows, plan)
    return found


def _has_images(folder: Path) -> bool:
    return folder.is_dir() and any(path.suffix.lower() in SUFFIXES for path in folder.iterdir())


def _file(folder: Path, image: str) -> Path | None:
    found = [path for suffix in SUFFIXES if (path := folder / f"{image}{suffix}").is_file()]
    return found[0] if found else None


def _some(names: list[str]) -> str:
    return f"{', '.join(names[:3])}{f' and {len(names) - 3} more' if len(names) > 3 else ''}"
