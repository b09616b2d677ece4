"""The clock of stamps proceeds evenly while a stream runs, although the clock of the host is set."""

from __future__ import annotations

import time

import pytest

import quadfringe as qf
from quadfringe.data.host_clock import Clocks, HostClock
from quadfringe.devices.aravis._arrival import KEPT_NS, ArrivalTimes

HOUR_NS = 3600 * 10**9


class Host:
    """The two clocks of a host under control of a test."""

    def __init__(self) -> None:
        self.monotonic_ns, self.ahead_ns = 10**12, 18 * 10**17

    @property
    def utc_ns(self) -> int:
        return self.monotonic_ns + self.ahead_ns


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> Host:
    host = Host()
    monkeypatch.setattr(time, "monotonic_ns", lambda: host.monotonic_ns)
    monkeypatch.setattr(time, "time_ns", lambda: host.utc_ns)
    return host


def test_a_held_clock_is_not_set_and_the_next_stream_takes_the_new_time(host: Host) -> None:
    clock = HostClock()
    with clock.held():
        begin_ns = clock.now_ns()
        host.ahead_ns += HOUR_NS
        host.monotonic_ns += 10**9
        with clock.held():
            assert clock.now_ns() - begin_ns == 10**9
        assert clock.now_ns() - begin_ns == 10**9
    assert clock.now_ns() - begin_ns == 10**9, "what still waits after a stream has the time of the stream"
    with clock.held():
        assert clock.now_ns() - begin_ns == HOUR_NS + 10**9


@pytest.mark.parametrize("step_s", [7 * 86400.0, 3600.0, 0.5, -0.5, -3600.0, -7 * 86400.0])
def test_arrivals_before_and_after_a_set_clock_keep_their_order(host: Host, step_s: float) -> None:
    """Frames arrive every 30 ms and wait 50 ms; the clock is set between the arrival of two and their reading."""
    arrivals, due, found = ArrivalTimes(), [], []
    for number in range(200):
        if number in (100, 103):
            host.ahead_ns += int(step_s * 1e9) * (1 if number == 100 else -2)
        due.append((host.monotonic_ns, host.utc_ns))
        host.monotonic_ns += 30_000_000
        if len(due) > 2:
            arrived_ns, utc_ns = due.pop(0)
            found.append(arrivals.monotonic_ns(utc_ns) - arrived_ns)
    assert found == [0] * len(found)
    assert len(found) == 198


def test_a_difference_before_a_step_is_forgotten(host: Host) -> None:
    arrivals = ArrivalTimes()
    host.ahead_ns += HOUR_NS
    arrivals.monotonic_ns(host.utc_ns)
    assert len(arrivals._earlier) == 1
    host.monotonic_ns += KEPT_NS + 1
    arrivals.monotonic_ns(host.utc_ns)
    assert not arrivals._earlier


def test_clocks_are_read_together_on_a_busy_host(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    delays_ns = iter([5_000_000, 7_000_000, 0])

    def read_after_a_delay() -> int:
        utc_ns = host.utc_ns
        host.monotonic_ns += next(delays_ns)
        return utc_ns

    monkeypatch.setattr(time, "time_ns", read_after_a_delay)
    assert Clocks.read().difference_ns == host.ahead_ns


def test_stamps_of_the_virtual_camera_proceed_evenly(host: Host) -> None:
    times_us = []
    with qf.open(qf.SystemConfig()) as scanner:
        scanner.projector.show(scanner.config.fringes)
        for shot in scanner.camera.stream(3):
            host.ahead_ns -= HOUR_NS
            host.monotonic_ns += 1000
            assert shot.stamp is not None
            times_us.append(shot.stamp.time_us)
    assert times_us == [times_us[0], times_us[0] + 1, times_us[0] + 2]
