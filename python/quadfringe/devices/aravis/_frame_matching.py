"""Which frames of two chips were exposed at the same instant, told from two clocks that know nothing of each other.

A device clock has any offset and drifts by up to 100 ppm; frame numbers start anywhere and jump. What holds is that a
frame arrives after its exposure, later by a delay that has a minimum. So the running minimum of arrival minus device
time maps each clock to the host's, as well as the delays are alike; that is enough to tell one exposure from the next.
From then on pairs are told by the device clocks alone: their difference within a pair creeps, and never jumps.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic, TypeVar

from quadfringe.data import FrameStamp

__all__ = ["Clock", "FrameMatcher", "FrameNumbers", "SingleChip", "Stamped"]

WINDOW = 256  # frames that the running minimum looks back: 50 ppm make 0.4 ms of it at 30 Hz
CALM = 8  # frames in a row that come evenly, within this share of a period: then nothing holds the host up
EVEN = 0.25
MANY = 32  # or so many frames, one of which came without delay
PENDING = 64  # frames of one chip that may wait for the other
DRIFT = 2e-4  # how fast the clocks may part while no pair is seen: twice the 100 ppm of a bad pair of crystals
FRESH_NS = 1_000_000_000  # a difference that was not seen for so long is taken anew from the first pair
MISSES = 8  # frames without a partner after which the difference is not believed any more
GAIN = 0.1  # how fast the difference of the clocks is followed
SHORT_IDS = 65535  # ids of GigE Vision without extended ids run from 1 to here, and then from 1 again

Item = TypeVar("Item")


class FrameNumbers:
    """Device ids as numbers that grow for ever, and how many were skipped.

    >>> numbers = FrameNumbers()
    >>> [numbers(id) for id in (65533, 65534, 2, 3)], numbers.missed
    ([0, 1, 4, 5], 2)
    """

    def __init__(self) -> None:
        self.missed = 0
        self._last: int | None = None
        self._number = 0

    def __call__(self, id: int) -> int:  # noqa: A002 - what GigE Vision calls it
        """Give the number of the frame with this id."""
        if self._last is not None:
            step = id - self._last if id > self._last else id - self._last + SHORT_IDS
            # An id that goes back by little is a device that began anew, not one that skipped tens of thousands.
            step = step if 0 < step < SHORT_IDS // 2 else 1
            self.missed += step - 1
            self._number += step
        self._last = id
        return self._number


class Clock:
    """One device clock on the host's: the running minimum of arrival minus device time."""

    def __init__(self) -> None:
        self._falling: deque[tuple[int, int]] = deque()  # frame and offset: those that may become the minimum
        self._recent: deque[int] = deque(maxlen=CALM)
        self._frames = 0

    @property
    def offset_ns(self) -> int:
        """Host time minus device time, with the shortest delay of a frame in it."""
        return self._falling[0][1]

    def settled(self, period_ns: float) -> bool:
        """Whether the minimum can be believed to a part of the period: frames came evenly, or there were many.

        A host that is held up, or catches up, sees them come unevenly, and its shortest delay may be long.
        """
        calm = len(self._recent) == CALM and max(self._recent) - min(self._recent) <= EVEN * period_ns
        return calm or self._frames >= MANY

    def see(self, stamp: FrameStamp) -> None:
        """Look at one more frame."""
        offset = stamp.arrival_ns - stamp.device_ns
        self._recent.append(offset)
        while self._falling and self._falling[-1][1] >= offset:
            self._falling.pop()
        self._falling.append((self._frames, offset))
        if self._falling[0][0] <= self._frames - WINDOW:
            self._falling.popleft()
        self._frames += 1


@dataclass(frozen=True)
class Stamped(Generic[Item]):
    """A frame with its stamp and its number in the stream."""

    stamp: FrameStamp
    number: int
    item: Item


class SingleChip(Generic[Item]):
    """The frames of one chip as they come, numbered and counted as `FrameMatcher` does it; nothing waits."""

    def __init__(self) -> None:
        self.unpaired, self.missed = [0], [0]
        self._clock = Clock()
        self.begin()

    def begin(self, *, sole: bool = False, pending: int = PENDING) -> None:  # noqa: ARG002 - there is nothing to match
        """Start a run: ids may begin anew."""
        self._numbers = FrameNumbers()

    def end(self) -> None:
        """Nothing waits."""

    def push(self, chip: int, stamp: FrameStamp, item: Item) -> list[tuple[Stamped[Item], ...]]:
        """Take a frame and give it back."""
        before = self._numbers.missed
        number = self._numbers(stamp.id)
        self.missed[chip] += self._numbers.missed - before
        self._clock.see(stamp)
        return [(Stamped(stamp, number, item),)]

    @property
    def host_offset_ns(self) -> int:
        """Host time minus device time."""
        return self._clock.offset_ns


