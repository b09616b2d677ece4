"""Stream from an emulated camera while the clock of the host is set; `test_clock_jump.py` runs this in a child process.

Arguments: both addresses of the camera, and the recording to write. Prints what came as JSON.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from support.host_faults import faults_of_this_process
from wire import checked_exposure

from quadfringe.config.cameras import AravisConfig, ChipConfig
from quadfringe.data import AnyShot, Shape
from quadfringe.devices.aravis import AravisCamera
from quadfringe.recording import Recorder
from quadfringe.scanner.streaming import LiveStream

AHEAD_S = {30: 2 * 3600.0, 60: -5 * 3600.0, 75: -5 * 3600.0 + 0.4, 90: 7 * 86400.0}  # from this shot on
SHOTS = 120
FLAT = Shape(*[np.zeros((2, 2), np.float32)] * 4)


def main() -> None:
    visible, infrared = (ChipConfig(device=address) for address in sys.argv[1:3])
    faults = faults_of_this_process()

    def decode(_shot: AnyShot) -> Shape:
        return FLAT

    rows, set_s = [], []
    begin_s = time.time() - time.monotonic()
    with AravisCamera(AravisConfig(visible=visible, infrared=infrared, timeout_s=6.0)) as camera:
        with (
            Recorder(Path(sys.argv[3])) as recorder,
            LiveStream(camera, decode, SHOTS, keep="all", taps={"record": recorder.write}) as stream,
        ):
            for number, measured in enumerate(stream):
                stamp = measured.shot.stamp
                assert stamp is not None
                arrivals_us = [frame.arrival_ns / 1000 for frame in stamp.frames.values()]
                rows.append([checked_exposure(measured.shot), stamp.time_us, *arrivals_us, measured.latency_ms])
                set_s.append(time.time() - time.monotonic() - begin_s)
                if number in AHEAD_S:
                    faults.set_clock(AHEAD_S[number])
        counted = camera.statistics()
        stamp = camera.snap().stamp
        assert stamp is not None
        again_s = time.time() - stamp.time_us / 1e6
    lost = [counted.dropped, counted.damaged, counted.missed]
    print(json.dumps({"rows": rows, "set_s": set_s, "again_s": again_s, "lost": lost}))


main()
