"""Two cameras over GigE Vision, into shots and into shapes: losses, wrong pixels and delays.

    scripts/loopback .venv/bin/python benches/camera.py [--seconds 60] [--json FILE]

Four runs with two chips of 1024 x 768, on the loopback interface:
wire     the fake cameras of Aravis at 30 fps; compares every pixel of every shot with the sent image. If the machine
         wakes one of the two too late to make an exposure, there is no shot; the exposure counts as skipped.
decode   the emulated camera at 30 fps with a scene of the virtual bench, decoded by the published method and recorded;
         compares every shot and measures the time from the arrival of the second frame to the shape.
rate     the same at 66 fps, recorded and not compared: shapes per second.
faults   the time until each fault has ended in its error, and until shots arrive again.

For decode and rate the script reports the processor time of a shot by thread, and that of the emulated camera. The exit
status is 1 for a wrong pixel; for lost shots and times above their bars only with --bars, because a machine with other
load loses shots.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from statistics import median

import numpy as np

from quadfringe.config import DecodeConfig, SceneConfig, SystemConfig
from quadfringe.config.cameras import AravisConfig, ChipConfig
from quadfringe.data import AnyShot, BayerShot
from quadfringe.devices.aravis import AravisCamera
from quadfringe.devices.emulator import ADDRESSES, Emulator
from quadfringe.devices.emulator.frames import TestPattern
from quadfringe.errors import CameraError
from quadfringe.evaluation._fake_twin import fake_twin
from quadfringe.files import figures_text
from quadfringe.recording import Recorder, Recording
from quadfringe.scanner import open_system

SIZE_PX = (1024, 768)
RATE_HZ, FAST_HZ = 30.0, 66.0
PACKET_SIZE = 65500  # the loopback interface takes 64 kB
BARS: dict[str, tuple[str, float]] = {
    "wire_lost_shots": ("at most", 0),
    "decode_lost_shots": ("at most", 0),
    "decode_latency_ms": ("at most", 40),
    "rate_shapes_per_s": ("at least", 60),
    "faults_slowest_error_s": ("at most", 3),
}
Figures = dict[str, float]


def emulated(rate_hz: float) -> AravisConfig:
    visible, infrared = (ChipConfig(device=address) for address in ADDRESSES)
    return AravisConfig(visible=visible, infrared=infrared, frame_rate_hz=rate_hz, packet_size=PACKET_SIZE)


def wire(seconds: float) -> Figures:
    pattern = TestPattern((SIZE_PX[1], SIZE_PX[0]))
    with fake_twin(SIZE_PX, RATE_HZ, packet_size=PACKET_SIZE) as fakes, AravisCamera(fakes.capture) as camera:
        wrong = 0
        exposures = []
        for shot in camera.stream(round(seconds * RATE_HZ), keep="all"):
            assert isinstance(shot, BayerShot)
            exposures.append(TestPattern.exposure(shot.raw))
            wrong += int(np.count_nonzero(shot.raw != pattern.frame(0, exposures[-1], 8)))
            wrong += int(np.count_nonzero(shot.ir != pattern.frame(1, exposures[-1], 8)))
        counted = camera.statistics()
        sent = fakes.sent(exposures[0], exposures[-1])
    lost = len(sent[0] & sent[1]) - len(exposures)
    skipped = len(sent[0] ^ sent[1])
    print(
        f"wire: {len(exposures)} shots, {lost} lost, {wrong} wrong pixels; {counted.damaged} damaged frames, ", end=""
    )
    print(f"{counted.unpaired} unpaired; {skipped} exposures skipped by one of the fake cameras")
    return {
        "wire_shots": len(exposures),
        "wire_lost_shots": lost,
        "wire_wrong_pixels": wrong,
        "wire_skipped_exposures": skipped,
    }


class Budget:
    """Processor time by thread of this process, and of the emulated camera, between two looks."""

    def __init__(self, emulator: Emulator) -> None:
        self._emulator = emulator
        self._before = self._look()

    def _look(self) -> dict[str, float]:
        """Give seconds by name; threads of one name are one; the system names those of others."""
        known = {thread.native_id: thread.name for thread in threading.enumerate()}
        spent = {"emulated camera": float(self._emulator.order("busy"))}
        for task in Path("/proc/self/task").iterdir():
            with suppress(OSError):
                name = known.get(int(task.name)) or (task / "comm").read_text().strip()
                name = "kernel's pool" if name.startswith("python") else name
                spent[name] = spent.get(name, 0.0) + int((task / "schedstat").read_text().split()[0]) / 1e9
        return spent

    def ms_per_shot(self, shots: int) -> dict[str, float]:
        """Give milliseconds by name, greatest first."""
        now = self._look()
        spent = {name: 1e3 * (now[name] - self._before.get(name, 0.0)) / max(shots, 1) for name in now}
        return dict(sorted(spent.items(), key=lambda item: -item[1]))

    def shown(self, shots: int) -> str:
        spent = self.ms_per_shot(shots)
        listed = ", ".join(f"{name} {ms:.2f}" for name, ms in spent.items() if ms >= 0.01)
        return f"  processor ms a shot: {sum(spent.values()):.1f} = {listed}"


@contextmanager
def bench_on_the_wire(rate_hz: float) -> Iterator[tuple[SystemConfig, BayerShot, Emulator, Path]]:
    """The system of an emulated camera that sees the virtual bench, the shot that it sends, and a file to record in."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with open_system(SystemConfig(scene=SceneConfig(surface="face", bayer="rggb"))) as virtual:
            shot = virtual.grab()
            assert isinstance(shot, BayerShot)
            assert virtual.calibration is not None
            virtual.calibration.save(folder / "calibration.json")
        np.savez(folder / "frames.npz", visible=shot.raw[None], infrared=shot.ir[None])
        with Emulator(folder / "frames.npz") as emulator:
            system = SystemConfig(
                capture=emulated(rate_hz),
                calibration=folder / "calibration.json",
                decode=DecodeConfig(method="published"),
            )
            yield system, shot, emulator, folder / "take.h5"


