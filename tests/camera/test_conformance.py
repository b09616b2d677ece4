"""Rules that every kind of camera keeps."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from cameras import CAMERAS
from wire import SIZE_PX

from quadfringe.devices import Camera


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
    for earlier, later in pairwise(stamps):
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


def test_an_interrupted_stream_ends(camera: Camera) -> None:
    stream = camera.stream(keep="all")
    next(stream)
    camera.interrupt()
    assert not list(stream)
    camera.snap()
    stopper = threading.Timer(0.3, camera.interrupt)
    stopper.start()
    for _ in camera.stream():
        time.sleep(0.01)
    stopper.join()


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
