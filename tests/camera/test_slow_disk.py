"""`quadfringe record` from a camera to a disk that is too slow for some seconds."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

from support.host_faults import VARIABLE, HostFaults, faulty_host

from quadfringe.devices.emulator import Emulator
from quadfringe.recording import Recording

SLOW_S = 5.0  # 64 shots wait: 2.1 s at 30 Hz
SYSTEM = """
[capture]
kind = "aravis"
timeout_s = 10.0
visible.device = "{}"
infrared.device = "{}"
"""


def test_shots_that_a_slow_disk_loses_fail_the_recording(emulator: Emulator, tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM.format(*emulator.addresses))
    take, environment = tmp_path / "take.h5", faulty_host(tmp_path)
    faults = HostFaults(Path(environment[VARIABLE]))
    program = [sys.executable, "-m", "quadfringe", "record", tmp_path / "system.toml", "--out", take, "--json", "-"]
    with subprocess.Popen(
        program, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as recording:
        end_s = time.monotonic() + 60
        while not take.exists() and time.monotonic() < end_s:
            time.sleep(0.05)
        time.sleep(1.0)
        faults.set_disk(0.2)
        time.sleep(SLOW_S)
        faults.set_disk(0.0)
        time.sleep(4.0)
        recording.terminate()
        out, told = recording.communicate(timeout=60)
    assert recording.returncode == 1, told
    figures = json.loads(out)["figures"]
    assert figures["dropped"] > 30
    assert told.count("shots are lost: the disk is slower than the camera") == 1
    assert "every shot is recorded again" in told
    assert f"{figures['dropped']} shots were not recorded" in told
    with Recording(take) as recorded:
        assert len(recorded) == figures["written"]
        assert recorded.verify().damaged == ()
        assert not recorded.faults
        missing = [b.id - a.id - 1 for a, b in zip(recorded, list(recorded)[1:], strict=False)]  # type: ignore[operator]
    assert sum(missing) == figures["dropped"]
    assert not any(missing[-60:]), "the last two seconds are complete"
