"""The result of computing a published result again: figures with what the paper has for them, pictures, a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["Figure", "Reproduction"]


@dataclass(frozen=True)
class Figure:
    """A measured figure: its name in JSON, the words for it, its value and unit.

    `published` is the value in the paper and `expected` the one that theory gives, both in the same unit, None without.
    `at_least` marks a value at which a search ended: the true one is larger.

    >>> Figure("ty_mm", "along the fringes", 100.0, "mm", at_least=True).shown
    'at least 100'
    """

    name: str
    words: str
    value: float
    unit: str
    published: float | None = None
    expected: float | None = None
    at_least: bool = False

    @property
    def shown(self) -> str:
        """The value as a reader sees it, with four digits."""
        return f"at least {self.value:.4g}" if self.at_least else f"{self.value:.4g}"


@dataclass(frozen=True)
class Reproduction:
    """The figures, the pictures and movies that were written, the picture first, and in one sentence what came out."""

    records: tuple[Figure, ...]
    pictures: tuple[Path, ...]
    verdict: str

    @property
    def figures(self) -> dict[str, float]:
        """The values by name."""
        return {one.name: one.value for one in self.records}

    @property
    def picture(self) -> Path:
        """The first picture."""
        return self.pictures[0]
