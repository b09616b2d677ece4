"""Start the fake cameras that come with Aravis in a separate process, and give the settings that open them."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from quadfringe.config.cameras import AravisConfig, ChipConfig

FAKES = ("127.0.0.5", "127.0.0.6")


@dataclass(frozen=True)
class FakeTwin:
    """Settings that open the fake cameras, and the process that runs them."""

    capture: AravisConfig
    process: subprocess.Popen[str]

    def sent(self, first: int, last: int) -> list[set[int]]:
        """Give the exposures from first to last, modulo 65536, that each of the two cameras has sent."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        print("sent", file=self.process.stdin, flush=True)
        wanted = {(first + n) % 65536 for n in range((last - first) % 65536 + 1)}
        return [wanted & set(exposures) for exposures in json.loads(self.process.stdout.readline())]


@contextmanager
def fake_twin(size_px: tuple[int, int], rate_hz: float, **settings: Any) -> Iterator[FakeTwin]:
    """Run two fake cameras on the loopback interface; `settings` are those of `AravisConfig`."""
    command = [sys.executable, "-m", "quadfringe.evaluation._aravis_fake", *map(str, (*size_px, rate_hz, *FAKES))]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == "ready"
            visible = ChipConfig(device=FAKES[0], pixel_format="BayerRG8")
            infrared = ChipConfig(device=FAKES[1], pixel_format="Mono8")
            yield FakeTwin(
                AravisConfig(visible=visible, infrared=infrared, frame_rate_hz=rate_hz, timeout_s=10.0, **settings),
                process,
            )
        finally:
            process.kill()
