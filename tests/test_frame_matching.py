"""Matching of frames: the truth is the number of the exposure, which the matcher does not use."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from quadfringe.data import FrameStamp
from quadfringe.devices.aravis._frame_matching import CALM, SHORT_IDS, WINDOW, FrameMatcher, FrameNumbers, SingleChip

PERIOD_NS = 33_333_333
TOLERANCE_NS = 2e6
Frame = tuple[int, int, FrameStamp]  # chip, exposure, stamp


def exposures(
    seed: int,
    count: int = 2000,
    *,
    offset_s: float = 5000.0,
    drift_ppm: float = 50.0,
    lost: float = 0.01,
    skipped: float = 0.01,
    jitter_ms: float = 3.0,
    stall: tuple[int, int] = (0, 0),
    late_start: int = 4,
) -> Iterator[Frame]:
    """Frames of two chips in the order of their arrival.

    `lost` frames never arrive; `skipped` is how often an id is passed over for nothing. From `stall[0]` on
    chip 1 is held up for `stall[1]` exposures, and everything comes at once. Chip 1 starts some exposures late.
    """
    random = np.random.default_rng(seed)
    frames: list[Frame] = []
    ids = [int(n) for n in random.integers(1, SHORT_IDS, 2)]
    held_until = (sum(stall) + 1) * PERIOD_NS
    for exposure in range(count):
        instant = exposure * PERIOD_NS
        device = (instant + 7 * 10**9, int(instant * (1 + drift_ppm * 1e-6) + offset_s * 1e9))
        for chip in (0, 1):
            if chip == 1 and exposure < late_start:
                continue
            ids[chip] += 1 + (chip == 1 and random.random() < skipped)
            ids[chip] = (ids[chip] - 1) % SHORT_IDS + 1
            arrival = instant + 8_000_000 + int(random.exponential(jitter_ms) * 1e6)
            if chip == 1 and stall[0] <= exposure < sum(stall):
                arrival = held_until + exposure * 1000
            if random.random() >= lost:
                frames.append((chip, exposure, FrameStamp(ids[chip], device[chip], 10**18 + arrival)))
    # A chip's frames arrive in their order.
    latest = [0, 0]
    for index, (chip, exposure, stamp) in enumerate(frames):
        latest[chip] = max(latest[chip] + 1, stamp.arrival_ns)
        frames[index] = chip, exposure, FrameStamp(stamp.id, stamp.device_ns, latest[chip])
    return iter(sorted(frames, key=lambda frame: frame[2].arrival_ns))


def paired(matcher: FrameMatcher[int], frames: Iterator[Frame]) -> list[tuple[int, int]]:
    found = []
    for chip, exposure, stamp in frames:
        found += [(a.item, b.item) for a, b in matcher.push(chip, stamp, exposure)]
    matcher.end()
    return found


@pytest.mark.parametrize("seed", range(20))
def test_every_pair_is_of_one_exposure(seed: int) -> None:
    """The bar: 5000 s of offset, 50 ppm of drift, ids that jump, one frame in a hundred lost."""
    frames = list(exposures(seed))
    seen = [{exposure for chip, exposure, _ in frames if chip == wanted} for wanted in (0, 1)]
    matcher: FrameMatcher[int] = FrameMatcher(TOLERANCE_NS)
    pairs = paired(matcher, iter(frames))
    assert all(a == b for a, b in pairs)
    assert {a for a, _ in pairs} == seen[0] & seen[1], "and every exposure that both chips have is there"
    assert matcher.unpaired == [len(seen[0] - seen[1]), len(seen[1] - seen[0])]
    assert matcher.missed[1] >= 2000 * 0.01 / 2


@pytest.mark.parametrize("offset_s", [-5000.0, 0.0, 1e6])
@pytest.mark.parametrize("drift_ppm", [-100.0, 0.0, 100.0])
def test_any_offset_and_drift(offset_s: float, drift_ppm: float) -> None:
    pairs = paired(FrameMatcher(TOLERANCE_NS), exposures(1, offset_s=offset_s, drift_ppm=drift_ppm, lost=0.0))
    assert len(pairs) == 2000 - 4
    assert all(a == b for a, b in pairs)


@pytest.mark.parametrize("start", [0, 3, 4, 5, 6, 8, 100])
@pytest.mark.parametrize("length", [1, 2, 3, 7, 20])
def test_a_host_that_stalls_makes_no_wrong_pair(start: int, length: int) -> None:
    pairs = paired(FrameMatcher(TOLERANCE_NS), exposures(2, stall=(start, length), jitter_ms=1.0))
    assert all(a == b for a, b in pairs)
    assert len(pairs) > 1800


def test_the_start_of_one_chip_may_be_missed() -> None:
    pairs = paired(FrameMatcher(TOLERANCE_NS), exposures(3, late_start=40, lost=0.0))
    assert pairs == [(n, n) for n in range(40, 2000)]


def test_a_silent_chip_is_counted_and_nothing_grows() -> None:
    matcher: FrameMatcher[int] = FrameMatcher(TOLERANCE_NS)
    pairs = paired(matcher, (frame for frame in exposures(4) if frame[0] == 0))
    assert pairs == []
    assert matcher.unpaired[0] > 1900


def test_one_trigger_one_pair() -> None:
    """The first two frames that answer a software trigger need no clock."""
    matcher: FrameMatcher[str] = FrameMatcher(TOLERANCE_NS)
    matcher.begin(sole=True)
    assert matcher.push(1, FrameStamp(9, 5, 10**18), "b") == []
    ((a, b),) = matcher.push(0, FrameStamp(1, 777_000_000, 10**18 + 9), "a")
    assert (a.item, b.item) == ("a", "b")
    # The next trigger is answered by one chip alone, the one after by both.
    assert matcher.push(0, FrameStamp(2, 877_000_000, 10**18 + 100_000_000), "lost partner") == []
    assert matcher.push(1, FrameStamp(11, 200_000_005, 10**18 + 200_000_000), "d") == []
    ((c, d),) = matcher.push(0, FrameStamp(3, 977_000_000, 10**18 + 200_000_000), "c")
    assert (c.item, d.item) == ("c", "d")
    assert matcher.unpaired == [1, 0]
    assert matcher.missed == [0, 1]


def test_clocks_that_begin_anew_are_compared_anew() -> None:
    matcher: FrameMatcher[int] = FrameMatcher(TOLERANCE_NS)
    assert len(paired(matcher, exposures(5, 300, lost=0.0))) == 296
    matcher.begin()
    again = paired(matcher, exposures(6, 300, lost=0.0, offset_s=-3.0))
    assert all(a == b for a, b in again)
    assert len(again) > 270


@pytest.mark.parametrize("idle_s", [1.0, 5.0, 15.0, 60.0, 3600.0])
def test_a_pause_makes_no_wrong_pair(idle_s: float) -> None:
    """After an hour the clocks are 180 ms apart: other exposures look like partners then."""
    matcher: FrameMatcher[int] = FrameMatcher(TOLERANCE_NS)
    pause = round(idle_s * 1e9 / PERIOD_NS)
    frames = list(exposures(8, pause + 400, lost=0.05, late_start=0))
    found = []
    for part in (range(200), range(pause + 200, pause + 400)):
        matcher.begin()
        found += paired(matcher, (frame for frame in frames if frame[1] in part))
    assert all(a == b for a, b in found)
    assert len(found) > 300


@pytest.mark.parametrize("period_s", [0.01, 1.0, 20.0])
def test_exposures_of_any_pace(period_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("test_frame_matching.PERIOD_NS", round(period_s * 1e9))
    pairs = paired(FrameMatcher(TOLERANCE_NS), exposures(9, 200, jitter_ms=0.5))
    assert all(a == b for a, b in pairs)
    assert len(pairs) > 180


def test_extended_ids_do_not_wrap() -> None:
    numbers = FrameNumbers()
    assert [numbers(number) for number in (65534, 65535, 65536, 65538)] == [0, 1, 2, 4]
    assert numbers.missed == 1
    assert numbers(1) == 5, "a device that begins anew skipped nothing"
    assert numbers.missed == 1


# Clocks that wrap around or are set anew


def wrapped(frames: Iterator[Frame], bits: int) -> Iterator[Frame]:
    """Let the device clocks count with so many bits, ns; 32 bits wrap around every 4.3 s, at another instant each."""
    for chip, exposure, stamp in frames:
        yield chip, exposure, FrameStamp(stamp.id, stamp.device_ns % (1 << bits), stamp.arrival_ns)


def host_times(matcher: FrameMatcher[int], frames: Iterator[Frame]) -> list[tuple[int, int, float]]:
    """Give both exposures of every pair, and by how much its time lags behind its arrival, s."""
    found = []
    for chip, exposure, stamp in frames:
        for first, second in matcher.push(chip, stamp, exposure):
            late_ns = first.stamp.arrival_ns - first.stamp.device_ns - matcher.host_offset_ns
            found.append((first.item, second.item, late_ns / 1e9))
    return found


@pytest.mark.parametrize("offset_s", [0.0, 5000.0, 2.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_device_clock_that_wraps_around_makes_no_wrong_pair(seed: int, offset_s: float) -> None:
    matcher: FrameMatcher[int] = FrameMatcher(TOLERANCE_NS)
    found = host_times(matcher, wrapped(exposures(seed, 1000, offset_s=offset_s), 32))
    assert [one for one in found if one[0] != one[1]] == []
    assert len(found) > 700
    assert max(abs(late_s) for *_, late_s in found) < 0.1, "the time of a shot is off by a turn of the clock"


def test_a_single_chip_whose_clock_wraps_around_keeps_the_time() -> None:
    chip: SingleChip[int] = SingleChip()
    for number, exposure, stamp in wrapped(exposures(1, 600), 32):
        if number == 0:
            chip.push(0, stamp, exposure)
            assert abs(stamp.arrival_ns - stamp.device_ns - chip.host_offset_ns) < 1e8


@pytest.mark.parametrize("jump_s", [3600.0, 0.5, -0.5, -3600.0])
def test_arrival_times_that_jump_make_no_wrong_pair(jump_s: float) -> None:
    """The host offset follows times that jump back at once, and forward when no older frame is compared."""
    matcher: FrameMatcher[int] = FrameMatcher(TOLERANCE_NS)
    frames = [
        (
            chip,
            exposure,
            FrameStamp(stamp.id, stamp.device_ns, stamp.arrival_ns + (exposure >= 500) * int(jump_s * 1e9)),
        )
        for chip, exposure, stamp in exposures(3, 1500)
    ]
    found = host_times(matcher, iter(frames))
    assert [one for one in found if one[0] != one[1]] == []
    assert len(found) > 1350
    after = [late_s for exposure, _, late_s in found if exposure >= (500 + WINDOW + CALM)]
    assert len(after) > 500
    assert max(abs(late_s) for late_s in after) < 0.1


def test_ids_of_sixteen_bits_wrap_around_without_a_gap() -> None:
    matcher: FrameMatcher[int] = FrameMatcher(TOLERANCE_NS)
    shift = SHORT_IDS - 300
    frames = [
        (chip, exposure, FrameStamp((exposure + shift - 1) % SHORT_IDS + 1, stamp.device_ns, stamp.arrival_ns))
        for chip, exposure, stamp in exposures(4, 600, lost=0.0, skipped=0.0, late_start=0)
    ]
    numbers = [first.number for frame in frames for first, _ in matcher.push(frame[0], frame[2], frame[1])]
    assert numbers == list(range(600))
    assert (matcher.missed, matcher.unpaired) == ([0, 0], [0, 0])
