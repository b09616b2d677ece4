"""Match the frames of two chips that were exposed at the same instant, from two unsynchronised device clocks.

A device clock has an arbitrary offset and drifts by up to 100 ppm; frame numbers start anywhere and may jump. A frame
arrives after its exposure with a delay that has a minimum, so the running minimum of arrival minus device time maps
each device clock to the host clock, up to the difference of the minimal delays. That suffices to tell one exposure
from the next. Afterwards frames are matched by the device clocks alone, whose difference drifts but never jumps. A
clock that goes back, because it wrapped around or the device began anew, is compared anew.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic, TypeVar

from quadfringe.data import FrameStamp

__all__ = ["Clock", "FrameMatcher", "FrameNumbers", "SingleChip", "Stamped"]

# Checked by pytest tests/test_frame_matching.py against exposure numbers that the matcher never sees.
WINDOW = 256  # frames of the running minimum: over them a drift of 50 ppm adds 0.4 ms at 30 Hz
CALM = 8  # consecutive frames whose delays agree within EVEN: the host is then keeping up
EVEN = 0.25  # share of a frame period
MANY = 32  # number of frames among which one had no delay, even if they arrive unevenly
PENDING = 64  # frames of one chip that may wait for a partner: two seconds at 30 Hz
DRIFT = 2e-4  # relative rate at which the clocks may drift apart without a match: twice the 100 ppm of a poor crystal
FRESH_NS = 1_000_000_000  # age, ns, above which a clock difference is replaced, not smoothed, by the next match
MISSES = 8  # consecutive frames without a partner after which the clock difference is discarded
GAIN = 0.1  # share by which each match corrects the clock difference: larger follows drift, smaller averages jitter
SHORT_IDS = 65535  # GigE Vision ids without extension run from 1 to this value and then from 1 again

Item = TypeVar("Item")


class FrameNumbers:
    """Converts device ids to numbers that never wrap around, and counts skipped ones.

    >>> numbers = FrameNumbers()
    >>> [numbers(id) for id in (65533, 65534, 2, 3)], numbers.missed
    ([0, 1, 4, 5], 2)
    """

    def __init__(self) -> None:
        self.missed = 0
        self._last: int | None = None
        self._number = 0

    def __call__(self, id: int) -> int:  # noqa: A002 - what GigE Vision calls it
        """Return the number of the frame with this id."""
        if self._last is not None:
            step = id - self._last if id > self._last else id - self._last + SHORT_IDS
            # A small step back means that the device restarted, not that it skipped tens of thousands of frames.
            step = step if 0 < step < SHORT_IDS // 2 else 1
            self.missed += step - 1
            self._number += step
        self._last = id
        return self._number


class Clock:
    """Offset of one device clock to the host clock: the running minimum of arrival minus device time."""

    def __init__(self) -> None:
        self._falling: deque[tuple[int, int]] = deque()  # frame number and offset of the candidates for the minimum
        self._recent: deque[int] = deque(maxlen=CALM)
        self._frames = 0
        self._device_ns: int | None = None

    def went_back(self, stamp: FrameStamp) -> bool:
        """Say whether the device clock began anew or wrapped around since the frame before."""
        return self._device_ns is not None and stamp.device_ns < self._device_ns

    @property
    def offset_ns(self) -> int:
        """Host time minus device time, plus the shortest delay of a frame."""
        return self._falling[0][1]

    def settled(self, period_ns: float) -> bool:
        """Return whether the minimum is accurate to a fraction of the period: frames came evenly, or there were many.

        On a host that is delayed or catching up, frames arrive unevenly and the shortest delay may be long.
        """
        calm = len(self._recent) == CALM and max(self._recent) - min(self._recent) <= EVEN * period_ns
        return calm or self._frames >= MANY

    def see(self, stamp: FrameStamp) -> None:
        """Add the stamp of a frame."""
        self._device_ns = stamp.device_ns
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
    """The frames of one chip without matching, numbered and counted as by `FrameMatcher`."""

    def __init__(self) -> None:
        self.unpaired, self.missed = [0], [0]
        self._clock = Clock()
        self.begin()

    def begin(self, *, sole: bool = False, pending: int = PENDING) -> None:  # noqa: ARG002 - one chip needs no matching
        """Start a run; ids may start again."""
        self._numbers = FrameNumbers()

    def end(self) -> None:
        """Do nothing: no frame waits."""

    def push(self, chip: int, stamp: FrameStamp, item: Item) -> list[tuple[Stamped[Item], ...]]:
        """Return the frame as a match of one."""
        before = self._numbers.missed
        number = self._numbers(stamp.id)
        self.missed[chip] += self._numbers.missed - before
        if self._clock.went_back(stamp):
            self._clock = Clock()
        self._clock.see(stamp)
        return [(Stamped(stamp, number, item),)]

    @property
    def host_offset_ns(self) -> int:
        """Host time minus device time."""
        return self._clock.offset_ns


class FrameMatcher(Generic[Item]):
    """Matches the frames of two chips that are exposed together; takes frames in the order of their arrival.

    Frames wait until both clocks have settled, usually after 8 frames of each chip. `begin` starts a run of the camera;
    the clock offsets are kept from one run to the next.
    """

    def __init__(self, tolerance_ns: float) -> None:
        self.unpaired = [0, 0]
        self.missed = [0, 0]
        self._tolerance = tolerance_ns
        self._believed: tuple[int, int] | None = None  # clock offsets when their difference was determined
        self._difference: float | None = None  # clock of chip 0 minus clock of chip 1, within a match
        self._agreed_at = 0  # device time of chip 0 at the last match
        self._host_offset_ns = 0
        self._period = 0  # shortest time between two exposures
        self._waiting: tuple[deque[Stamped[Item]], deque[Stamped[Item]]] = (deque(), deque())
        self._forget()
        self.begin()

    def begin(self, *, sole: bool = False, pending: int = PENDING) -> None:
        """Start a run; ids may start again, and up to `pending` frames of a chip wait for the other chip.

        With `sole`, the first frames of both chips answer one trigger and match, whatever the clocks say.
        """
        self.end()
        self._pending = pending
        self._sole = sole
        self._numbers = (FrameNumbers(), FrameNumbers())

    def end(self) -> None:
        """End the run: count the waiting frames as unpaired."""
        for chip, queue in enumerate(self._waiting):
            self.unpaired[chip] += len(queue)
            queue.clear()

    def push(self, chip: int, stamp: FrameStamp, item: Item) -> list[tuple[Stamped[Item], Stamped[Item]]]:
        """Take a frame of chip 0 or 1; return the complete matches, and drop frames without a partner."""
        numbers = self._numbers[chip]
        before = numbers.missed
        self._waiting[chip].append(Stamped(stamp, numbers(stamp.id), item))
        self.missed[chip] += numbers.missed - before
        self._update_clock(chip, stamp)
        while len(self._waiting[chip]) > self._pending:
            self._give_up(chip)
        if self._difference is None and not self._find_difference():
            return []
        return self._matches()

    @property
    def host_offset_ns(self) -> int:
        """Host time minus the device time of chip 0."""
        return self._host_offset_ns

    def _update_clock(self, chip: int, stamp: FrameStamp) -> None:
        """Update a clock; discard the clock difference when it no longer holds.

        It does not when the clock of the chip went back, and was wrong when a much shorter delay shows so.
        """
        if self._clocks[chip].went_back(stamp):
            while len(self._waiting[chip]) > 1:  # their times do not compare with later ones
                self._give_up(chip)
            self._forget()
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

    def _find_difference(self) -> bool:
        """Determine the clock difference once both clocks have settled; return whether it is known."""
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
                # The clocks may have drifted so far that another exposure is nearer.
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
    """Return the clock difference of two frames that is nearest to `guess`, or None beyond `reach`.

    Exposures are at least twice the reach apart and the chip delays differ by less, so the nearest one is correct.
    """
    nearest = min((a - b for a in first for b in second), key=lambda difference: abs(difference - guess))
    return float(nearest) if abs(nearest - guess) < reach else None