class FrameMatcher(Generic[Item]):
    """Matches the frames of two chips that are exposed together; feed it frames in the order of their arrival.

    Until both clocks have settled frames wait, 8 of each chip as a rule. `begin` starts a run of the camera; the clocks
    are remembered from one run to the next.
    """

    def __init__(self, tolerance_ns: float) -> None:
        self.unpaired = [0, 0]
        self.missed = [0, 0]
        self._tolerance = tolerance_ns
        self._believed: tuple[int, int] | None = None  # offsets of the clocks when their difference was found
        self._difference: float | None = None  # clock of chip 0 minus that of chip 1, within a pair
        self._agreed_at = 0  # device time of chip 0 when it was last seen
        self._host_offset_ns = 0
        self._period = 0  # least time between two exposures
        self._waiting: tuple[deque[Stamped[Item]], deque[Stamped[Item]]] = (deque(), deque())
        self._forget()
        self.begin()

    def begin(self, *, sole: bool = False, pending: int = PENDING) -> None:
        """Start a run: ids may begin anew, and `pending` frames of a chip may wait for the other.

        With `sole` the first two frames answer one trigger and are a pair, whatever the clocks say.
        """
        self.end()
        self._pending = pending
        self._sole = sole
        self._numbers = (FrameNumbers(), FrameNumbers())

    def end(self) -> None:
        """Count what still waits; nothing follows."""
        for chip, queue in enumerate(self._waiting):
            self.unpaired[chip] += len(queue)
            queue.clear()

    def push(self, chip: int, stamp: FrameStamp, item: Item) -> list[tuple[Stamped[Item], Stamped[Item]]]:
        """Take a frame of chip 0 or 1; give the pairs that are complete now, and drop what has no partner."""
        numbers = self._numbers[chip]
        before = numbers.missed
        self._waiting[chip].append(Stamped(stamp, numbers(stamp.id), item))
        self.missed[chip] += numbers.missed - before
        self._look_at_clock(chip, stamp)
        while len(self._waiting[chip]) > self._pending:
            self._give_up(chip)
        if self._difference is None and not self._agree():
            return []
        return self._matches()

    @property
    def host_offset_ns(self) -> int:
        """Host time minus the device time of chip 0."""
        return self._host_offset_ns

    def _look_at_clock(self, chip: int, stamp: FrameStamp) -> None:
        """Forget the difference when a delay far below those that it was found by tells that it was wrong."""
        self._clocks[chip].see(stamp)
        if chip == 0:
            self._host_offset_ns = self._clocks[0].offset_ns
        if self._difference is not None and self._believed is not None:
            earlier = self._believed[chip] - (stamp.arrival_ns - stamp.device_ns)
            if earlier > self._period / 2 + DRIFT * abs(stamp.arrival_ns - self._believed_at):
                self._forget()

    def _forget(self) -> None:
        self._difference, self._believed, self._believed_at = None, None, 0
        self._misses = 0
        self._clocks = (Clock(), Clock())

    def _agree(self) -> bool:
        """Find the difference of the clocks, once both can be believed."""
        first, second = self._waiting
        if not (first and second):
            return False
        if self._sole:
            self._difference = float(first[0].stamp.device_ns - second[0].stamp.device_ns)
            self._agreed_at = first[0].stamp.device_ns
            return True
        times = _times(first), _times(second)
        self._period = _least_step(*times)
        if all(clock.settled(self._period) for clock in self._clocks):
            offsets = self._clocks[0].offset_ns, self._clocks[1].offset_ns
            self._difference = _difference(*times, guess=offsets[1] - offsets[0], reach=self._period / 2)
            self._believed, self._believed_at = offsets, first[-1].stamp.arrival_ns
        self._agreed_at = first[0].stamp.device_ns
        return self._difference is not None

    def _matches(self) -> list[tuple[Stamped[Item], Stamped[Item]]]:
        pairs: list[tuple[Stamped[Item], Stamped[Item]]] = []
        first, second = self._waiting
        while first and second and self._difference is not None:
            apart = first[0].stamp.device_ns - second[0].stamp.device_ns - self._difference
            since = abs(first[0].stamp.device_ns - self._agreed_at)
            if not self._sole and DRIFT * since > self._period / 4:
                # The clocks may have parted by so much that another exposure lies nearer.
                self._forget()
            elif abs(apart) <= self._tolerance + DRIFT * since:
                self._difference += apart if since > FRESH_NS else GAIN * apart
                self._agreed_at = first[0].stamp.device_ns
                self._misses = 0
                pairs.append((first.popleft(), second.popleft()))
            else:
                self._give_up(0 if apart < 0 else 1)
                self._misses += 1
                if self._misses >= MISSES:
                    self._forget()
        return pairs

    def _give_up(self, chip: int) -> None:
        self._waiting[chip].popleft()
        self.unpaired[chip] += 1


def _times(frames: Sequence[Stamped[Item]]) -> list[int]:
    return [frame.stamp.device_ns for frame in frames]


def _least_step(*streams: list[int]) -> int:
    return min((b - a for times in streams for a, b in pairwise(times)), default=0)


def _difference(first: list[int], second: list[int], *, guess: float, reach: float) -> float | None:
    """Give the difference of the clocks that two frames have and that lies nearest to `guess`, within `reach`.

    Exposures are twice the reach apart at least, and delays of the chips differ by less, so that the nearest is right.
    """
    nearest = min((a - b for a in first for b in second), key=lambda difference: abs(difference - guess))
    return float(nearest) if abs(nearest - guess) < reach else None
