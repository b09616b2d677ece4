"""The 2CCD camera over GigE Vision: formats, triggers, buffers, settings that are read back."""

from __future__ import annotations

import gc
import threading
import time
from typing import Literal

import numpy as np
import pytest
from support.shots import sees_no_infrared
from wire import SECOND, SIZE_PX, TWO_STREAMS, checked_exposure, emulated, pattern, two_sources

from quadfringe.config.cameras import AravisConfig, ChipConfig
from quadfringe.data import BayerShot, Shot
from quadfringe.devices.aravis import AravisCamera, ChipCamera, found
from quadfringe.devices.aravis._binding import aravis_binding
from quadfringe.devices.emulator import MODEL, SERIAL, Emulator
from quadfringe.devices.emulator.frames import TestPattern
from quadfringe.errors import CameraError, CameraNotFoundError, ShotTimeoutError, WrongFrameError
from quadfringe.evaluation._fake_twin import fake_twin

FORMATS = [
    ("BayerRG8", "Mono8"),
    ("BayerRG10", "Mono10"),
    ("BayerRG10Packed", "Mono10Packed"),
    ("BayerRG12", "Mono12Packed"),
    ("BayerRG12Packed", "Mono12"),
    ("RGB8", "Mono8"),
    ("BayerGR8", "Mono8"),
    ("BayerGB12Packed", "Mono12Packed"),
    ("BayerBG10", "Mono10"),
    ("BayerRG10p", "Mono10p"),
    ("BayerGB12p", "Mono12p"),
]


@pytest.mark.parametrize(("visible", "infrared"), FORMATS)
def test_every_format_is_right_to_the_bit(emulator: Emulator, visible: str, infrared: str) -> None:
    with AravisCamera(emulated(emulator, visible, infrared)) as camera:
        shots = list(camera.stream(5, keep="all"))
    exposures = [checked_exposure(shot) for shot in shots]
    assert exposures == list(range(exposures[0], exposures[0] + 5))
    assert isinstance(shots[0], Shot if visible == "RGB8" else BayerShot)
    assert all(image.flags.writeable for image in shots[0].images.values())
    assert camera.config.visible.pixel_format == visible
    assert camera.config.infrared.pixel_format == infrared


@pytest.mark.parametrize("chip", ["visible", "infrared"])
@pytest.mark.parametrize("bits", ["8", "12Packed"])
def test_one_chip_alone(emulator: Emulator, chip: Literal["visible", "infrared"], bits: str) -> None:
    config = emulated(emulator, f"BayerRG{bits}", f"Mono{bits}", exposure_us=10_000.0)
    with ChipCamera(config, chip) as camera:
        images = [camera.snap(), *camera.stream(5, keep="all")]
    number = ("visible", "infrared").index(chip)
    whole = pattern((SIZE_PX[1], SIZE_PX[0]))
    for image in images:
        wanted = whole.frame(number, TestPattern.exposure(image.pixels), round(np.log2(image.full_scale + 1)))
        np.testing.assert_array_equal(image.pixels, wanted)
        assert image.pixel_format == getattr(camera.config, chip).pixel_format
        assert image.bayer == ("rggb" if chip == "visible" else None)
        assert set(image.stamp.frames) == {chip}
    ids = [image.id for image in images]
    assert ids == sorted(set(ids))
    assert camera.statistics().shots >= 6
    assert camera.statistics().unpaired == 0


def test_one_chip_by_the_name_of_its_camera(emulator: Emulator) -> None:
    for chip, address in zip(("visible", "infrared"), emulator.addresses, strict=True):
        with ChipCamera(AravisConfig(device=SERIAL), chip) as camera:  # type: ignore[arg-type]
            assert getattr(camera.config, chip).device == address
            assert camera.name == f"JAI Ltd., Japan {MODEL} {SERIAL}"
            camera.snap()


def test_one_chip_that_fails(emulator: Emulator) -> None:
    with ChipCamera(emulated(emulator), "infrared") as camera:
        emulator.order("silent", 1)
        with pytest.raises(ShotTimeoutError, match="sends no frames"):
            camera.snap(1.0)
        emulator.order("silent", 0)
        camera.snap()
        emulator.order("wrong_size", 1)
        with pytest.raises(WrongFrameError, match="infrared chip were rejected"):
            list(camera.stream())
        emulator.order("wrong_size", 0)
        camera.snap()


def test_one_chip_of_two_streams() -> None:
    with Emulator(size_px=SIZE_PX, model="two-streams", addresses=TWO_STREAMS) as emulator:
        whole = pattern((SIZE_PX[1], SIZE_PX[0]))
        for number, chip in enumerate(("visible", "infrared")):
            with ChipCamera(two_sources(emulator), chip) as camera:  # type: ignore[arg-type]
                pixels = camera.snap().pixels
            np.testing.assert_array_equal(pixels, whole.frame(number, TestPattern.exposure(pixels), 8))


