"""JSON texts, read with limits: from files, from the members of an NPZ file, from recordings.

>>> json_of('{"threads": 2}', "settings")
{'threads': 2}
"""

from __future__ import annotations

import json
from typing import Any

from quadfringe.errors import ConfigError

__all__ = ["json_of"]

DEPTH = 64  # lists and tables inside one another; a calibration has 7
TOO_DEEP = f"expected at most {DEPTH} lists and tables inside one another, got more"


def json_of(text: bytes | str, source: str) -> Any:
    """Give the value of a JSON text; raise `ConfigError` that names `source` when it is not valid.

    A key that a table holds twice is an error, because programs differ in which of the two they take. So are lists and
    tables that are nested more than 64 deep.
    """
    try:
        value = json.loads(text, object_pairs_hook=_table)
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
