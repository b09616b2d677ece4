"""What the camera of the virtual bench sees of an object, and its truth, computed when somebody asks for it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.data import Truth

__all__ = ["Seen"]

# Distance to a depth discontinuity, px, below which `Truth.edge` marks a pixel: lens blur and the pixel area mix the
# light of both sides there, so that neither depth is right.
EDGE_PX = 2.0
Array = TypeVar("Array", bound=NDArray[Any])


class Seen:
    """An object in front of the bench.

    Its ray cast, 72 bytes per pixel, is kept until `forget`; shots hold their truth longer, which casts again if it is
    asked for only then.
    """

    def __init__(self, cast: Callable[[], _core.Cast]) -> None:
        self._make = cast
        self._kept: _core.Cast | None = cast()
        self.truth: Truth = _LazyTruth.of(self)

    @property
    def cast(self) -> _core.Cast:
        """The ray cast."""
        kept = self._kept
        return self._make() if kept is None else kept

    def forget(self) -> None:
        """Keep the ray cast no longer, because another object is in front of the bench."""
        self._kept = None


class _LazyTruth(Truth):
    """A truth that computes each of its maps when it is first asked for, and shares it, read-only, between shots."""

    _seen: Seen

    @classmethod
    def of(cls, seen: Seen) -> _LazyTruth:
        truth = object.__new__(cls)
        truth.__dict__["_seen"] = seen
        return truth

    @cached_property
    def column_px(self) -> NDArray[np.float32]:
        return _read_only(self._seen.cast.column_px())

    @cached_property
    def xyz_mm(self) -> NDArray[np.float32]:
        return _read_only(self._seen.cast.xyz_mm())

    @cached_property
    def shadow(self) -> NDArray[np.bool_]:
        return _read_only(self._seen.cast.shadow())

    @cached_property
    def edge(self) -> NDArray[np.bool_]:
        return _read_only(self._seen.cast.is_near_edge(EDGE_PX))

    def __getstate__(self) -> dict[str, Any]:
        """Give the maps, which another process cannot compute."""
        return {name: getattr(self, name) for name in ("column_px", "xyz_mm", "shadow", "edge")}


def _read_only(values: Array) -> Array:
    values.flags.writeable = False
    return values
