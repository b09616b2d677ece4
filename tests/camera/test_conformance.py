"""What every camera keeps to, whatever it is; a new kind adds one line to `CAMERAS`."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_twin import fake_twin
from wire import SIZE_PX, emulated

from quadfringe.capture import AravisConfig, ReplayConfig, VirtualConfig
from quadfringe.config import DeviceModel, SystemConfig
from quadfringe.data import Stamp
from quadfringe.devices import Camera, open_devices
from quadfringe.emulator import Emulator
from quadfringe.recording import Recorder

SMALL = DeviceModel(width_px=128, height_px=96, focal_px=(322.5, 322.5), centre_px=(63.5, 47.5))


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
        with Emulator(size_px=SIZE_PX) as emulator:
            with opened(SystemConfig(capture=emulated(emulator, **settings))) as camera:  # type: ignore[arg-type]
                yield camera

    return emulated_camera


@contextmanager
def two_streams(_: Path) -> Iterator[Camera]:
    with Emulator(size_px=SIZE_PX, model="two-streams"):
        capture = AravisConfig.model_validate({"visible": {"source": "Source0"}, "infrared": {"source": "Source1"}})
        with opened(SystemConfig(capture=capture)) as camera:
            yield camera


@contextmanager
def aravis_fake(_: Path) -> Iterator[Camera]:
    with fake_twin(SIZE_PX, 30.0) as capture, opened(SystemConfig(capture=capture)) as camera:
        yield camera


@contextmanager
def replay(folder: Path) -> Iterator[Camera]:
    with opened(SystemConfig(camera=SMALL)) as source, Recorder(folder / "take.h5") as recorder:
        shot = source.snap()
        for number in range(200):
            recorder.write(replace(shot, stamp=Stamp(number + 1, 10_000 * (number + 1), "bench")))
    with opened(SystemConfig(capture=ReplayConfig(file=folder / "take.h5"))) as camera:
        yield camera


CAMERAS: dict[str, Callable[[Path], AbstractContextManager[Camera]]] = {
    "virtual": virtual,
    "replay": replay,
    "emulated": wired(),
    "emulated, software trigger": wired(trigger="software"),
    "emulated, 12 bit packed": wired(visible="BayerRG12Packed", infrared="Mono12Packed"),
    "two streams": two_streams,
    "fake of Aravis": aravis_fake,
}


@pytest.fixture(scope="module", params=CAMERAS.values(), ids=CAMERAS.keys())
def camera(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Camera]:
    with request.param(tmp_path_factory.mktemp("camera")) as one:
        yield one


def test_a_shot_has_a_stamp_and_images_of_one_size(camera: Camera) -> None:
    shot = camera.snap()
    assert shot.stamp is not None
    assert shot.stamp.device
    assert {image.shape for image in shot.images.values()} == {(SIZE_PX[1], SIZE_PX[0])}
    assert len({image.dtype for image in shot.images.values()}) == 1
    assert shot.full_scale_value >= 255
    for name, frame in shot.stamp.frames.items():
        assert name in ("visible", "infrared")
        assert frame.arrival_ns > 0


def test_ids_and_times_grow(camera: Camera) -> None:
    shots = [camera.snap(), *camera.stream(3, keep="all"), camera.snap(), *camera.stream(2)]
    stamps = [shot.stamp for shot in shots if shot.stamp is not None]
    assert len(stamps) == 7
    for earlier, later in zip(stamps, stamps[1:], strict=False):
        assert later.id > earlier.id
        assert later.time_us > earlier.time_us


def test_a_stream_ends_after_its_count(camera: Camera) -> None:
    assert len(list(camera.stream(4, keep="all"))) == 4
    assert len(list(camera.stream(0))) == 0


def test_a_stream_that_is_left_leaves_the_camera_usable(camera: Camera) -> None:
    stream = camera.stream(keep="all")
    next(stream)
    stream.close()  # type: ignore[attr-defined]
    camera.snap()


def test_shots_are_the_callers_own(camera: Camera) -> None:
    first, second = camera.stream(2, keep="all")
    kept = {name: image.copy() for name, image in first.images.items()}
    for image in second.images.values():
        image[...] = 0
    for name, image in first.images.items():
        np.testing.assert_array_equal(image, kept[name])


def test_statistics_count(camera: Camera) -> None:
    before = camera.statistics()
    list(camera.stream(3, keep="all"))
    after = camera.statistics()
    assert after.shots >= before.shots + 3
    assert after.dropped == before.dropped
    for chip, counted in after.chips.items():
        assert counted.frames >= before.chips[chip].frames + 3


def test_a_slow_caller_gets_the_newest_shot(camera: Camera) -> None:
    stream = camera.stream(keep="latest")
    first = next(stream).id
    before = camera.statistics().dropped
    time.sleep(0.5)
    next(stream)
    third = next(stream).id
    stream.close()  # type: ignore[attr-defined]
    assert first is not None
    assert third is not None
    dropped = camera.statistics().dropped - before
    assert third - first >= 2 + dropped, "what was dropped is missing from the ids, and was counted"
    assert dropped == 0 or camera.paced


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
