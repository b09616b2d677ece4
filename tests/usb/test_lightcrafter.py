"""One projector over the real libusb, from Python."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from usb_bench import Screen

from quadfringe.devices.lightcrafter import (
    LightCrafter,
    Pattern,
    PatternSequence,
    PatternWindow,
    lightcrafters,
    outputs,
    pack_flash,
    udev_rule,
)
from quadfringe.evaluation._testbed import Order

COLOURS = [Pattern(number, 8, led) for number, led in enumerate("grb")]


def test_equal_serial_numbers_are_told_apart_by_port(order: Order) -> None:
    assert [(port, serial) for port, _, serial in lightcrafters()] == [("1-1", "LCR2"), ("1-2", "LCR2")]
    for port in ("1-1", "1-2"):
        with LightCrafter(port) as projector:
            assert projector.firmware_tag() == f"QF-EMULATOR-{port}"
            assert (projector.port, repr(projector)) == (port, f'LightCrafter("{port}")')
    with pytest.raises(ValueError, match=r"1-1 .*1-2 .*choose one by its port"):
        LightCrafter()
    with pytest.raises(ValueError, match="more than one"):
        LightCrafter(serial="LCR2")
    with pytest.raises(ValueError, match="both"):
        LightCrafter("1-1", serial="LCR2")
    with pytest.raises(ValueError, match="such as 1-2"):
        LightCrafter("the left one")
    with pytest.raises(FileNotFoundError, match="no LightCrafter 4500 at port 1-9"):
        LightCrafter("1-9")
    order("1-1", "unplug")
    with LightCrafter() as projector:
        assert projector.port == "1-2"


def test_a_projector_has_one_owner_and_is_free_after_closing() -> None:
    first = LightCrafter("1-1")
    with pytest.raises(OSError, match="in use by another program"):
        LightCrafter("1-1")
    first.close()
    first.close()
    with pytest.raises(ValueError, match="is closed"):
        first.versions()
    with LightCrafter("1-1") as second:
        assert second.versions()["application"] == "4.4.0"


def test_without_permission_the_rule_is_named(order: Order) -> None:
    order("1-2", "deny")
    assert lightcrafters()[1][2] is None
    file, rule = udev_rule()
    with pytest.raises(PermissionError) as caught:
        LightCrafter("1-2")
    assert rule in str(caught.value)
    assert file in str(caught.value)


def test_faults_have_their_own_exceptions(order: Order) -> None:
    with LightCrafter("1-1") as projector:
        for fault, times, kind, reason in [
            ("refuse", 1, OSError, "refused"),
            ("truncate", 2, OSError, "malformed"),
            ("silence", 2, TimeoutError, "did not answer within 2000 ms"),
            ("wrong-sequence", 2, OSError, "sequence number"),
        ]:
            order("1-1", f"fault {fault} {times}")
            with pytest.raises(kind, match=reason):
                projector.versions()
            assert projector.firmware_tag() == "QF-EMULATOR-1-1", fault
        order("1-1", "fault unplug 1")
        with pytest.raises(ConnectionError, match="was disconnected"):
            projector.play(PatternSequence.from_flash(0, COLOURS, 8333))


def test_the_verbs(order: Order) -> None:
    with LightCrafter("1-1") as projector:
        state = projector.status()
        assert (state["power"], state["mode"], state["run"], state["faults"]) == ("normal", "video", "stopped", [])
        assert state["video_locked"]
        projector.sleep()
        assert projector.status()["parked"]
        projector.wake()
        assert projector.play(PatternSequence.from_flash(1, COLOURS, 8333)) == []
        assert (projector.status()["run"], projector.status()["mode"]) == ("running", "patterns")
        projector.pause()
        projector.start()
        projector.set_timing(9000, 9300)
        projector.stop()
        projector.start()
        assert projector.status()["running"]
        projector.stop()
        projector.show_flash_image(2)
        projector.show_test_pattern("checkerboard", foreground=(1023, 0, 0))
        assert projector.status()["input"] == "test-pattern"
        projector.show_video()
        assert not projector.status()["gamma"]
        with pytest.raises(ValueError, match="colour-bars"):
            projector.show_test_pattern("kittens")
        order("1-1", "video off")
        video = PatternSequence.from_video([Pattern(0, 8, "g")], 60.0, 16_000)
        with pytest.raises(OSError, match="not locked"):
            projector.load(video)
        projector.check_flash(3, "QF-EMULATOR-1-1")
        with pytest.raises(ValueError, match="at least 4"):
            projector.check_flash(4)
        assert projector.flash_image_count() == 3
        assert projector.measure_image_load_ms(0, 3) == pytest.approx(150.0)


def test_light_triggers_and_geometry() -> None:
    with LightCrafter("1-1") as projector:
        assert projector.led_drive() == (104, 135, 130)
        projector.set_led_drive((10, 20, 30))
        assert projector.led_drive() == (10, 20, 30)
        with pytest.raises(ValueError, match=r"at most \[104, 135, 130\]"):
            projector.set_led_drive((105, 0, 0))
        projector.set_leds("rb")
        projector.set_leds(None)
        with pytest.raises(ValueError, match="letters of rgb"):
            projector.set_leds("x")
        projector.set_led_delays_us((0.0, 1.0, 0.0), (0.0, 0.0, 0.0))
        projector.set_triggers(out_1_inverted=True, out_1_rising_us=-1.0, in_1_delay_us=500.0, in_2_falling=True)
        triggers = projector.triggers()
        assert triggers["out_1_inverted"]
        assert triggers["in_2_falling"]
        assert triggers["in_1_delay_us"] == pytest.approx(500.0, abs=0.06)
        projector.set_flips(True, False)
        assert projector.flips() == (True, False)
        projector.set_gamma(1)
        projector.set_gamma(None)
        projector.set_inverted(True)
        projector.set_frozen(True)
        assert projector.status()["frozen"]
    with LightCrafter("1-2", light="external") as projector, pytest.raises(ValueError, match="limit stated"):
        projector.set_led_drive((1, 1, 1))
    with LightCrafter("1-2", light="external", drive_limit=(9, 9, 9), current_inverted=False) as projector:
        projector.set_led_drive((1, 2, 3))
    with LightCrafter("1-2") as projector:
        assert projector.led_drive() == (254, 253, 252), "the register as TI's board understands it"
    with pytest.raises(ValueError, match="evm or external"):
        LightCrafter("1-2", light="laser")


def test_rules_of_sequences() -> None:
    with pytest.raises(ValueError, match="8333"):
        PatternSequence.from_flash(0, COLOURS, 5000)
    with pytest.raises(ValueError, match="one of them"):
        PatternSequence(COLOURS, [(8333, 8333)], trigger_mode="internal")
    with pytest.raises(ValueError, match="video-sync, internal"):
        PatternSequence(COLOURS, [(8333, 8333)], trigger_mode="now", images=[0])
    with pytest.raises(ValueError, match="internal, rising"):
        Pattern(0, 8, "g", trigger="later")
    timings = [(9000 + i, 10_000 + i) for i in range(3)]
    each = PatternSequence(COLOURS, timings, trigger_mode="variable-internal", images=[1], repeat=False)
    with LightCrafter("1-2") as projector:
        assert projector.play(each) == []


def test_the_window_is_pixel_exact(screen: Screen) -> None:
    ((name, width, height, _, unfit),) = outputs()
    assert (width, height, unfit) == (912, 1140, None)
    image = np.random.default_rng(7).integers(0, 256, (1140, 912, 3), np.uint8)
    with PatternWindow(name) as window:
        window.show(image)
        np.testing.assert_array_equal(screen.rgb(), image)
        with pytest.raises(ValueError, match=r"\(1140, 912, 3\)"):
            window.show(image.transpose(1, 0, 2))
        with pytest.raises(TypeError, match="3D uint8"):
            window.show(image[:, :, 0])
    with pytest.raises(ValueError, match="closed"):
        window.show(image)
    with pytest.raises(ValueError, match="no such output"):
        PatternWindow("HDMI-7")


def test_hammering_from_two_threads() -> None:
    def hammer(port: str, drive: int, answers: list[bool], count: int = 500) -> None:
        with LightCrafter(port) as projector:
            for i in range(count):
                projector.set_led_drive((drive, i % 100, 0))  # polarity, current, read back: three transactions
                answers.append(projector.led_drive() == (drive, i % 100, 0))

    answers: list[bool] = []
    threads = [threading.Thread(target=hammer, args=(port, drive, answers)) for port, drive in (("1-1", 1), ("1-2", 2))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [True] * 1000


def test_flash_images_are_packed_for_the_program_of_ti() -> None:
    import cv2

    values = [np.full((1140, 912), level, np.uint8) for level in (10, 20, 30)]
    values[0][0, 1] = 99
    files, places = pack_flash([(value, 8) for value in values])
    assert places == [(0, 0, 8), (0, 1, 8), (0, 2, 8)]
    image = cv2.imdecode(np.frombuffer(files[0], np.uint8), cv2.IMREAD_UNCHANGED)
    assert image.shape == (1140, 912, 3)
    np.testing.assert_array_equal(image[0, 0], [30, 10, 20])  # blue, green, red: green is the first pattern
    assert image[0, 1, 1] == 99
    with pytest.raises(ValueError, match=r"\(1140, 912\)"):
        pack_flash([(np.zeros((912, 1140), np.uint8), 8)])
    with pytest.raises(ValueError, match="0 to 1"):
        pack_flash([(values[0], 1)])
