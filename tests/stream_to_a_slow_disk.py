"""Measure and record while the disk is slow for some time; `test_slow_disk.py` runs this in a child process.

Arguments: the recording to write, and for how many seconds the disk is slow. Prints what happened as JSON.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path

import numpy as np
from support.host_faults import faults_of_this_process

from quadfringe.data import AnyShot, Shape, Shot
from quadfringe.evaluation._live import Carousel
from quadfringe.recording import Recorder
from quadfringe.scanner.streaming import LiveStream

RATE_HZ = 60.0
WRITE_S = 0.2  # a shot needs more than ten writes, some of them in one call, so the disk takes over 100 frame periods
SIDE_PX = 512
FLAT = Shape(*[np.zeros((2, 2), np.float32)] * 4)


def main() -> None:
    faults, slow_s = faults_of_this_process(), float(sys.argv[2])
    blank = np.zeros((SIDE_PX, SIDE_PX), np.uint8)
    camera = Carousel([Shot(blank, blank, blank, blank)], RATE_HZ)
    decoded_s: list[float] = []

    def decode(_shot: AnyShot) -> Shape:
        decoded_s.append(time.monotonic())
        return FLAT

    with Recorder(Path(sys.argv[1])) as recorder, LiveStream(camera, decode, taps={"record": recorder.write}) as stream:  # type: ignore[arg-type]
        for _ in range(20):
            next(stream)
        faults.set_disk(WRITE_S)
        begin_s, before = time.monotonic(), camera.given
        waiting, written, memory_kb = 0, recorder.statistics().written, _memory_kb()
        while time.monotonic() < begin_s + slow_s:
            next(stream)
            waiting = max(waiting, stream.statistics().queues["record"].waiting)
        during = {
            "given": camera.given - before,
            "decoded": sum(moment > begin_s for moment in decoded_s),
            "written": recorder.statistics().written - written,
            "longest_pause_s": float(np.diff([moment for moment in decoded_s if moment > begin_s]).max()),
            "most_waiting": waiting,
            "grown_kb": _memory_kb() - memory_kb,
        }
        faults.set_disk(0.0)
        end_s = time.monotonic() + 30
        while stream.statistics().queues["record"].waiting > 2 and time.monotonic() < end_s:
            next(stream)
        dropped = stream.statistics().queues["record"].dropped
        for _ in range(30):
            next(stream)
    done, lost = recorder.statistics(), stream.statistics().queues["record"].dropped
    print(
        json.dumps(
            {
                "during": during,
                "dropped_until_caught_up": dropped,
                "given": camera.given,
                "written": done.written,
                "refused": done.refused,
                "dropped": lost,
            }
        )
    )


def _memory_kb() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


main()
