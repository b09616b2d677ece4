"""Arrival times of frames: Aravis takes them from UTC of the host, which may be set while frames come."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from quadfringe.data.host_clock import Clocks

__all__ = ["ArrivalTimes"]

STEP_NS = 1_000_000  # a change of the difference of the clocks above this is a set clock, not a delay between two reads
EARLY_NS = 1_000_000  # age below zero that such a delay can cause
KEPT_NS = 10_000_000_000  # how long after a step frames stamped before it may still wait; longer than any frame waits
STEPS = 4  # steps within that time that are remembered


@dataclass(frozen=True)
class _Earlier:
    """A difference of the clocks before a step, and until when, monotonic ns, a frame may still have it."""

    difference_ns: int
    until_ns: int


class ArrivalTimes:
    """Converts arrival times of one stream from UTC of the host to the monotonic clock.

    A frame that came shortly before the clock was set has the earlier time. So the difference of the clocks that makes
    it the youngest, but no frame of the future, is that at its arrival.
    """

    def __init__(self) -> None:
        self._difference_ns = Clocks.read().difference_ns
        self._earlier: deque[_Earlier] = deque(maxlen=STEPS)

    def monotonic_ns(self, utc_ns: int) -> int:
        """Return the arrival time of the frame that was just taken from the stream, on the monotonic clock."""
        now = Clocks.read()
        if abs(now.difference_ns - self._difference_ns) > STEP_NS:
            self._earlier.append(_Earlier(self._difference_ns, now.monotonic_ns + KEPT_NS))
        self._difference_ns = now.difference_ns
        while self._earlier and self._earlier[0].until_ns < now.monotonic_ns:
            self._earlier.popleft()
        arrivals_ns = [utc_ns - now.difference_ns, *(utc_ns - earlier.difference_ns for earlier in self._earlier)]
        past_ns = [arrival_ns for arrival_ns in arrivals_ns if arrival_ns <= now.monotonic_ns + EARLY_NS]
        return max(past_ns, default=now.monotonic_ns)
