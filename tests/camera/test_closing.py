"""Every camera closes in order."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest
from cameras import CAMERAS


@pytest.mark.parametrize("name", CAMERAS)
def test_a_closed_camera_says_so(name: str, tmp_path: Path) -> None:
    threads = threading.active_count()
    with CAMERAS[name](tmp_path) as camera:
        camera.snap()
        camera.close()
        camera.close()
        with pytest.raises(ValueError, match="closed"):
            camera.snap()
        with pytest.raises(ValueError, match="closed"):
            next(camera.stream())
    deadline = time.monotonic() + 10
    while threading.active_count() > threads and time.monotonic() < deadline:
        time.sleep(0.05)
    assert threading.active_count() <= threads
