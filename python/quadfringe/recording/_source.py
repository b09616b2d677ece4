"""Where the content of a recording comes from: its file, or a helper process that reads a file which is not sealed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from quadfringe.io.bounded import BoundedError, Helper, Limits
from quadfringe.recording._params import LOST_S, MEMORY_BYTES, READ_S
from quadfringe.recording._stored import Stored, StoredFile, ask

__all__ = ["DamageError", "Source", "open_source"]


class DamageError(RuntimeError):
    """A part of a file cannot be read; the message says why, without the name of the file."""


class Source(Protocol):
    """The content of a file as plain values."""

    def describe(self) -> Stored:
        """Read everything but the shots."""

    def numbers(self, name: str, count: int) -> NDArray[Any]:
        """Read the first rows of a dataset."""

    def images(self, names: tuple[str, ...], index: int) -> dict[str, NDArray[Any]]:
        """Read the images of a shot."""

    def close(self) -> None:
        """Close the file; further calls do nothing."""


def open_source(path: Path, *, sealed: bool) -> Source:
    """Open a file in this process if its seal holds, else in a helper process."""
    return StoredFile(str(path)) if sealed else BoundedFile(path)


class BoundedFile:
    """A file that a helper process reads; every failure of a read is a `DamageError`.

    After reads that cost LOST_S in all until their process was ended, all further reads fail at once.
    """

    def __init__(self, path: Path) -> None:
        self._path = str(path.absolute())
        self._helper = Helper(Limits(READ_S, MEMORY_BYTES))
        self._lost_s = 0.0
        self._fault = ""

    def describe(self) -> Stored:
        """Read everything but the shots."""
        found: Stored = self._ask("describe")
        return found

    def numbers(self, name: str, count: int) -> NDArray[Any]:
        """Read the first rows of a dataset."""
        rows: NDArray[Any] = self._ask("numbers", name, count)
        return rows

    def images(self, names: tuple[str, ...], index: int) -> dict[str, NDArray[Any]]:
        """Read the images of a shot."""
        images: dict[str, NDArray[Any]] = self._ask("images", names, index)
        return images

    def close(self) -> None:
        """End the process; further calls do nothing."""
        self._helper.close()

    def _ask(self, method: str, *arguments: Any) -> Any:
        if self._lost_s >= LOST_S:
            raise DamageError(self._fault)
        begin_s = time.monotonic()
        try:
            return self._helper.run(ask, self._path, method, *arguments)
        except BoundedError as error:
            self._lost_s += time.monotonic() - begin_s
            self._fault = f"reading it {error}"
            raise DamageError(self._fault) from error
        except Exception as error:  # HDF5 and h5py answer damage with almost any exception
            raise DamageError(_first_line(error)) from error


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0] or type(error).__name__
