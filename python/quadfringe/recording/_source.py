"""The content of the file of a recording. A damaged file can hang or crash HDF5, which reads it in a helper process."""

from __future__ import annotations

import time
import uuid
import weakref
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.io.bounded import BoundedError, Helper, Limits, UnansweredError
from quadfringe.recording._held import HeldFile
from quadfringe.recording._params import LOST_S, MEMORY_BYTES, READ_S
from quadfringe.recording._stored import Extent, Place, ReplacedError, Stored, ask, close

__all__ = ["DamageError", "Source", "UnreadableError"]


class DamageError(RuntimeError):
    """A part of a file is damaged; the message says how, without the name of the file."""


class UnreadableError(RuntimeError):
    """A file cannot be read now, damaged or not; the message says why, without the name of the file."""


class _Reader:
    """A helper process, and the keys of files that it can close.

    Garbage collection may end a `Source` at any time, also while its thread waits for the helper. It therefore leaves
    the key, and the next request takes it along.
    """

    def __init__(self) -> None:
        self.helper = Helper(Limits(READ_S, MEMORY_BYTES))
        self.left: deque[str] = deque()

    def ask(self, place: Place, method: str, *arguments: Any) -> Any:
        return self.helper.run(ask, self._taken(), place, method, *arguments)

    def close_left(self) -> None:
        taken = self._taken()
        if self.helper.running:
            with suppress(BoundedError):  # the process has ended, and its files are closed
                self.helper.run(close, taken)

    def _taken(self) -> list[str]:
        taken = []
        with suppress(IndexError):
            while True:
                taken.append(self.left.popleft())
        return taken


# One process reads all recordings with a seal, because starting it takes a fifth of a second. Another one reads the
# others, so that a damaged one rarely keeps sound ones waiting.
sealed_reader, other_reader = _Reader(), _Reader()


class Source:
    """The content of a file as plain values; a failure of a read is a `DamageError` or an `UnreadableError`.

    A read whose process was ended is tried once more. After such reads cost LOST_S, all further reads fail at once. The
    file stays the one that was opened: this process holds it, and the helper compares it before it opens the path.
    """

    def __init__(self, path: Path, file: HeldFile, *, sealed: bool) -> None:
        self.file = file
        self._place = Place(str(path.absolute()), self.file.id, uuid.uuid4().hex)
        self._reader = sealed_reader if sealed else other_reader
        self._leave = weakref.finalize(self, self._reader.left.append, self._place.key)
        self._lost_s = 0.0
        self._fault: BoundedError | None = None

    def describe(self) -> Stored:
        """Read everything but the shots."""
        found: Stored = self._ask("describe")
        return found

    def numbers(self, name: str, count: int) -> NDArray[Any]:
        """Read the first rows of a dataset."""
        rows: NDArray[Any] = self._ask("numbers", name, count)
        return rows

    def images(self, names: tuple[str, ...], index: int) -> dict[str, NDArray[Any]]:
        """Read the images of a shot; this process reads them where HDF5 finds them, which saves a copy."""
        extents: dict[str, Extent] | None = self._ask("extents", names, index)
        if extents is None:
            images: dict[str, NDArray[Any]] = self._ask("images", names, index)
            return images
        return {name: self._at(extent) for name, extent in extents.items()}

    def _at(self, extent: Extent) -> NDArray[Any]:
        dtype = np.dtype(extent.dtype)
        if extent.begin + dtype.itemsize * int(np.prod(extent.shape)) <= self.file.size:
            try:
                found = np.empty(extent.shape, dtype)
                if self.file.read_into(found, extent.begin):
                    return found
            except (OSError, MemoryError) as error:
                raise UnreadableError(_first_line(error)) from error
        raise self._damage("an image ends beyond the end of the file")

    def close(self) -> None:
        """Close the file; further calls do nothing, and further reads are a ValueError."""
        if self._leave.alive:
            self._leave()
            self._reader.close_left()
            self.file.close()

    def _ask(self, method: str, *arguments: Any) -> Any:
        if not self._leave.alive:
            raise ValueError(f"{self._place.path}: is closed; open the recording again")
        tries = 2
        while self._lost_s < LOST_S and tries:
            tries -= 1
            begin_s = time.monotonic()
            try:
                return self._reader.ask(self._place, method, *arguments)
            except BoundedError as error:
                # A slow disk may need longer than the limit: only the limit counts, so that the second try comes.
                self._lost_s += min(time.monotonic() - begin_s, READ_S)
                self._fault = error
            except (ReplacedError, ImportError) as error:
                raise UnreadableError(_first_line(error)) from error
            except Exception as error:  # HDF5 and h5py answer damage with almost any exception
                raise self._damage(_first_line(error)) from error
        kind = UnreadableError if isinstance(self._fault, UnansweredError) else DamageError
        raise kind(f"reading it {self._fault}") from self._fault

    def _damage(self, reason: str) -> DamageError | UnreadableError:
        if self.file.shortened:
            return UnreadableError("it was shortened since it was opened")
        return DamageError(reason)


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0] or type(error).__name__
