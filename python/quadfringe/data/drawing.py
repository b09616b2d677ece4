"""Where records find their pictures.

Pictures are drawn in `quadfringe.view`, which stands above `quadfringe.data` and uses it. A record looks its drawing up
by name, and only when it is asked for a picture: without one it needs neither the module nor its libraries.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__all__ = ["cards", "plots"]


def cards() -> Any:
    """Give the module that describes records to notebooks, which needs OpenCV only."""
    return import_module("quadfringe.view.cards")


def plots() -> Any:
    """Give the module that plots records, which needs matplotlib (extra `plot`)."""
    return import_module("quadfringe.view.plots")
