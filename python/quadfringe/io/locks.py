"""Locks that survive a fork."""

from __future__ import annotations

import os
from threading import Lock
from weakref import WeakSet

__all__ = ["ForkedLock"]


class ForkedLock:
    """A lock for the threads of one process, free again in a forked child.

    A fork copies a lock as it is, but not the thread that holds it; the copy would be held for ever.

    >>> lock = ForkedLock()
    >>> with lock:
    ...     print("one thread at a time")
    one thread at a time
    """

    def __init__(self) -> None:
        self._lock = Lock()
        _locks.add(self)

    def renew(self) -> None:
        """Free the lock, whoever holds it."""
        self._lock = Lock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_exception: object) -> None:
        self._lock.release()


_locks: WeakSet[ForkedLock] = WeakSet()


def _renew_all() -> None:
    for lock in list(_locks):
        lock.renew()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew_all)
