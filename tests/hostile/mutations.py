"""Damage to the bytes of a file, by a seed: what a failing disk, a cut copy, an editor or an attacker may do."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

__all__ = ["damaged"]

Random = np.random.Generator
Damage = Callable[[bytearray, Random], bytearray]
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
ODD_NUMBERS = (
    *(b"0", b"-1", b"1e-300", b"1e300", b"1e999", b"NaN", b"-Infinity", b"null", b'"x"', b"[]", b"{}", b"true"),
    *(b"65537", b"2147483648", b"18446744073709551616", b"9" * 400, b"9" * 5000),
)
ODD_BYTES = (
    b"\x00",
    b"\xff\xfe",
    b"\x1b[31m",
    b'"',
    b"[" * 2000,
    b'{"a":' * 500,
    b"<a>" * 500,
    b"]",
    b"&a",
    b"\\ud800",
)


def damaged(data: bytes, random: Random) -> bytes:
    """Damage a file in one to three places."""
    changed = bytearray(data)
    for _ in range(int(random.integers(1, 4))):
        changed = DAMAGES[int(random.integers(len(DAMAGES)))](changed, random)
    return bytes(changed)


def _place(data: bytearray, random: Random) -> int:
    return int(random.integers(max(len(data), 1)))


def _length(random: Random) -> int:
    """Give a length, short ones more often than long ones."""
    return int(2 ** random.uniform(0, 12))


def flip_bit(data: bytearray, random: Random) -> bytearray:
    if data:
        data[_place(data, random)] ^= 1 << int(random.integers(8))
    return data


def set_byte(data: bytearray, random: Random) -> bytearray:
    if data:
        data[_place(data, random)] = int(random.choice([0, 1, 0x7F, 0x80, 0xFF, int(random.integers(256))]))
    return data


def overwrite(data: bytearray, random: Random) -> bytearray:
    at, count = _place(data, random), _length(random)
    data[at : at + count] = random.integers(256, size=min(count, len(data) - at), dtype=np.uint8).tobytes()
    return data


def cut_off(data: bytearray, random: Random) -> bytearray:
    return data[: _place(data, random)]


def leave_out(data: bytearray, random: Random) -> bytearray:
    at = _place(data, random)
    del data[at : at + _length(random)]
    return data


def repeat(data: bytearray, random: Random) -> bytearray:
    at = _place(data, random)
    data[at:at] = data[at : at + _length(random)]
    return data


def move(data: bytearray, random: Random) -> bytearray:
    at, to, count = _place(data, random), _place(data, random), _length(random)
    part = data[at : at + count]
    del data[at : at + count]
    data[to:to] = part
    return data


def insert(data: bytearray, random: Random) -> bytearray:
    at = _place(data, random)
    data[at:at] = ODD_BYTES[int(random.integers(len(ODD_BYTES)))]
    return data


def change_number(data: bytearray, random: Random) -> bytearray:
    """Put another number in place of one in a text; in binary files this hits whatever looks like one."""
    found = list(NUMBER.finditer(bytes(data[: 1 << 16])))
    if found:
        one = found[int(random.integers(len(found)))]
        data[one.start() : one.end()] = ODD_NUMBERS[int(random.integers(len(ODD_NUMBERS)))]
    return data


def change_digit(data: bytearray, random: Random) -> bytearray:
    places = [i for i, byte in enumerate(data[: 1 << 16]) if 48 <= byte < 58]
    if places:
        data[places[int(random.integers(len(places)))]] = 48 + int(random.integers(10))
    return data


DAMAGES: tuple[Damage, ...] = (
    *(flip_bit, set_byte, overwrite, cut_off, leave_out, repeat, move, insert, change_number, change_digit),
)
