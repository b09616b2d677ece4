"""JSON and TOML texts, read with limits: from files, from the members of an NPZ file, from recordings.

>>> json_of('{"threads": 2}', "settings")
{'threads': 2}
>>> toml_of(b"threads = 2", "system.toml")
{'threads': 2}
"""

from __future__ import annotations

import json
import re
import tomllib
from typing import Any

from quadfringe.errors import ConfigError

__all__ = ["TOML_BYTES", "json_of", "toml_of"]

DEPTH = 64  # lists and tables inside one another; a calibration has 7
KEYS = 100_000  # of all tables of a text; a calibration has some 1000
VALUES = 1_000_000  # between commas; a calibration has some 10,000
TOML_BYTES = 1 << 18  # a system file has some kB; the time to read TOML grows with the square of a key of many parts
KEY_PARTS = 16  # of a dotted key; a system file has 4
DOT = re.compile(r"""(?<=[\w"'-])[ \t]*\.[ \t]*(?=[\w"'-])""")  # between the parts of a key
BETWEEN_KEYS = re.compile(r"[=,{}\[\]\n]")
TOO_DEEP = f"expected at most {DEPTH} lists and tables inside one another, got more"


def json_of(text: bytes | str, source: str) -> Any:
    """Give the value of a JSON text; raise `ConfigError` that names `source` when it is not valid.

    A key that a table holds twice is an error, because programs differ in which of the two they take. So are lists and
    tables that are nested more than 64 deep, more than 100,000 keys or lists, and more than 1,000,000 values.
    """
    commas, brackets = (text.count(b) for b in (b",", b"[")) if isinstance(text, bytes) else map(text.count, ",[")
    if commas > VALUES or brackets > KEYS:
        raise ConfigError(f"{source}: expected at most {VALUES:,} values and {KEYS:,} lists, got more")
    keys = 0

    def table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        nonlocal keys
        keys += len(pairs)
        if keys > KEYS:
            raise ValueError(f"it has more than {KEYS} keys")
        return _table(pairs)

    try:
        value = json.loads(text, object_pairs_hook=table)
    except RecursionError:
        raise ConfigError(f"{source}: {TOO_DEEP}") from None
    except ValueError as error:
        raise ConfigError(f"{source}: not valid JSON: {error}") from error
    level = [value]
    for _ in range(DEPTH):
        level = [inner for outer in level for inner in _inner(outer)]
    if any(isinstance(inner, (list, dict)) for inner in level):
        raise ConfigError(f"{source}: {TOO_DEEP}")
    return value


def toml_of(text: bytes, source: str) -> dict[str, Any]:
    """Give the values of a TOML text; raise `ConfigError` that names `source` when it is not valid.

    A text of more than 256 kB, and a key of more than 16 parts, are errors.
    """
    if len(text) > TOML_BYTES:
        raise ConfigError(f"{source}: has {len(text) / 1e3:.0f} kB; expected at most {TOML_BYTES / 1e3:.0f} kB")
    try:
        words = text.decode()
        if any(len(DOT.findall(piece)) >= KEY_PARTS for piece in BETWEEN_KEYS.split(words)):
            raise ConfigError(f"{source}: expected keys of at most {KEY_PARTS} parts with a dot between them, got more")
        return tomllib.loads(words)
    except RecursionError:
        raise ConfigError(f"{source}: lists and tables are nested too deep; expected at most four levels") from None
    except ConfigError:
        raise
    except ValueError as error:  # TOML, UTF-8, and integers of thousands of digits
        raise ConfigError(f"{source}: not valid TOML: {error}") from error


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key {key!r} is given twice; keep one of them")
        found[key] = value
    return found


def _inner(value: Any) -> list[Any]:
    """Give what a list or a table holds."""
    return value if isinstance(value, list) else list(value.values()) if isinstance(value, dict) else []