def decode(seconds: float) -> Figures:
    wrong = 0
    count = round(seconds * RATE_HZ)
    with bench_on_the_wire(RATE_HZ) as (config, sent, emulator, take), open_system(config) as scanner:

        def compare(shot: AnyShot) -> None:
            nonlocal wrong
            assert isinstance(shot, BayerShot)
            wrong += not (np.array_equal(shot.raw, sent.raw) and np.array_equal(shot.ir, sent.ir))

        latencies_ms, ids = [], []
        with Recorder(take, scanner.config, scanner.calibration) as recorder:
            taps = {"compare": compare, "record": recorder.write}
            budget = Budget(emulator)
            with scanner.stream(count, keep="all", taps=taps) as stream:
                for measured in stream:
                    assert measured.shape.xyz_mm is not None
                    latencies_ms.append(measured.latency_ms)
                    ids.append(measured.shot.id or 0)
                    if len(ids) == count // 2:
                        shares = budget.shown(len(ids))
                queues = {name: queue.dropped for name, queue in stream.statistics().queues.items()}
        with Recording(take) as recording:
            recorded = len(recording)
        lost = ids[-1] - ids[0] + 1 - min(len(ids), recorded)
    # The first shots wait until the clocks of the chips are compared.
    middle_ms = median(latencies_ms[len(latencies_ms) // 10 :])
    print(f"decode: {len(ids)} shapes, {recorded} recorded, {lost} lost, {wrong} shots with wrong pixels, ", end="")
    print(f"{middle_ms:.1f} ms; dropped {queues}\n{shares}")
    return {
        "decode_shapes": len(ids),
        "decode_recorded": recorded,
        "decode_lost_shots": lost,
        "decode_wrong_pixels": wrong,
        "decode_latency_ms": middle_ms,
    }


def rate(seconds: float) -> Figures:
    with (
        bench_on_the_wire(FAST_HZ) as (config, _, emulator, take),
        open_system(config) as scanner,
        Recorder(take, scanner.config, scanner.calibration) as recorder,
        scanner.stream(taps={"record": recorder.write}) as stream,
    ):
        next(stream)
        budget, began, shapes = Budget(emulator), time.monotonic(), 0
        while (spent := time.monotonic() - began) < seconds:
            shapes += next(stream).error is None
        shares = budget.shown(shapes)
        counted, recorded = stream.statistics(), recorder.statistics().written
    print(f"rate: {shapes / spent:.1f} shapes/s of {counted.captured_per_s:.1f} shots/s, {recorded} recorded; ", end="")
    print(f"{counted.camera.unpaired} unpaired, {counted.camera.damaged} damaged frames\n{shares}")
    return {"rate_shapes_per_s": shapes / spent, "rate_captured_per_s": counted.captured_per_s}


FAULTS: dict[str, tuple[str, str]] = {
    "gone": ("gone 1", "gone 0"),
    "silent": ("silent 1", "silent 0"),
    "silent_chip": ("silent_chip 1", "silent_chip -1"),
    "wrong_size": ("wrong_size 1", "wrong_size 0"),
}


def faults() -> Figures:
    figures: Figures = {}
    with Emulator(size_px=(256, 192)) as emulator, AravisCamera(emulated(RATE_HZ)) as camera:
        for name, (order, cure) in FAULTS.items():
            stream = camera.stream()
            next(stream)
            emulator.order(*order.split())
            figures[f"faults_{name}_error_s"] = seconds_until_error(lambda stream=stream: list(stream))  # type: ignore[misc]
            emulator.order(*cure.split())
            began = time.monotonic()
            camera.snap()
            figures[f"faults_{name}_again_s"] = time.monotonic() - began
        figures["faults_busy_error_s"] = seconds_until_error(lambda: AravisCamera(emulated(RATE_HZ)))
    figures["faults_slowest_error_s"] = max(value for name, value in figures.items() if name.endswith("error_s"))
    for name, value in figures.items():
        print(f"{name.replace('_', ' ')}: {value:.2f}")
    return figures


def seconds_until_error(attempt: Callable[[], object]) -> float:
    began = time.monotonic()
    try:
        attempt()
    except CameraError:
        return time.monotonic() - began
    raise AssertionError("no error came")


def missed(figures: Figures) -> list[str]:
    failed = []
    for name, (sense, bar) in BARS.items():
        if name in figures and (figures[name] > bar if sense == "at most" else figures[name] < bar):
            failed.append(f"{name}: {figures[name]:.4g}, expected {sense} {bar:g}")
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--only", nargs="+", choices=["wire", "decode", "rate", "faults"])
    parser.add_argument("--bars", action="store_true", help="lost shots and missed times are failures too")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    runs: dict[str, Callable[[], Figures]] = {
        "wire": lambda: wire(options.seconds),
        "decode": lambda: decode(options.seconds),
        "rate": lambda: rate(min(options.seconds, 20.0)),
        "faults": faults,
    }
    figures: Figures = {}
    for name in options.only or runs:
        figures |= runs[name]()
    if options.json:
        options.json.write_text(figures_text(figures))
    problems = missed(figures)
    for problem in problems:
        print(f"missed: {problem}", file=sys.stderr)
    wrong = sum(value for name, value in figures.items() if name.endswith("wrong_pixels"))
    return int(wrong > 0 or (options.bars and bool(problems)))


if __name__ == "__main__":
    sys.exit(main())
