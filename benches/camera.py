"""Two cameras over the wire of GigE Vision, into shots and into shapes: what is lost, what is wrong, how late it is.

    scripts/loopback .venv/bin/python benches/camera.py [--seconds 60] [--json FILE]

Four runs at 1024 x 768 twice, on the loopback interface:
wire     Aravis' own fake cameras at 30 fps; every pixel of every shot is compared with what was sent.
decode   the emulated camera at 30 fps with a scene of the virtual bench, decoded by the published method; every shot is
         compared, and the time from the arrival of the second frame to the shape is taken.
rate     the same at 100 fps: shapes in a second.
faults   how long it takes until each fault has ended in its error, and until shots come again.

A wrong pixel ends with status 1 always; lost shots and times above their bars only with --bars, because a machine that
does other work loses shots.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from statistics import median

import numpy as np

from quadfringe.capture import AravisConfig, ChipConfig
from quadfringe.config import DecodeConfig, SceneConfig, SystemConfig
from quadfringe.data import AnyShot, BayerShot
from quadfringe.devices.aravis import AravisCamera
from quadfringe.emulator import ADDRESSES, Emulator
from quadfringe.emulator.frames import TestPattern
from quadfringe.errors import CameraError
from quadfringe.files import figures_text
from quadfringe.scanner import open_system

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "camera"))
from fake_twin import fake_twin

SIZE_PX = (1024, 768)
RATE_HZ = 30.0
PACKET_SIZE = 8192
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
    with fake_twin(SIZE_PX, RATE_HZ, packet_size=PACKET_SIZE) as config, AravisCamera(config) as camera:
        shots = wrong = 0
        exposures = []
        for shot in camera.stream(round(seconds * RATE_HZ), keep="all"):
            assert isinstance(shot, BayerShot)
            exposures.append(TestPattern.exposure(shot.raw))
            shots += 1
            wrong += int(np.count_nonzero(shot.raw != pattern.frame(0, exposures[-1], 8)))
            wrong += int(np.count_nonzero(shot.ir != pattern.frame(1, exposures[-1], 8)))
        sent = (exposures[-1] - exposures[0]) % 65536 + 1
        counted = camera.statistics()
    damaged, unpaired = counted.damaged, counted.unpaired
    print(f"wire: {shots} of {sent} shots, {wrong} wrong pixels; {damaged} damaged, {unpaired} unpaired frames")
    return {"wire_shots": shots, "wire_lost_shots": sent - shots, "wire_wrong_pixels": wrong}


@contextmanager
def bench_on_the_wire(rate_hz: float) -> Iterator[tuple[SystemConfig, BayerShot]]:
    """An emulated camera that sees the virtual bench, the system that decodes it, and the shot that it sends."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with open_system(SystemConfig(scene=SceneConfig(surface="face", bayer="rggb"))) as virtual:
            shot = virtual.grab()
            assert isinstance(shot, BayerShot)
            assert virtual.calibration is not None
            virtual.calibration.save(folder / "calibration.json")
        np.savez(folder / "frames.npz", visible=shot.raw[None], infrared=shot.ir[None])
        with Emulator(folder / "frames.npz"):
            decode = DecodeConfig(method="published")
            yield SystemConfig(capture=emulated(rate_hz), calibration=folder / "calibration.json", decode=decode), shot


def decode(seconds: float) -> Figures:
    wrong = 0
    with bench_on_the_wire(RATE_HZ) as (config, sent), open_system(config) as scanner:

        def compare(shot: AnyShot) -> None:
            nonlocal wrong
            assert isinstance(shot, BayerShot)
            wrong += int(np.count_nonzero(shot.raw != sent.raw) + np.count_nonzero(shot.ir != sent.ir))

        latencies_ms, ids = [], []
        with scanner.stream(round(seconds * RATE_HZ), keep="all", taps={"compare": compare}) as stream:
            for measured in stream:
                assert measured.shape.xyz_mm is not None
                latencies_ms.append(measured.latency_ms)
                ids.append(measured.shot.id or 0)
            queues = {name: queue.dropped for name, queue in stream.statistics().queues.items()}
        lost = ids[-1] - ids[0] + 1 - len(ids)
    # The first shots wait until the clocks of the chips are compared.
    middle_ms = median(latencies_ms[len(latencies_ms) // 10 :])
    print(f"decode: {len(ids)} shapes, {lost} shots lost, {wrong} wrong pixels, {middle_ms:.1f} ms; dropped {queues}")
    return {
        "decode_shapes": len(ids),
        "decode_lost_shots": lost,
        "decode_wrong_pixels": wrong,
        "decode_latency_ms": middle_ms,
    }


def rate(seconds: float) -> Figures:
    with bench_on_the_wire(100.0) as (config, _), open_system(config) as scanner, scanner.stream() as stream:
        next(stream)
        began, shapes = time.monotonic(), 0
        while (spent := time.monotonic() - began) < seconds:
            shapes += next(stream).error is None
        counted = stream.statistics()
    print(f"rate: {shapes / spent:.1f} shapes/s of {counted.captured_per_s:.1f} shots/s; {asdict(counted.camera)}")
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
