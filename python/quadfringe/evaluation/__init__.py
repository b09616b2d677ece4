"""Evaluation: demonstration, timing, scoring against known truth, and published results computed again.

The modules are imported when they are first used, because some need optional libraries or start processes.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from quadfringe.evaluation import (
        demo,
        efficiency,
        machine,
        moving_scene,
        numpy_chain,
        reproduce,
        reproduction,
        scoring,
        simulate,
        timing,
    )

__all__ = [
    "demo",
    "efficiency",
    "machine",
    "moving_scene",
    "numpy_chain",
    "reproduce",
    "reproduction",
    "scoring",
    "simulate",
    "timing",
]


def __getattr__(name: str) -> ModuleType:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")


def __dir__() -> list[str]:
    return list(__all__)
