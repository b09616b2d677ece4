"""Faults of the network and the camera: each ends in its error or is counted, and no wrong shot is delivered."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from wire import OWN, SIZE_PX, checked_exposure, emulated

from quadfringe.data import AnyShot
from quadfringe.devices.aravis import AravisCamera
from quadfringe.devices.emulator import Emulator
from quadfringe.errors import (
    CameraBusyError,
    CameraError,
    CameraLostError,
    CameraNotFoundError,
    ShotTimeoutError,
    UnpairedError,
    WrongFrameError,
)


def right(camera: AravisCamera, count: int) -> list[int]:
    exposures = [checked_exposure(shot) for shot in camera.stream(count, keep="all")]
    assert exposures == sorted(set(exposures))
    return exposures


def rest(stream: Iterator[AnyShot]) -> None:
    """Take the remaining shots; all of them are right."""
    for shot in stream:
        checked_exposure(shot)


def test_lost_packets_are_sent_again(emulator: Emulator, camera: AravisCamera) -> None:
    emulator.order("lost_packets", 0.01)
    right(camera, 100)
    assert camera.statistics().chips["visible"].frames >= 100


def test_lost_packets_that_stay_lost_are_counted(emulator: Emulator, camera: AravisCamera) -> None:
    emulator.order("deaf", 1)
    emulator.order("lost_packets", 0.05)
    right(camera, 30)
    counted = camera.statistics()
    assert counted.damaged + counted.missed > 0
    assert counted.unpaired > 0, "the partner of a damaged frame is whole, and of no use"
    emulator.order("lost_packets", 0)
    right(camera, 10)


def test_lost_frames_and_ids(emulator: Emulator, camera: AravisCamera) -> None:
    emulator.order("lost_frames", 0.05)
    emulator.order("skipped_ids", 0.05)
    right(camera, 100)
    counted = camera.statistics()
    assert counted.unpaired > 0
    assert counted.missed > 0


def test_a_camera_that_vanishes(emulator: Emulator, camera: AravisCamera) -> None:
    stream = camera.stream(keep="all")
    checked_exposure(next(stream))
    emulator.order("gone", 1)
    with pytest.raises(CameraLostError, match="no longer answers"):
        rest(stream)
    emulator.order("gone", 0)
    right(camera, 10)


def test_a_silent_camera(emulator: Emulator, camera: AravisCamera) -> None:
    emulator.order("silent", 1)
    with pytest.raises(ShotTimeoutError, match="no shot within 1 s: it answers but sends no frames"):
        camera.snap(1.0)
    emulator.order("silent", 0)
    right(camera, 10)


@pytest.mark.parametrize(("chip", "missing"), [(0, "visible"), (1, "infrared")])
def test_a_silent_chip(emulator: Emulator, camera: AravisCamera, chip: int, missing: str) -> None:
    emulator.order("silent_chip", chip)
    with pytest.raises(UnpairedError, match=f"none of the {missing} chip"):
        camera.snap(2.0)
    assert camera.statistics().unpaired > 0
    emulator.order("silent_chip", -1)
    right(camera, 10)


@pytest.mark.parametrize(
    ("fault", "reason"), [("wrong_size", r"128 x 48 pixels instead of 128 x 96"), ("wrong_format", "pixel format")]
)
def test_a_wrong_frame(emulator: Emulator, camera: AravisCamera, fault: str, reason: str) -> None:
    stream = camera.stream(keep="all")
    checked_exposure(next(stream))
    emulator.order(fault, 1)
    with pytest.raises(WrongFrameError, match=reason):
        rest(stream)
    assert camera.statistics().damaged > 0
    emulator.order(fault, 0)
    right(camera, 10)


def test_a_short_frame_of_the_right_size(emulator: Emulator, camera: AravisCamera) -> None:
    """Aravis reports success for a frame whose payload is too short for its size."""
    emulator.order("short", 1)
    with pytest.raises(WrongFrameError, match=r"bytes instead of|incomplete"):
        camera.snap(2.0)
    emulator.order("short", 0)
    right(camera, 10)


def test_packets_of_another_size_than_agreed(emulator: Emulator, camera: AravisCamera) -> None:
    """Aravis puts such packets at wrong places and reports success."""
    stream = camera.stream(keep="all")
    checked_exposure(next(stream))
    emulator.order("packet_size", 1000)
    with pytest.raises(CameraError):
        rest(stream)
    emulator.order("packet_size", 0)
    right(camera, 10)


@pytest.mark.usefixtures("camera")
def test_a_second_controller(emulator: Emulator) -> None:
    with pytest.raises(CameraBusyError, match="controlled by another program"):
        AravisCamera(emulated(emulator))


def test_the_first_controller_is_not_disturbed(emulator: Emulator, camera: AravisCamera) -> None:
    stream = camera.stream(keep="all")
    checked_exposure(next(stream))
    with pytest.raises(CameraBusyError):
        AravisCamera(emulated(emulator))
    for _ in range(10):
        checked_exposure(next(stream))
    stream.close()
    camera.close()
    with AravisCamera(emulated(emulator)) as second:
        right(second, 5)


def test_a_camera_that_boots_and_one_that_is_not_there() -> None:
    with Emulator(size_px=SIZE_PX, addresses=OWN) as emulator:
        config = emulated(emulator)
        camera = AravisCamera(config)
        checked_exposure(camera.snap())
    with camera:
        with pytest.raises(CameraLostError):
            camera.snap()
        with pytest.raises(CameraNotFoundError, match=OWN[0]):
            AravisCamera(config)
        with Emulator(size_px=SIZE_PX, clock=(77.0, -50.0), addresses=OWN):
            right(camera, 10)


def test_a_camera_that_is_closed_while_a_shot_is_awaited(emulator: Emulator, camera: AravisCamera) -> None:
    stream = camera.stream(keep="all")
    checked_exposure(next(stream))
    emulator.order("silent", 1)
    closing = threading.Timer(0.3, camera.close)
    closing.start()
    with pytest.raises(ValueError, match="was closed"):
        rest(stream)
    closing.join()
