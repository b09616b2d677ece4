"""Pictures of shots and shapes: reports, movies, and the pages of live and of saved shapes in the browser.

The modules are imported when they are first used, because each needs another optional library: `report` needs
matplotlib, `viewer` and `saved` need viser, `movie` and `colours` need OpenCV only.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from quadfringe.view import colours, measuring, movie, report, saved, viewer

__all__ = ["colours", "measuring", "movie", "report", "saved", "viewer"]


def __getattr__(name: str) -> ModuleType:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")


def __dir__() -> list[str]:
    return list(__all__)
