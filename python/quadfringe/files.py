"""Files that are either whole or absent: written under a temporary name, then renamed.

>>> import tempfile
>>> with tempfile.TemporaryDirectory() as folder:
...     with atomic(f"{folder}/figures.json") as temporary:
...         _ = temporary.write_text(figures_text({"depth_rms_mm": 0.05}))
...     read_bytes(Path(folder) / "figures.json").decode().split()
['{', '"figures":', '{', '"depth_rms_mm":', '0.05', '}', '}']
"""

from __future__ import annotations

import json
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from quadfringe.errors import InputError

__all__ = [
    "PARTIAL",
    "TEXT_BYTES",
    "atomic",
    "atomic_folder",
    "believable_bytes",
    "figures_text",
    "folder_for",
    "kind_of",
    "read_bytes",
    "require_suffix",
]

FILE_BYTES = 4 << 30  # no image, shape or recording that is read as a whole is larger
TEXT_BYTES = 8 << 20  # of settings and calibrations, which have up to some 100 kB; JSON of 8 MB is read in a second
# How many times larger than its room on the disk a file may be, and bytes that are free. Not measured: file systems
# that compress seldom reach it with measured values. Larger numbers let files of some kB keep a reader busy for longer.
COMPRESSION, HOLES_FREE_BYTES = 8, 1 << 20
PARTIAL = ".partial"
KINDS = {stat.S_IFDIR: "folder", stat.S_IFCHR: "device", stat.S_IFBLK: "device", stat.S_IFIFO: "pipe"}


@contextmanager
def atomic(path: Path | str) -> Iterator[Path]:
    """Give a temporary path in the folder of `path`; rename it to `path` when the block succeeds, else remove it.

    A symbolic link is followed: the file that it names is written, and the link stays. Raises `InputError` when the
    folder does not exist, or when `path` is anything but a regular file, such as a folder or /dev/null.
    """
    path = Path(path)
    path = Path(os.path.realpath(path)) if path.is_symlink() else path
    if path.is_symlink():
        raise InputError(f"{path}: is a symbolic link that leads to itself; remove it")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it first")
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: is a {_kind(path.stat().st_mode)}; expected the name of a file to write")
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())  # mkstemp makes private files, but others may read results
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: Path) -> Iterator[Path]:
    """Give an empty folder next to `path`; rename it to `path` when the block succeeds, else remove it.

    Until then its name ends in .partial, which tells those of killed processes from folders of others.
    """
    temporary = Path(tempfile.mkdtemp(prefix=f".{path.stem}-", suffix=PARTIAL, dir=path.parent))
    try:
        yield temporary
        temporary.chmod(0o777 & ~_umask())
        temporary.rename(path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def folder_for(path: Path) -> Path:
    """Create the folder `path` when it is missing; raise `InputError` when a file stands in its place."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot create this folder: {error.strerror}") from error
    return path


def read_bytes(path: Path, most: int = FILE_BYTES) -> bytes:
    """Read a whole file of at most `most` bytes; raise `InputError` naming the file and the reason.

    Devices and pipes are refused, because they need not end, and files of holes, because some kB could be of any size.
    """
    try:
        found = path.stat()
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file in it")
        if not path.is_file():
            raise InputError(f"{path}: is a {_kind(found.st_mode)}; name a file")
        if found.st_size > most:
            raise InputError(f"{path}: has {found.st_size / 1e6:.0f} MB; expected at most {most / 1e6:.0f} MB")
        if found.st_size > believable_bytes(found):
            words = f"has {found.st_size / 1e6:.0f} MB, and nearly all of it are holes that take no room on the disk"
            raise InputError(f"{path}: {words}; it is no file of measured values, or its copy was cut: copy it again")
        return path.read_bytes()
    except MemoryError as error:
        raise InputError(f"{path}: does not fit into memory") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error


def believable_bytes(found: os.stat_result) -> int:
    """Return how many bytes of a file can be data: all, unless it takes next to no room on the disk.

    Holes take none, and are read as zeros. File systems that compress store data smaller; some do not tell the room.
    """
    room: int = 512 * (getattr(found, "st_blocks", None) or 0)
    return min(found.st_size, HOLES_FREE_BYTES + COMPRESSION * room) if room else found.st_size


def kind_of(path: Path) -> str:
    """Return "file", "folder", "device", "pipe" or "socket"; "" for a path that names nothing."""
    if path.is_file():
        return "file"
    return _kind(path.stat().st_mode) if path.exists() else ""


def _kind(mode: int) -> str:
    return KINDS.get(stat.S_IFMT(mode), "socket")


def require_suffix(path: Path, allowed: tuple[str, ...]) -> str:
    """Return the lower-case suffix of `path`; raise `InputError` unless it is one of `allowed`."""
    suffix = path.suffix.lower()
    if suffix not in allowed:
        raise InputError(f"{path}: expected a name that ends in {', '.join(allowed)}")
    return suffix


def figures_text(figures: Mapping[str, float], **more: list[str]) -> str:
    """Render `{"figures": {name_with_unit: number}, ...}` as JSON; a number that is not finite becomes null."""
    finite = {k: (v if abs(v) != float("inf") and v == v else None) for k, v in figures.items()}
    return json.dumps({"figures": finite, **more}, indent=2) + "\n"
