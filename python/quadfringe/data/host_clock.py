"""The clock of stamps: UTC that proceeds evenly while a stream runs, although the clock of the host may be set."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock

__all__ = ["HOST_CLOCK", "Clocks", "HostClock"]

TOGETHER_NS = 100_000  # two clocks that were read within this time were read together
READS = 5  # attempts to read them together on a busy host


@dataclass(frozen=True)
class Clocks:
    """The clocks of the host at one instant, ns: the monotonic one, which is never set, and UTC, which may be set."""

    monotonic_ns: int
    utc_ns: int

    @classmethod
    def read(cls) -> Clocks:
        """Read both clocks at nearly the same instant."""
        for _ in range(READS):
            before_ns, utc_ns, after_ns = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
            if after_ns - before_ns < TOGETHER_NS:
                break
        return cls(after_ns, utc_ns)

    @property
    def difference_ns(self) -> int:
        """UTC minus the monotonic clock."""
        return self.utc_ns - self.monotonic_ns


class HostClock:
    """UTC in ns since 1970, as the host had it when the first of the streams that now run began.

    A service, a person or a virtual machine may set the clock of a host by hours. Stamps and latencies of a running
    stream are not disturbed by that, because they count from its beginning on the monotonic clock.

    >>> from quadfringe.data.host_clock import HostClock
    >>> clock = HostClock()
    >>> with clock.held():
    ...     earlier_ns = clock.now_ns()
    ...     earlier_ns <= clock.now_ns()
    True
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._streams = 0
        self._difference_ns = Clocks.read().difference_ns

    @contextmanager
    def held(self) -> Iterator[None]:
        """Let the clock proceed evenly within the block; the first of several blocks takes UTC from the host."""
        with self._lock:
            if not self._streams:
                self._difference_ns = Clocks.read().difference_ns
            self._streams += 1
        try:
            yield
        finally:
            with self._lock:
                self._streams -= 1

    def now_ns(self) -> int:
        """Return UTC, ns since 1970."""
        return self.utc_ns(time.monotonic_ns())

    def utc_ns(self, monotonic_ns: int) -> int:
        """Convert a time of the monotonic clock to UTC, ns since 1970."""
        return monotonic_ns + self._difference_ns


HOST_CLOCK = HostClock()
