"""A stated limit on memory: what does not fit into this machine is refused before it is allocated.

The kernel cannot give memory back when the system refuses it; the process would end without an error.

>>> require_memory("decoding", (1200, 1600), 160)
"""

from __future__ import annotations

import os

from quadfringe.errors import InputError

__all__ = ["memory_bytes", "require_memory"]


def memory_bytes() -> int | None:
    """Return the memory of this machine, bytes; None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def require_memory(work: str, size: tuple[int, int], bytes_per_px: float) -> None:
    """Raise `InputError` if `work` on an image of this size (rows, columns) needs more memory than the machine has."""
    rows, columns = size
    needed, there = rows * columns * bytes_per_px, memory_bytes()
    if there is not None and needed > there:
        raise InputError(
            f"{work}: {columns} x {rows} pixels need about {needed / 1e9:.0f} GB of memory, and this machine has "
            f"{there / 1e9:.0f} GB; use smaller images"
        )
