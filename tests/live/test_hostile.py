"""A measurement with recording and view goes on, whatever the clients of its page do.

    QUADFRINGE_LIVE_SECONDS=3600 QUADFRINGE_BROWSER=1 pytest -s tests/live/test_hostile.py

runs the same for an hour; the default is some seconds. It writes 6 MB of recording a second.
"""

from __future__ import annotations

import http.client
import os
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import quadfringe as qf
from quadfringe.evaluation._live import Carousel
from quadfringe.evaluation.machine import resident_bytes
from quadfringe.recording import Recorder, Recording
from quadfringe.scanner.streaming import LiveStream
from quadfringe.view.viewer import Viewer

SECONDS = float(os.environ.get("QUADFRINGE_LIVE_SECONDS", "20"))
RATE_HZ = 30.0
LARGEST_GROWTH_MB = 20.0
TESTS = Path(__file__).resolve().parents[1]
SYSTEM = """
capture = { kind = "virtual", frame_rate_hz = 5 }

[camera]
width_px = 256
height_px = 192
focal_px = [645.0, 645.0]
centre_px = [127.5, 95.5]

[scene]
surface = "hand"

[decode]
method = "published"
response = "linear"
"""


@contextmanager
def clients(url: str) -> Iterator[None]:
    """A reader, a slow client and two hostile ones, each in a process."""
    with ExitStack() as stack:
        for kind in ("reader", "slow", "hostile", "hostile"):
            command = [sys.executable, "-m", "support.page_clients", kind, url]
            client = stack.enter_context(subprocess.Popen(command, cwd=TESTS, stderr=subprocess.DEVNULL))
            stack.callback(client.kill)
        yield


def growth_mb(seconds: float) -> float:
    """Growth of the memory of this process, from the middle third of the time to the last."""
    used, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.25)
        used.append((resident_bytes() or 0) / 1e6)
    third = len(used) // 3
    return statistics.median(used[-third:]) - statistics.median(used[third : 2 * third])


def test_recording_and_view_go_on_under_attack(tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM)
    with qf.open(tmp_path / "system.toml") as scanner:
        scanner.projector.show(scanner.config.fringes)
        shots = list(scanner.camera.stream(6, keep="all"))
        camera = Carousel(shots, RATE_HZ)
        recorder = Recorder(tmp_path / "take.h5", scanner.config, scanner.calibration)
        taps = {"record": recorder.write}
        with (
            Viewer(port=8270, stride=1, clouds_per_s=20) as viewer,
            recorder,
            LiveStream(camera, scanner.decode, keep="latest", taps=taps, at_once=2) as stream,  # type: ignore[arg-type]
        ):
            follower = threading.Thread(target=viewer.follow, args=(stream, recorder.statistics))
            follower.start()
            with clients(viewer.url):
                grown_mb = growth_mb(SECONDS)
                queues = stream.statistics().queues
            sent = viewer._clouds
            page = http.client.HTTPConnection("127.0.0.1", int(viewer.url.rsplit(":", 1)[1]), timeout=30)
            page.request("GET", "/")
            answered = page.getresponse().status
            page.close()
            stream.close()
            follower.join()
    done = recorder.statistics()
    print(f"{done.written} shots of {camera.given}, {sent} clouds sent, memory grew by {grown_mb:.1f} MB")
    assert answered == 200
    assert viewer.fault is None
    assert sent > 0  # not many: a hostile client may hold the page still, as any page may
    assert queues["record"].dropped == 0
    assert (done.written, done.refused) == (camera.given, 0)
    assert camera.given > 0.8 * RATE_HZ * SECONDS
    with Recording(tmp_path / "take.h5") as take:
        assert len(take) == camera.given
    assert grown_mb < LARGEST_GROWTH_MB
