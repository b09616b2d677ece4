"""A folder into which another program writes images: which of them belong together, and which are whole.

>>> from pathlib import Path
>>> part_of(Path("0001_red.png"), None), part_of(Path("IMG 7.tif"), None)
(Part(group='0001', role='red'), Part(group='IMG 7', role='rgb'))
"""

from __future__ import annotations

import os
import re
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from quadfringe.config import BayerPattern
from quadfringe.data.shot_files import SUFFIXES
from quadfringe.errors import CameraError

__all__ = ["COLOURS", "JPEG", "Group", "Part", "WatchedFolder", "part_of"]

COLOURS = ("red", "green", "blue")
JPEG = (".jpg", ".jpeg")
ROLES = {
    **{name: name for name in ("red", "green", "blue", "ir", "rgb", "raw")},
    **{"r": "red", "g": "green", "b": "blue"},
    **{"infrared": "ir", "nir": "ir", "color": "rgb", "colour": "rgb"},
}
BEFORE = re.compile(rf"({'|'.join(ROLES)})(?:[ _.-]+(.*))?", re.IGNORECASE)
BEHIND = re.compile(rf"(.*?)[ _.-]+({'|'.join(ROLES)})", re.IGNORECASE)
# A folder is looked at so seldom that looking takes at most this share of the time, but at least every second: a drive
# that hangs once, or a computer that sleeps, must not delay later looks.
LOOKING_SHARE, LOOK_AGAIN_S = 0.1, 1.0


class Part(NamedTuple):
    """The place of an image in a shot: the shot that it belongs to, and what it shows."""

    group: str
    role: str


def part_of(path: Path, bayer: BayerPattern | None) -> Part:
    """Read from the name of a file what it shows: red, green, blue, ir, rgb or raw before or behind a number.

    A name without such a word is a colour image, or with `bayer` a raw mosaic.
    """
    if found := BEFORE.fullmatch(path.stem):
        return Part(found[2] or "", ROLES[found[1].lower()])
    if found := BEHIND.fullmatch(path.stem):
        return Part(found[1], ROLES[found[2].lower()])
    return Part(path.stem, "raw" if bayer else "rgb")


class State(NamedTuple):
    """Size in bytes and time of the last change, ns, of a file: they change when it is written."""

    size: int
    changed_ns: int


@dataclass
class Seen:
    """A file as it was last seen, and since when, s of the monotonic clock, it is unchanged."""

    state: State
    since_s: float


@dataclass(frozen=True)
class Group:
    """Files of one shot, by what they show; `changed_ns` is when the first of them was last changed, UTC."""

    name: str
    files: dict[str, Path]
    states: dict[str, State] = field(repr=False)
    rest_s: float

    @property
    def changed_ns(self) -> int:
        """Time of the last change of the file that is oldest, ns since 1970."""
        return min(state.changed_ns for state in self.states.values())

    @property
    def last_ns(self) -> int:
        """Time of the last change of the file that is newest, ns since 1970."""
        return max(state.changed_ns for state in self.states.values())

    @property
    def missing(self) -> list[str]:
        """The colours that are not there."""
        if {"rgb", "raw"} & self.files.keys():
            return []
        return [name for name in COLOURS if name not in self.files]


class WatchedFolder:
    """The images of a folder and of the folders in it; files that were taken count again when they are rewritten."""

    def __init__(self, folder: Path, bayer: BayerPattern | None) -> None:
        self.folder = folder
        self._bayer = bayer
        self._seen: dict[Path, Seen] = {}
        self._taken: dict[Path, State] = {}
        self._next_s = 0.0

    def look(self) -> None:
        """Note which files there are, and which of them changed since the last look."""
        begin_s = time.monotonic()
        if begin_s < self._next_s:
            return
        present = self._present()
        now_s = time.monotonic()
        for path, state in present.items():
            known = self._seen.get(path)
            if known is None or known.state != state:
                self._seen[path] = Seen(state, now_s)
        for path in self._seen.keys() - present.keys():
            del self._seen[path]
            self._taken.pop(path, None)
        self._next_s = now_s + min((now_s - begin_s) / LOOKING_SHARE, LOOK_AGAIN_S)

    def _present(self) -> dict[Path, State]:
        try:
            return dict(self._files(self.folder, deeper=True))
        except OSError as error:
            raise CameraError(f"{self.folder}: cannot be read: {error.strerror or error}") from error

    def _files(self, folder: Path, *, deeper: bool) -> list[tuple[Path, State]]:
        found = []
        with os.scandir(folder) as entries:
            for entry in entries:
                path = Path(entry.path)
                try:
                    if entry.name.startswith("."):
                        continue
                    if entry.is_dir():
                        found += self._files(path, deeper=False) if deeper else []
                    elif path.suffix.lower() in (*SUFFIXES, *JPEG):
                        status = entry.stat()
                        found.append((path, State(status.st_size, status.st_mtime_ns)))
                except FileNotFoundError:
                    continue  # renamed or deleted between two calls, as temporary files are
        return found

    def groups(self) -> list[Group]:
        """Give the shots that are not taken yet, whole or not, the earliest first."""
        parts: dict[str, dict[str, Path]] = defaultdict(dict)
        for path, seen in self._seen.items():
            if self._taken.get(path) != seen.state:
                name, role = part_of(path, self._bayer)
                inside = path.parent.relative_to(self.folder)
                parts[str(inside / name) if inside.parts else name][role] = path
        now_s = time.monotonic()
        groups = [
            Group(
                name,
                files,
                {role: self._seen[path].state for role, path in files.items()},
                now_s - max(self._seen[path].since_s for path in files.values()),
            )
            for name, files in parts.items()
        ]
        return sorted(groups, key=lambda group: (group.last_ns, group.name))

    def take(self, group: Group) -> None:
        """Leave the files of a group out until they are written again."""
        for role, path in group.files.items():
            self._taken[path] = group.states[role]

    def take_all(self) -> None:
        """Leave out every file that is there now, also those that are still being written."""
        self._next_s = 0.0
        self.look()
        for group in self.groups():
            self.take(group)