def test_a_camera_of_one_chip() -> None:
    """The fake cameras of Aravis: one device, one stream, and other feature names than the emulator."""
    with fake_twin(SIZE_PX, 30.0) as fakes:
        device = fakes.capture.infrared.device
        assert device is not None
        config = AravisConfig(device=device, visible=ChipConfig(pixel_format="Mono8"), exposure_us=5000.0, timeout_s=10)
        with ChipCamera(config) as camera:
            pixels = camera.snap().pixels
            whole = pattern((SIZE_PX[1], SIZE_PX[0]))
            np.testing.assert_array_equal(pixels, whole.frame(1, TestPattern.exposure(pixels), 8))
            assert camera.config.visible.exposure_us == 5000
        both = AravisConfig(
            visible=ChipConfig(device=device, pixel_format="BayerRG8"),
            infrared=ChipConfig(device=device, pixel_format="Mono8"),
        )
        with pytest.raises(CameraError, match=r"1 stream channel\(s\)(?s:.)*--chip visible"):
            AravisCamera(both)


def test_a_camera_of_one_colour_chip_makes_shots() -> None:
    with fake_twin(SIZE_PX, 30.0) as fakes:
        device = str(fakes.capture.infrared.device)
        config = AravisConfig(device=device, visible=ChipConfig(pixel_format="BayerBG8"), timeout_s=10.0)
        with AravisCamera(config) as camera:
            shots = [camera.snap(), *camera.stream(3, keep="all")]
            assert camera.config.chips == 1
            assert camera.config.infrared == ChipConfig()
            assert list(camera.statistics().chips) == ["visible"]
        whole = pattern((SIZE_PX[1], SIZE_PX[0]))
        for shot in shots:
            assert isinstance(shot, BayerShot)
            assert shot.bayer == "bggr"
            np.testing.assert_array_equal(shot.raw, whole.frame(1, TestPattern.exposure(shot.raw), 8))
            assert sees_no_infrared(shot)
        with pytest.raises(CameraError, match="visible chip: expected a colour format, got Mono8; set a Bayer format"):
            AravisCamera(config.model_copy(update={"visible": ChipConfig(pixel_format="Mono8")}))


def test_the_visible_chip_of_two_makes_shots_alone(emulator: Emulator) -> None:
    config = emulated(emulator, "RGB8").model_copy(update={"chips": 1, "infrared": ChipConfig()})
    with AravisCamera(config) as camera:
        shot = camera.snap()
    assert isinstance(shot, Shot)
    whole = pattern((SIZE_PX[1], SIZE_PX[0]))
    np.testing.assert_array_equal(shot.red, whole.frame(0, TestPattern.exposure(shot.red), 8))
    assert sees_no_infrared(shot)


def test_a_camera_that_is_not_on_a_network() -> None:
    """The simulated device of Aravis represents USB3 Vision: no packets, no addresses, no controller."""
    aravis = aravis_binding()
    aravis.enable_interface("Fake")
    try:
        region = ChipConfig(offset_px=(16, 8))
        config = AravisConfig(
            device="Fake_1", features={"Width": 128, "Height": 64}, frame_rate_hz=50.0, visible=region
        )
        with ChipCamera(config) as camera:
            assert camera.config.visible.offset_px == (16, 8)
            images = list(camera.stream(5, keep="all"))
    finally:
        aravis.disable_interface("Fake")
    assert {image.pixels.shape for image in images} == {(64, 128)}
    assert len({image.id for image in images}) == 5


def test_one_device_with_two_streams() -> None:
    with (
        Emulator(size_px=SIZE_PX, model="two-streams", addresses=TWO_STREAMS) as emulator,
        AravisCamera(two_sources(emulator)) as camera,
    ):
        assert len({checked_exposure(shot) for shot in camera.stream(10, keep="all")}) == 10
        emulator.order("lost_packets", 0.05)
        assert len({checked_exposure(shot) for shot in camera.stream(20, keep="all")}) == 20


def test_the_short_name_finds_both_chips(emulator: Emulator) -> None:
    assert [device.model for device in found()] == [f"{MODEL}_#0", f"{MODEL}_#1"]
    for name in (MODEL, SERIAL, "127.0.0.1", ""):
        with AravisCamera(AravisConfig(device=name)) as camera:
            assert camera.name == f"JAI Ltd., Japan {MODEL} {SERIAL}"
            assert (camera.config.visible.device, camera.config.infrared.device) == emulator.addresses
    with pytest.raises(CameraNotFoundError, match=r"is one of two chips"):
        AravisCamera(AravisConfig(device=f"{MODEL}_#0"))
    with pytest.raises(CameraNotFoundError, match=r"no camera answers to the name 'BFLY'(?s:.)*AD-080GE_#0 E000001 at"):
        AravisCamera(AravisConfig(device="BFLY"))


