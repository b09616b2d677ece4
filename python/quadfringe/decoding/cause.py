"""`Cause`: what is wrong with a shot, as one test found it."""

from __future__ import annotations

from dataclasses import dataclass

from quadfringe.errors import DecodeError

__all__ = ["ORDERS", "Cause"]

ORDERS = "fringe orders"  # the name of exchanged channels, and of orders that no test explains


@dataclass(frozen=True)
class Cause:
    """The name of a cause, what was found, and what to do about it; `fatal` when the shape cannot be trusted."""

    name: str
    found: str
    fix: str
    fatal: bool = True

    @classmethod
    def doubt(cls, refused: DecodeError, words: str) -> Cause:
        """Make the doubt, introduced by `words`, of a refusal that holds for a part of a shot only."""
        found = str(refused).removeprefix("no shape: ").removesuffix(f"; {refused.fix}")
        return cls(refused.reason, f"{words}: {found}", refused.fix, fatal=False)

    @property
    def error(self) -> DecodeError:
        """The refusal of the shot for this cause."""
        return DecodeError(f"no shape: {self.found}; {self.fix}", reason=self.name, fix=self.fix)
