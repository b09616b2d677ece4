"""Cameras without hardware: names of devices, pixel formats, and the message when the extra is missing."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from quadfringe.cli.app import app
from quadfringe.config import SystemConfig, checked
from quadfringe.config.cameras import AravisConfig, ReplayConfig, VirtualConfig, capture_config
from quadfringe.devices.aravis import _binding, _device
from quadfringe.devices.aravis import _profiles as profiles
from quadfringe.devices.aravis._formats import FORMATS, format_named
from quadfringe.devices.emulator.frames import TestPattern, packed
from quadfringe.errors import CameraError, CameraNotFoundError, ConfigError, MissingExtraError

VISIBLE = _device.Found("192.168.1.10", "JAI Ltd., Japan", "AD-080GE_#0", "4711")
INFRARED = _device.Found("192.168.1.11", "JAI Ltd., Japan", "AD-080GE_#1", "4711")
OTHER = _device.Found("192.168.1.20", "Basler", "acA1300", "99")


def chosen(config: AravisConfig, *devices: _device.Found) -> list[tuple[str, int]]:
    return [(place.where, place.stream) for place in profiles.places(config, lambda: devices)]


@pytest.mark.parametrize("name", ["AD-080GE", "ad-080ge", "4711", "JAI", "192.168.1.10", "192.168.1.11"])
def test_both_chips_of_a_jai_camera(name: str) -> None:
    both = [(VISIBLE.where, 0), (INFRARED.where, 0)]
    assert chosen(AravisConfig(device=name), INFRARED, OTHER, VISIBLE) == both


def test_a_camera_with_two_streams_and_chips_of_two_cameras() -> None:
    assert chosen(AravisConfig(), OTHER) == [(OTHER.where, 0), (OTHER.where, 1)]
    mixed = AravisConfig.model_validate({"visible": {"device": "4711"}, "infrared": {"device": "99"}})
    with pytest.raises(CameraNotFoundError, match="fits several"):
        chosen(mixed, VISIBLE, INFRARED, OTHER)
    mixed = AravisConfig.model_validate({"visible": {"device": "_#0"}, "infrared": {"device": "99"}})
    assert chosen(mixed, VISIBLE, INFRARED, OTHER) == [(VISIBLE.where, 0), (OTHER.where, 0)]


def test_cameras_that_are_not_meant() -> None:
    twin = [_device.Found(f"192.168.1.3{n}", "JAI Ltd., Japan", f"AD-080GE_#{n}", "4712") for n in (0, 1)]
    with pytest.raises(CameraNotFoundError, match=r"fits several cameras(?s:.)*4711(?s:.)*4712"):
        chosen(AravisConfig(device="AD-080GE"), VISIBLE, INFRARED, *twin)
    with pytest.raises(CameraNotFoundError, match="is one of two chips"):
        chosen(AravisConfig(), VISIBLE)
    with pytest.raises(CameraNotFoundError, match=r"no camera answers to no name(?s:.)*none"):
        chosen(AravisConfig())
    with pytest.raises(CameraNotFoundError, match="no camera answers to the name 'Flir'"):
        chosen(AravisConfig(device="Flir"), OTHER)


def test_one_chip() -> None:
    def one(config: AravisConfig, chip: str, *devices: _device.Found) -> tuple[str, int]:
        place = profiles.place(config, chip, lambda: devices)
        return place.where, place.stream

    everybody = (INFRARED, OTHER, VISIBLE)
    assert one(AravisConfig(device="AD-080GE"), "visible", *everybody) == (VISIBLE.where, 0)
    assert one(AravisConfig(device="AD-080GE"), "infrared", *everybody) == (INFRARED.where, 0)
    assert one(AravisConfig(device="_#1"), "visible", *everybody) == (INFRARED.where, 0)
    assert one(AravisConfig(device="Basler"), "visible", *everybody) == (OTHER.where, 0)
    assert one(AravisConfig(device="Basler"), "infrared", *everybody) == (OTHER.where, 1)
    with pytest.raises(CameraNotFoundError, match="fits several"):
        one(AravisConfig(), "visible", *everybody)


def test_exposures_of_a_jai_camera() -> None:
    assert [profiles.exposure_steps(us) for us in (20.0, 62.0, 33338.0)] == [0, 1, 792]
    for us in (19.0, 33400.0):
        with pytest.raises(CameraError, match="expected 20 to 33339 us"):
            profiles.exposure_steps(us)


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_to_the_bit(name: str) -> None:
    chosen_format = format_named(name)
    pattern = TestPattern((6, 8))
    data = np.frombuffer(packed(pattern, 0, 77, chosen_format.code, (8, 6)), np.uint8)
    assert len(data) == chosen_format.payload(8, 6)
    pixels = chosen_format.pixels(data, 8, 6)
    expected = pattern.frame(0, 77, chosen_format.bits)
    np.testing.assert_array_equal(pixels if chosen_format.colours == 1 else pixels[:, :, 1], expected)


@pytest.mark.parametrize("name", ["Mono10p", "BayerGB12p", "Mono12Packed", "BayerBG10Packed"])
@pytest.mark.parametrize("size_px", [(3, 5), (7, 3), (2, 1), (5, 2)])
def test_a_frame_may_end_within_a_group_of_pixels(name: str, size_px: tuple[int, int]) -> None:
    kind, (width, height) = FORMATS[name], size_px
    pixels = np.random.default_rng(1).integers(0, 1 << kind.bits, (height, width), dtype=np.uint16)
    if kind.packing == "p":
        bits = "".join(f"{value:0{kind.bits}b}"[::-1] for value in pixels.ravel())
        data = [int(bits[n : n + 8][::-1], 2) for n in range(0, len(bits), 8)]
    else:
        low, data = kind.bits - 8, []
        for first, *second in (pixels.ravel()[n : n + 2].tolist() for n in range(0, pixels.size, 2)):
            mask = (1 << low) - 1
            data += [first >> low, first & mask | sum(value & mask for value in second) << 4]
            data += [value >> low for value in second]
    assert len(data) == kind.payload(width, height)
    np.testing.assert_array_equal(kind.pixels(np.array(data, np.uint8), width, height), pixels)


def test_packing_as_the_standard_has_it() -> None:
    """Pixels 0x123 and 0x564 of 12 bits, 0x123 and 0x2AB of 10 bits and so on, packed by hand."""
    twelve = FORMATS["BayerRG12Packed"].pixels(np.array([0x12, 0x43, 0x56], np.uint8), 2, 1)
    ten = FORMATS["Mono10Packed"].pixels(np.array([0x48, 0x33, 0xAA], np.uint8), 2, 1)
    assert twelve.tolist() == [[0x123, 0x564]]
    assert ten.tolist() == [[0x123, 0x2AB]]
    streams = {
        "Mono12p": ([0x23, 0x41, 0x56], [[0x123, 0x564]]),
        "BayerRG12p": ([0xFF, 0x0F, 0x80], [[0xFFF, 0x800]]),
        "Mono10p": ([0x23, 0xAD, 0xFA, 0x4F, 0xC0], [[0x123, 0x2AB, 0x0FF, 0x301]]),
        "BayerRG10p": ([0xFF, 0x03, 0xF0, 0x3F, 0x00], [[0x3FF, 0x000, 0x3FF, 0x000]]),
    }
    for name, (data, pixels) in streams.items():
        assert FORMATS[name].pixels(np.array(data, np.uint8), len(pixels[0]), 1).tolist() == pixels, name
    with pytest.raises(CameraError, match="YUV422_8 is not supported; set pixel_format to one of Mono8"):
        format_named("YUV422_8")


def test_without_the_binding_the_install_lines_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gi", None)
    _binding.aravis_binding.cache_clear()
    with pytest.raises(MissingExtraError, match=r"apt-get install (?s:.)*aravis-0\.8(?s:.)*quadfringe\[aravis\]"):
        _device.found()
    result = CliRunner().invoke(app, ["camera", "list"])
    assert result.exit_code == 2
    assert "apt-get install" in result.stderr


@pytest.mark.parametrize(
    ("word", "kind"), [("virtual:", VirtualConfig), ("aravis:", AravisConfig), ("replay:a.h5", ReplayConfig)]
)
def test_a_camera_in_one_word(word: str, kind: type[Any]) -> None:
    assert isinstance(capture_config(word), kind)
    assert isinstance(checked(SystemConfig, {"capture": word}, "s.toml").capture, kind)


@pytest.mark.parametrize(
    ("capture", "reason"),
    [
        ("camera", r'capture: .*expected "virtual:", "aravis:NAME", "uvc:NUMBER", "files:FOLDER" or "replay:FILE"'),
        ("virtual:x", "nothing behind the colon"),
        ({"kind": "aravis", "devise": "x"}, r"capture\.aravis\.devise: this key is not known"),
        ({"kind": "aravis", "visible": {"pixel_format": "RAW"}}, r"capture\.aravis\.visible\.pixel_format"),
        ({"kind": "aravis", "exposure_us": 5, "visible": {"exposure_us": 5}}, "once for both chips, or for each chip"),
        ({"kind": "webcam"}, "webcam"),
    ],
)
def test_captures_at_fault_are_named(capture: object, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        checked(SystemConfig, {"capture": capture}, "s.toml")


class Knobs:
    """Features of a device: those in `stuck` keep their value."""

    def __init__(self, stuck: str = "", **values: object) -> None:
        self.values, self.stuck = values, stuck

    def has(self, name: str) -> bool:
        return name in self.values

    def get(self, name: str) -> object:
        return self.values[name]

    def set(self, name: str, value: object) -> None:
        if name == self.stuck:
            raise CameraError("locked")
        self.values[name] = value


def test_automatic_functions_of_one_colour_chip_are_switched_off() -> None:
    knobs = Knobs(ExposureAuto="Continuous", BalanceWhiteAuto="Continuous", GammaEnable=True, Gain=1)
    assert profiles.fix_colours(knobs, {"BalanceWhiteAuto": "Once"}) == []  # type: ignore[arg-type]
    assert knobs.values == {"ExposureAuto": "Off", "BalanceWhiteAuto": "Continuous", "GammaEnable": False, "Gain": 1}
    assert profiles.fix_colours(Knobs("GainAuto", GainAuto="Once"), {}) == ["GainAuto"]  # type: ignore[arg-type]


def test_a_camera_of_one_chip_has_no_settings_of_another() -> None:
    with pytest.raises(ConfigError, match="chips = 1 means that there is no infrared chip"):
        AravisConfig.model_validate({"chips": 1, "infrared": {"exposure_us": 5}})
