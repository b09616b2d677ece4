"""Faults on the wire: each is mended, counted or an error, except for changed pixels, which GigE Vision cannot show."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from wire import OWN, SIZE_PX, checked_exposure, emulated, pattern, two_sources

from quadfringe.data import AnyShot, BayerShot
from quadfringe.devices.aravis import AravisCamera
from quadfringe.devices.aravis._device import TEST_PACKET, Device
from quadfringe.devices.emulator import Emulator
from quadfringe.devices.emulator.frames import TestPattern
from quadfringe.errors import CameraLostError, WrongFrameError


def rest(stream: Iterator[AnyShot]) -> None:
    """Take the remaining shots; all of them are right."""
    for shot in stream:
        checked_exposure(shot)


def right(camera: AravisCamera, count: int) -> list[int]:
    shots = list(camera.stream(count, keep="all"))
    exposures = [checked_exposure(shot) for shot in shots]
    assert exposures == sorted(set(exposures))
    times_us = [shot.stamp.time_us for shot in shots if shot.stamp is not None]
    assert times_us == sorted(set(times_us))
    assert times_us[-1] - times_us[0] < 1e5 * (exposures[-1] - exposures[0]), "a time is off by a turn of the clock"
    return exposures


@pytest.mark.parametrize("fault", ["duplicates", "reordered"])
def test_packets_that_come_twice_or_late_are_put_in_their_place(
    fault: str, emulator: Emulator, camera: AravisCamera
) -> None:
    emulator.order(fault, 0.3)
    exposures = right(camera, 60)
    assert exposures[-1] - exposures[0] < 80
    assert camera.statistics().damaged == 0


def test_ids_of_sixteen_bits_that_wrap_around(emulator: Emulator, camera: AravisCamera) -> None:
    right(camera, 5)
    emulator.order("next_id", 65_520)
    missed = camera.statistics().missed
    right(camera, 60)
    assert camera.statistics().missed == missed, "an id that begins anew is no lost frame"


def test_device_clocks_that_wrap_around(emulator: Emulator) -> None:
    with AravisCamera(emulated(emulator, timeout_s=6.0)) as camera:
        emulator.order("clock_bits", 30)  # a turn takes 1.07 s
        exposures = right(camera, 100)
    assert exposures[-1] - exposures[0] < 300


def test_changed_pixels_are_delivered(emulator: Emulator, camera: AravisCamera) -> None:
    """GVSP has no checksum; that of UDP covers the wire and neither the camera nor the network card."""
    emulator.order("corrupted", 1)
    shots = list(camera.stream(5, keep="all"))
    for shot in shots:
        assert isinstance(shot, BayerShot)
        whole = pattern(shot.ir.shape)
        wanted = whole.frame(0, TestPattern.exposure(shot.raw), 8)
        assert np.count_nonzero(shot.raw != wanted) == 1
    assert camera.statistics().damaged == 0


def test_swapped_chips_are_delivered(emulator: Emulator, camera: AravisCamera) -> None:
    """Pixels do not tell which chip took them; the decoder refuses such shots (tests/test_hostile_shots.py)."""
    emulator.order("swapped", 1)
    (shot,) = list(camera.stream(3, keep="all"))[2:]
    assert isinstance(shot, BayerShot)
    exposure = TestPattern.exposure(shot.raw)
    np.testing.assert_array_equal(shot.raw, pattern(shot.ir.shape).frame(1, exposure, 8))
    np.testing.assert_array_equal(shot.ir, pattern(shot.ir.shape).frame(0, exposure, 8))


def test_a_reset_while_frames_come(emulator: Emulator, camera: AravisCamera) -> None:
    """A camera that restarts within a frame period forgets its controller: one error, and the next call reconnects."""
    right(camera, 5)
    emulator.order("reset")
    with pytest.raises(CameraLostError, match=r"no longer answers.* the next call reconnects"):
        camera.snap()
    right(camera, 10)


def test_a_path_whose_mtu_falls_while_frames_come(emulator: Emulator) -> None:
    """The agreed packets are lost from then on; the error says so, and the next call agrees on packets that arrive."""
    with AravisCamera(emulated(emulator, timeout_s=2.0, packet_size=None)) as camera:
        stream = camera.stream(keep="all")
        checked_exposure(next(stream))
        emulator.order("mtu", 1500)
        with pytest.raises(WrongFrameError, match=r"packets of \d{4} bytes do not arrive, .* up to 1500: call again"):
            rest(stream)
        right(camera, 10)


def test_packets_that_are_larger_than_the_network_carries(emulator: Emulator) -> None:
    emulator.order("mtu", 1500)
    with AravisCamera(emulated(emulator, packet_size=None)) as agreed:
        right(agreed, 10)
    with AravisCamera(emulated(emulator, timeout_s=2.0, packet_size=9000)) as fixed:
        with pytest.raises(WrongFrameError, match=r"9000 bytes do not arrive.* set packet_size to at most 1500"):
            fixed.snap()
        emulator.order("mtu", 0)
        right(fixed, 10)


def test_two_streams_of_one_device_agree_on_packets_that_arrive() -> None:
    with Emulator(size_px=SIZE_PX, model="two-streams", addresses=OWN) as emulator:
        emulator.order("mtu", 3000)
        config = two_sources(emulator).model_copy(update={"timeout_s": 2.0})
        with AravisCamera(config) as camera:
            right(camera, 5)
            emulator.order("mtu", 1500)
            with pytest.raises(WrongFrameError, match=r"packets of 3000 bytes do not arrive, .* up to 1500"):
                right(camera, 5)
            right(camera, 5)


def test_packets_that_are_too_large_from_a_camera_without_test_packets(
    emulator: Emulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    has = Device.has
    monkeypatch.setattr(Device, "has", lambda device, name: name != TEST_PACKET and has(device, name))
    emulator.order("mtu", 1500)
    with (
        AravisCamera(emulated(emulator, timeout_s=2.0, packet_size=9000)) as camera,
        pytest.raises(WrongFrameError, match=r"9000 bytes, and this camera sends no test packets: .* set packet_size"),
    ):
        camera.snap()
