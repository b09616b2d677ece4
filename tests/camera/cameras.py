"""Every kind of camera, opened; a new kind adds one line to `CAMERAS`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import replace
from pathlib import Path

from support.folders import written_in_turn
from support.videos import write_video
from wire import SIZE_PX, TWO_STREAMS, emulated, shared_emulator, two_sources

from quadfringe.config import Device, SystemConfig
from quadfringe.config.cameras import AravisConfig, ChipConfig, FilesConfig, ReplayConfig, UvcConfig, VirtualConfig
from quadfringe.data import Stamp
from quadfringe.devices import Camera, open_devices
from quadfringe.devices.emulator import Emulator
from quadfringe.evaluation._fake_twin import fake_twin
from quadfringe.recording import Recorder

SMALL = Device(width_px=128, height_px=96, focal_px=(322.5, 322.5), centre_px=(63.5, 47.5))


@contextmanager
def opened(config: SystemConfig) -> Iterator[Camera]:
    devices = open_devices(config)
    devices.projector.show(devices.config.fringes)
    with closing(devices.projector), devices.camera as camera:
        yield camera


@contextmanager
def virtual(_: Path) -> Iterator[Camera]:
    with opened(SystemConfig(camera=SMALL, capture=VirtualConfig(frame_rate_hz=30.0))) as camera:
        yield camera


def wired(**settings: object) -> Callable[[Path], AbstractContextManager[Camera]]:
    @contextmanager
    def emulated_camera(_: Path) -> Iterator[Camera]:
        emulator = shared_emulator()
        emulator.order("reset")
        with opened(SystemConfig(capture=emulated(emulator, **settings))) as camera:  # type: ignore[arg-type]
            yield camera

    return emulated_camera


@contextmanager
def two_streams(_: Path) -> Iterator[Camera]:
    with (
        Emulator(size_px=SIZE_PX, model="two-streams", addresses=TWO_STREAMS) as emulator,
        opened(SystemConfig(capture=two_sources(emulator))) as camera,
    ):
        yield camera


@contextmanager
def aravis_fake(_: Path) -> Iterator[Camera]:
    with fake_twin(SIZE_PX, 30.0) as fakes, opened(SystemConfig(capture=fakes.capture)) as camera:
        yield camera


@contextmanager
def aravis_one_chip(_: Path) -> Iterator[Camera]:
    with fake_twin(SIZE_PX, 30.0) as fakes:
        capture = AravisConfig(
            device=str(fakes.capture.visible.device),
            visible=ChipConfig(pixel_format="BayerRG8"),
            frame_rate_hz=30.0,
            timeout_s=10.0,
        )
        with opened(SystemConfig(capture=capture)) as camera:
            yield camera


@contextmanager
def replay(folder: Path) -> Iterator[Camera]:
    with opened(SystemConfig(camera=SMALL)) as source, Recorder(folder / "take.h5") as recorder:
        shot = source.snap()
        for number in range(300):
            recorder.write(replace(shot, stamp=Stamp(number + 1, 10_000 * (number + 1), "bench")))
    with opened(SystemConfig(capture=ReplayConfig(file=folder / "take.h5"))) as camera:
        yield camera


@contextmanager
def files(folder: Path) -> Iterator[Camera]:
    captures = folder / "captures"
    captures.mkdir()
    config = SystemConfig(capture=FilesConfig(folder=captures, settle_s=0.02, infrared=False))
    with written_in_turn(captures, (SIZE_PX[1], SIZE_PX[0]), 20.0), opened(config) as camera:
        yield camera


@contextmanager
def uvc(folder: Path) -> Iterator[Camera]:
    video = write_video(folder / "take.avi", (SIZE_PX[1], SIZE_PX[0]), 900)
    with opened(SystemConfig(capture=UvcConfig(device=str(video)))) as camera:
        yield camera


CAMERAS: dict[str, Callable[[Path], AbstractContextManager[Camera]]] = {
    "virtual": virtual,
    "replay": replay,
    "files": files,
    "uvc, a video file": uvc,
    "emulated": wired(),
    "emulated, software trigger": wired(trigger="software"),
    "emulated, 12 bit packed": wired(visible="BayerRG12Packed", infrared="Mono12Packed"),
    "two streams": two_streams,
    "fake of Aravis": aravis_fake,
    "fake of Aravis, one chip": aravis_one_chip,
}
