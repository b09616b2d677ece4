"""A file that stays the same one while it is open, also when another takes its name.

>>> import tempfile
>>> with tempfile.TemporaryDirectory() as folder:
...     path = Path(folder) / "numbers"
...     _ = path.write_bytes(bytes(range(8)))
...     held = HeldFile(path)
...     _ = path.write_bytes(b"")
...     held.shortened, held.size
(True, 0)
"""

from __future__ import annotations

import os
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadfringe.files import believable_bytes
from quadfringe.io.locks import ForkedLock

__all__ = ["FileId", "HeldFile"]


@dataclass(frozen=True)
class FileId:
    """What tells a file from all others of this machine, whatever its name."""

    device: int
    inode: int

    @classmethod
    def of(cls, stat: os.stat_result) -> Self:
        """Take it from the status of a file."""
        return cls(stat.st_dev, stat.st_ino)


class HeldFile:
    """A file that is open for reading; safe for threads, and for a forked copy of the process."""

    def __init__(self, path: Path) -> None:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        self._descriptor = descriptor
        self._lock = ForkedLock()
        self.close = weakref.finalize(self, os.close, descriptor)
        found = os.fstat(descriptor)
        self.id, self._size_at_open = FileId.of(found), found.st_size

    @property
    def size(self) -> int:
        """Number of bytes that the file has now."""
        return os.fstat(self._descriptor).st_size

    @property
    def tables_most(self) -> int:
        """Number of bytes that tables and texts may have; pixels may be holes, as copies of black images are."""
        return believable_bytes(os.fstat(self._descriptor))

    @property
    def shortened(self) -> bool:
        """Whether the file has become shorter since it was opened."""
        return self.size < self._size_at_open

    def read_into(self, values: NDArray[Any], begin: int) -> bool:
        """Fill an array with the bytes from `begin` on; return False when the file ends before."""
        rest: memoryview = values.reshape(-1).view(np.uint8).data
        while rest:
            done = self._read_some(rest, begin)
            if not done:
                return False
            rest, begin = rest[done:], begin + done
        return True

    def _read_some(self, place: memoryview, begin: int) -> int:
        if hasattr(os, "preadv"):
            return int(os.preadv(self._descriptor, [place], begin))
        with self._lock:  # Windows: one place in the file for all threads
            os.lseek(self._descriptor, begin, os.SEEK_SET)
            piece = os.read(self._descriptor, len(place))
        place[: len(piece)] = piece
        return len(piece)
