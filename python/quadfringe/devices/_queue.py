"""A bounded queue between two threads that drops its oldest item when full, and counts the dropped items."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass
from time import monotonic
from typing import Generic, TypeVar

__all__ = ["DroppingQueue", "EndOfQueue", "QueueStatistics"]

Item = TypeVar("Item")


class EndOfQueue(Exception):  # noqa: N818 - the end, not an error
    """The queue is empty and has ended."""


@dataclass(frozen=True)
class QueueStatistics:
    """Numbers of items that wait, that were taken, and that were dropped."""

    waiting: int
    passed: int
    dropped: int


class DroppingQueue(Generic[Item]):
    """A queue of at most `length` items between two threads, first in, first out.

    >>> queue = DroppingQueue(2)
    >>> for number in range(5):
    ...     queue.put(number)
    >>> queue.get(), queue.statistics()
    (3, QueueStatistics(waiting=1, passed=1, dropped=3))
    """

    def __init__(self, length: int) -> None:
        self._items: deque[Item] = deque()
        self._length = length
        self._changed = threading.Condition()
        self._ended = False
        self._error: BaseException | None = None
        self._passed = self._dropped = 0

    def put(self, item: Item, *, wait: bool = False) -> None:
        """Add an item. A full queue drops its oldest item, or with `wait` blocks; an ended queue ignores the item."""
        with self._changed:
            while wait and len(self._items) >= self._length and not self._ended:
                self._changed.wait()
            if self._ended:
                return
            while len(self._items) >= self._length:
                self._items.popleft()
                self._dropped += 1
            self._items.append(item)
            self._changed.notify_all()

    def get(self, timeout_s: float | None = None) -> Item:
        """Take the oldest item; raise TimeoutError when none arrives in time, and after the end the error of `end`."""
        deadline = None if timeout_s is None else monotonic() + timeout_s
        with self._changed:
            while not self._items:
                if self._ended:
                    raise self._error or EndOfQueue
                left = None if deadline is None else deadline - monotonic()
                if left is not None and left <= 0:
                    raise TimeoutError(f"no item arrived within {timeout_s:g} s")
                self._changed.wait(left)
            item = self._items.popleft()
            self._passed += 1
            self._changed.notify_all()
            return item

    def end(self, error: BaseException | None = None, *, discard: bool = False) -> None:
        """Accept no more items; waiting items can still be taken unless `discard`. Only the first call counts."""
        with self._changed:
            if not self._ended:
                self._ended, self._error = True, error
            if discard:
                self._items.clear()
            self._changed.notify_all()

    def statistics(self) -> QueueStatistics:
        """Return the counts; safe to call from any thread."""
        with self._changed:
            return QueueStatistics(len(self._items), self._passed, self._dropped)
