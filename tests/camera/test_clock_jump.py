"""The clock of the host is set by hours and days while frames come: nothing is lost, and times proceed evenly."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from support.host_faults import faulty_host

from quadfringe.devices.emulator import Emulator
from quadfringe.recording import Recording

HERE = Path(__file__).parent
PERIOD_US = 33_333


def test_a_host_clock_that_is_set_disturbs_nothing(emulator: Emulator, tmp_path: Path) -> None:
    take = tmp_path / "take.h5"
    program = [sys.executable, HERE / "stream_on_a_set_clock.py", *emulator.addresses, take]
    environment = faulty_host(tmp_path)
    environment["PYTHONPATH"] = ":".join([str(HERE.parent), environment.get("PYTHONPATH", "")])
    ran = subprocess.run(program, env=environment, stdout=subprocess.PIPE, text=True, check=True, timeout=90)
    found = json.loads(ran.stdout)
    hours = [round(ahead_s / 3600) for ahead_s in found["set_s"]]
    assert (min(hours), max(hours)) == (-5, 7 * 24), "the clock was not set"
    exposures, times_us, first_us, second_us, latency_ms = np.array(found["rows"]).T
    np.testing.assert_array_equal(np.diff(exposures), 1)
    assert found["lost"] == [0, 0, 0]
    for passed_us, jitter_us in ((times_us, 30_000), (first_us, 300_000), (second_us, 300_000)):
        assert abs(np.diff(passed_us) - PERIOD_US).max() < jitter_us, "a time jumped"
    assert latency_ms.min() > 0
    assert latency_ms.max() < 5000
    assert abs(found["again_s"]) < 5, "the next stream has the time of the host"
    with Recording(take) as recorded:
        np.testing.assert_array_equal(recorded.times_us, times_us.astype(np.int64))
