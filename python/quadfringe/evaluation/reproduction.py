"""The result of computing a published result again."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

__all__ = ["Reproduction"]


class Reproduction(NamedTuple):
    """Figures by name with unit, and the picture or movie that was written."""

    figures: dict[str, float]
    picture: Path
