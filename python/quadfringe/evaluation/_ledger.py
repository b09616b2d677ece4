"""The ledger of accuracy bars, `evaluation/bars.toml`: the limits that measured figures must keep."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

from quadfringe.evaluation._scenes import ROOT

LEDGER = ROOT / "evaluation" / "bars.toml"
FIELDS = {"figure", "unit", "lower", "upper", "command", "since", "moved"}


@dataclass(frozen=True)
class Bar:
    """One figure and the limits that it must keep; a figure that equals a limit keeps it."""

    key: str
    figure: str
    unit: str
    command: str  # measures the figure
    since: date  # when the limits got their present values
    moved: str  # why they last changed
    lower: float | None = None
    upper: float | None = None

    def holds(self, value: float) -> bool:
        """Tell whether a value is inside the limits; NaN never is."""
        above = self.lower is None or value >= self.lower
        below = self.upper is None or value <= self.upper
        return value == value and above and below

    @property
    def text(self) -> str:
        """The limits as a table shows them."""
        if self.lower is not None and self.upper is not None:
            return f"{self.lower:g} to {self.upper:g}"
        limit = self.upper if self.lower is None else self.lower
        return f"{limit:g}"


@cache
def bars(path: Path = LEDGER) -> dict[str, Bar]:
    """Read the ledger; keys are `group.name`.

    Fields of a group are the defaults of its bars. Raises ValueError for a bar that is incomplete or has an unknown
    field.
    """
    found: dict[str, Bar] = {}
    for group, entries in _groups(path).items():
        shared = {name: value for name, value in entries.items() if not isinstance(value, dict)}
        for name, entry in entries.items():
            if isinstance(entry, dict):
                key = f"{group}.{name}"
                found[key] = _bar(key, shared | entry)
    return found


@cache
def rust_bars(path: Path = LEDGER) -> dict[str, dict[str, str]]:
    """Read the bars of the kernel crate: by test file, each condition with its date and reason."""
    found: dict[str, dict[str, str]] = tomllib.loads(path.read_text())["rust"]
    return found


def _groups(path: Path) -> dict[str, dict[str, Any]]:
    return {name: entries for name, entries in tomllib.loads(path.read_text()).items() if name != "rust"}


def _bar(key: str, fields: dict[str, Any]) -> Bar:
    unknown, missing = fields.keys() - FIELDS, FIELDS - {"lower", "upper"} - fields.keys()
    if unknown or missing:
        raise ValueError(f"{key}: unknown fields {sorted(unknown)}, missing fields {sorted(missing)}")
    if "lower" not in fields and "upper" not in fields:
        raise ValueError(f"{key}: expected lower, upper or both")
    if fields.get("lower", 0.0) > fields.get("upper", float("inf")):
        raise ValueError(f"{key}: lower is above upper")
    return Bar(key=key, **fields)
