"""The content of the file of a recording. A damaged file can hang or crash HDF5, which reads it in a helper process."""

from __future__ import annotations

import time
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.io.bounded import BoundedError, Helper, Limits
from quadfringe.recording._params import LOST_S, MEMORY_BYTES, READ_S
from quadfringe.recording._stored import Extent, Stored, ask, close

__all__ = ["DamageError", "Source"]

# One process reads the files of all recordings, because starting it takes a fifth of a second.
helper = Helper(Limits(READ_S, MEMORY_BYTES))
numbers = count()


class DamageError(RuntimeError):
    """A part of a file cannot be read; the message says why, without the name of the file."""


class Source:
    """The content of a file as plain values; every failure of a read is a `DamageError`.

    After reads that cost LOST_S in all until their process was ended, all further reads fail at once.
    """

    def __init__(self, path: Path) -> None:
        self._path = str(path.absolute())
        self._number = next(numbers)
        self._open = True
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
        """Read the images of a shot; this process reads them where HDF5 finds them, which saves a copy."""
        extents: dict[str, Extent] | None = self._ask("extents", names, index)
        if extents is None:
            images: dict[str, NDArray[Any]] = self._ask("images", names, index)
            return images
        return {name: self._at(extent) for name, extent in extents.items()}

    def _at(self, extent: Extent) -> NDArray[Any]:
        values = int(np.prod(extent.shape))
        try:
            found = np.fromfile(self._path, extent.dtype, values, offset=extent.begin)
        except (OSError, ValueError) as error:
            raise DamageError(_first_line(error)) from error
        if found.size < values:
            raise DamageError("an image ends beyond the end of the file")
        return found.reshape(extent.shape)

    def close(self) -> None:
        """Close the file; further calls do nothing."""
        if self._open:
            self._open = False
            with suppress(BoundedError):  # the process has ended, and its files are closed
                helper.run(close, self._number)

    def _ask(self, method: str, *arguments: Any) -> Any:
        if self._lost_s >= LOST_S:
            raise DamageError(self._fault)
        begin_s = time.monotonic()
        try:
            return helper.run(ask, self._path, self._number, method, *arguments)
        except BoundedError as error:
            self._lost_s += time.monotonic() - begin_s
            self._fault = f"reading it {error}"
            raise DamageError(self._fault) from error
        except Exception as error:  # HDF5 and h5py answer damage with almost any exception
            raise DamageError(_first_line(error)) from error


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0] or type(error).__name__