@pytest.mark.usefixtures("emulator")
def test_an_ambiguous_name_is_refused() -> None:
    with Emulator(size_px=SIZE_PX, addresses=SECOND, serial="E000002"):
        with pytest.raises(CameraNotFoundError, match="fits several cameras"):
            AravisCamera(AravisConfig(device=MODEL))
        with AravisCamera(AravisConfig(device="E000002")) as camera:
            assert camera.config.visible.device == "127.0.0.3"
            checked_exposure(camera.snap())


def test_exposure_steps_are_read_back(emulator: Emulator) -> None:
    config = emulated(emulator, exposure_us=10_000.0, frame_rate_hz=50.0)
    with AravisCamera(config) as camera:
        assert camera.config.visible.exposure_us == pytest.approx(20 + 237 * 42.07)
        assert camera.config.infrared.exposure_us == camera.config.visible.exposure_us
        began = time.monotonic()
        list(camera.stream(25, keep="all"))
        assert time.monotonic() - began > 0.4, "50 frames a second, not more"
    with pytest.raises(CameraError, match=r"exposure_us: expected 20 to 33339 us, got 40000"):
        AravisCamera(emulated(emulator, exposure_us=40_000.0))


def test_features_by_name(emulator: Emulator) -> None:
    with AravisCamera(emulated(emulator, features={"Height": 48, "GainRaw": 7})) as camera:
        assert (camera.config.visible.gain, camera.config.infrared.gain) == (7, 7)
        shot = camera.snap()
        whole = pattern((SIZE_PX[1], SIZE_PX[0]))
        np.testing.assert_array_equal(shot.ir, whole.frame(1, whole.exposure(shot.ir), 8)[:48])
    with pytest.raises(CameraError, match="NoSuchFeature"):
        AravisCamera(emulated(emulator, features={"NoSuchFeature": 1}))


@pytest.mark.parametrize(
    ("visible", "infrared", "reason"),
    [
        ("BayerRG12", "Mono8", "different full scales"),
        ("Mono8", None, "Mono8"),
        (None, "BayerRG8", "BayerRG8"),
    ],
)
def test_formats_that_do_not_fit(emulator: Emulator, visible: str, infrared: str, reason: str) -> None:
    with pytest.raises(CameraError, match=reason):
        AravisCamera(emulated(emulator, visible, infrared))
    with AravisCamera(emulated(emulator, "BayerRG8", "Mono8")) as camera:
        checked_exposure(camera.snap())


def test_software_triggers(emulator: Emulator) -> None:
    before = [int(count) for count in emulator.order("sent").split()]
    with AravisCamera(emulated(emulator, trigger="software")) as camera:
        first = checked_exposure(camera.snap())
        assert [checked_exposure(camera.snap()) for _ in range(3)] == [first + n for n in (1, 2, 3)]
        assert [checked_exposure(shot) for shot in camera.stream(5)] == [first + n for n in (4, 5, 6, 7, 8)]
        after = [int(count) for count in emulator.order("sent").split()]
        assert after == [count + 9 for count in before], "one exposure for each trigger"


def test_a_line_trigger(emulator: Emulator) -> None:
    with AravisCamera(emulated(emulator, trigger="Line5", timeout_s=5.0)) as camera:
        pulses = threading.Thread(target=lambda: [(time.sleep(0.05), emulator.order("line")) for _ in range(20)])
        pulses.start()
        exposures = [checked_exposure(shot) for shot in camera.stream(5, keep="all")]
        pulses.join()
    assert exposures == list(range(exposures[0], exposures[0] + 5))


def test_borrowed_arrays_go_back_by_themselves(emulator: Emulator) -> None:
    config = emulated(emulator, frame_rate_hz=100.0, buffers=8)
    with AravisCamera(config) as camera:
        kept = []
        for number, shot in enumerate(camera.stream(60, keep="all", borrow=True)):
            checked_exposure(shot)
            assert isinstance(shot, BayerShot)
            assert not shot.raw.flags.owndata
            assert not shot.raw.flags.writeable
            if number in (20, 40):
                kept.append((checked_exposure(shot), shot.raw[1:], shot))
    del shot
    gc.collect()
    for exposure, part, shot in kept:
        assert checked_exposure(shot) == exposure, "what is kept stays as it was, also after the camera is closed"
        np.testing.assert_array_equal(part, shot.raw[1:])


def test_a_camera_leaves_nothing_behind(emulator: Emulator) -> None:
    before = threading.active_count()
    for _ in range(3):
        with AravisCamera(emulated(emulator)) as camera:
            camera.snap()
    deadline = time.monotonic() + 3
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.05)
    assert threading.active_count() <= before
