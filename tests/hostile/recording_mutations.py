"""Ways to change the bytes of a recording, drawn from a seed."""

from __future__ import annotations

import random
import re
import tempfile
from pathlib import Path

import numpy as np

from quadfringe.recording._seal import FOOTER, MAGIC, write_seal

IMAGE_BYTES = 1536  # of an image of 48 x 32


def mutated(data: bytes, chance: random.Random) -> bytes:
    """Change a file in one of several ways; the changed bytes lie often in tables, which are a small part of it.

    Every second change of a sealed file comes with a new seal, as from somebody who wants it to be opened.
    """
    change = chance.choice((flip, flip, flip, digit, scribble, zeros, cut, swap, doubled, tail))
    changed = bytearray(data)
    change(changed, chance)
    return resealed(changed) if len(changed) == len(data) and chance.random() < 0.5 else bytes(changed)


def resealed(data: bytearray) -> bytes:
    """Give the same bytes with a seal that holds, if they have a seal whose size is known."""
    magic, end, shots, count, _, _ = FOOTER.unpack(data[-FOOTER.size :])
    if magic != MAGIC or end + 16 * count + FOOTER.size != len(data):
        return bytes(data)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "resealed.h5"
        path.write_bytes(data[:end])
        extents = np.frombuffer(bytes(data[end : end + 16 * count]), "<u8").reshape(count, 2)
        write_seal(path, extents, shots)
        return path.read_bytes()


def place(data: bytearray, chance: random.Random) -> int:
    """Choose a byte; two of three times one whose neighbours are those of a table or a text."""
    for _ in range(200 if chance.random() < 0.67 else 0):
        at = chance.randrange(len(data))
        if data[at] and (0 in data[at : at + 9] or b'":' in data[at : at + 40]):
            return at
    return chance.randrange(len(data))


def flip(data: bytearray, chance: random.Random) -> None:
    data[place(data, chance)] ^= 1 << chance.randrange(8)


def digit(data: bytearray, chance: random.Random) -> None:
    """Change a digit of a text of the header."""
    found = [match.start() for match in re.finditer(rb"(?<=[:,.\[\d])\d", bytes(data))]
    data[chance.choice(found)] = ord(chance.choice("0123456789"))


def scribble(data: bytearray, chance: random.Random) -> None:
    at = place(data, chance)
    data[at : at + 8] = chance.randbytes(len(data[at : at + 8]))


def zeros(data: bytearray, chance: random.Random) -> None:
    at, size = place(data, chance), chance.choice((4, 64, 512, 4096))
    data[at : at + size] = bytes(len(data[at : at + size]))


def cut(data: bytearray, chance: random.Random) -> None:
    del data[chance.randrange(1, len(data)) :]


def swap(data: bytearray, chance: random.Random) -> None:
    size = chance.choice((8, 64, 512, IMAGE_BYTES))
    one, other = (size * chance.randrange(len(data) // size) for _ in range(2))
    data[one : one + size], data[other : other + size] = data[other : other + size], data[one : one + size]


def doubled(data: bytearray, chance: random.Random) -> None:
    at, size = place(data, chance), chance.choice((1, 8, 512))
    data[at:at] = data[at : at + size]


def tail(data: bytearray, chance: random.Random) -> None:
    """Change the seal, or add to it."""
    if chance.random() < 0.3:
        data += chance.randbytes(chance.choice((1, 8, 4096)))
    else:
        data[-chance.randrange(1, 120)] ^= 1 << chance.randrange(8)
