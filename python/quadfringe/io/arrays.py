"""Read arrays that NumPy saved: NPZ archives and NPY files, with checksums and sizes compared before anything is used.

`numpy.load` reads as many values as the header of an array says, and leaves the rest of the member and its checksum
aside; a changed header then gives other values without an error.
"""

from __future__ import annotations

import lzma
import math
import struct
import tokenize
import zipfile
import zlib
from collections import Counter
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import InputError
from quadfringe.files import read_bytes

__all__ = ["read_npy", "read_npz"]

# A damaged file: numpy parses its header as Python, and zipfile and its decompressors have errors of other kinds.
DAMAGED = (
    *(OSError, EOFError, ValueError, TypeError, LookupError, ArithmeticError, RuntimeError, MemoryError, SyntaxError),
    *(tokenize.TokenError, struct.error, zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)
NUMPY_FILES = {"NPZ": "an archive of arrays (.npz)", "NPY": "a single array (.npy)"}
MEMBERS = 1000  # arrays of an archive; a shape has some 20
# Bytes that an archive may unpack to: those of a shape of 25 million pixels, or four times those of a larger file,
# since measured values hardly shrink.
UNPACKED_BYTES, UNPACKED_RATIO = 1 << 30, 4
PIECE_BYTES = 1 << 18
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # that NumPy writes; others shrink zeros to a millionth
ARCHIVE, ARRAY = b"PK", np.lib.format.MAGIC_PREFIX
HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read every array of an NPZ file; raises `InputError` for any other file."""
    data = _checked(path, "NPZ", {ARCHIVE})
    try:
        return _members(data)
    except DAMAGED as error:
        raise InputError(f"{path}: not a readable NPZ file: {_words(error)}") from error


def read_npy(path: Path) -> NDArray[Any]:
    """Read the array of an NPY file; raises `InputError` for any other file."""
    data = _checked(path, "NPY", {ARRAY})
    try:
        return _array(BytesIO(data), len(data))
    except DAMAGED as error:
        raise InputError(f"{path}: not a readable NPY file: {_words(error)}") from error


def _checked(path: Path, kind: str, begin: set[bytes]) -> bytes:
    """Read a file that begins as this kind does."""
    data = read_bytes(path)
    if data and not data.startswith(tuple(begin)):
        others = {ARCHIVE: "an archive of arrays", ARRAY: "a single array"}
        got = next((words for start, words in others.items() if data.startswith(start)), "another kind of file")
        raise InputError(f"{path}: expected {NUMPY_FILES[kind]}, got {got}")
    return data


def _members(data: bytes) -> dict[str, NDArray[Any]]:
    with zipfile.ZipFile(BytesIO(data)) as archive:
        members = archive.infolist()
        names = [member.filename.removesuffix(".npy") for member in members]
        if len(members) > MEMBERS:
            raise ValueError(f"it holds {len(members)} arrays, expected at most {MEMBERS}")
        if twice := sorted(name for name, number in Counter(names).items() if number > 1):
            raise ValueError(f"it holds {', '.join(twice)} twice")
        if any(member.compress_type not in METHODS for member in members):
            raise ValueError("its arrays are compressed as NumPy never does; save it with numpy.savez_compressed")
        size, most = sum(member.file_size for member in members), max(UNPACKED_BYTES, UNPACKED_RATIO * len(data))
        if size > most:
            raise ValueError(f"its arrays have {size / 1e6:.0f} MB, expected at most {most / 1e6:.0f} MB")
        found = {}
        for name, member in zip(names, members, strict=True):
            try:
                with archive.open(member) as stream:
                    found[name] = _array(stream, member.file_size)  # reading to its end compares the checksum
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from error
        return found


def _array(stream: IO[bytes], length: int) -> NDArray[Any]:
    """Read an NPY file of this many bytes; raise ValueError unless it has exactly the size that its header says."""
    version = np.lib.format.read_magic(stream)
    if version not in HEADERS:
        raise ValueError(f"expected version 1 or 2 of the format NPY, got {version[0]}.{version[1]}")
    shape, by_columns, dtype = HEADERS[version](stream)
    if dtype.hasobject or dtype.names is not None or not dtype.itemsize:
        raise ValueError(f"expected an array of numbers or texts, got {dtype}")
    size, given = math.prod(shape) * dtype.itemsize, length - stream.tell()
    if size != given or any(side < 0 for side in shape):
        raise ValueError(f"expected {size} bytes for an array {shape} of {dtype}, got {given}")
    values = np.empty(size, np.uint8)
    _fill(values, stream)
    return values.view(dtype).reshape(shape, order="F" if by_columns else "C")


def _fill(values: NDArray[np.uint8], stream: IO[bytes]) -> None:
    """Fill an array from a stream, in pieces: a copy of the whole would take as long as reading it."""
    for begin in range(0, len(values), PIECE_BYTES):
        piece = stream.read(min(PIECE_BYTES, len(values) - begin))
        if len(piece) < min(PIECE_BYTES, len(values) - begin):
            raise ValueError(f"it ends after {begin + len(piece)} of {len(values)} bytes")
        values[begin : begin + len(piece)] = np.frombuffer(piece, np.uint8)


def _words(error: BaseException) -> str:
    return str(error) or type(error).__name__
