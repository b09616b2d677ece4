"""Starts Aravis' own fake cameras in a process of their own, and gives the settings that open them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from quadfringe.capture import AravisConfig, ChipConfig

FAKES = ("127.0.0.5", "127.0.0.6")


@contextmanager
def fake_twin(size_px: tuple[int, int], rate_hz: float, **settings: Any) -> Iterator[AravisConfig]:
    command = [sys.executable, str(Path(__file__).with_name("aravis_fake.py")), *map(str, (*size_px, rate_hz, *FAKES))]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == "ready"
            visible = ChipConfig(device=FAKES[0], pixel_format="BayerRG8")
            infrared = ChipConfig(device=FAKES[1], pixel_format="Mono8")
            yield AravisConfig(visible=visible, infrared=infrared, frame_rate_hz=rate_hz, timeout_s=10.0, **settings)
        finally:
            process.kill()
