"""Values in few words, for the `repr` of records."""

from __future__ import annotations

from typing import Any

__all__ = ["brief", "shortened"]

LONGEST = 330  # characters of a repr: three lines of 110
SHOWN = 8  # entries of a list that are shown


def brief(value: Any) -> str:
    """Write a value with six digits, and at most eight entries of a list."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (tuple, list)):
        words = [brief(item) for item in value[:SHOWN]] + ["..."] * (len(value) > SHOWN)
        if isinstance(value, list):
            return f"[{', '.join(words)}]"
        return f"({', '.join(words)}{',' * (len(words) == 1)})"
    return shortened(repr(value))


def shortened(text: str) -> str:
    """Cut a text to the length of three lines."""
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."
