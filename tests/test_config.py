"""Settings: one TOML file, and one report of all its errors."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from quadfringe.config import (
    Device,
    Response,
    SystemConfig,
    checked,
    load_system,
)
from quadfringe.errors import ConfigError, InputError
from quadfringe.scanner import open_system


def write(folder: Path, text: str) -> Path:
    path = folder / "system.toml"
    path.write_text(text)
    return path


def test_an_empty_file_is_the_virtual_bench(tmp_path: Path) -> None:
    assert load_system(write(tmp_path, "")) == SystemConfig()


def test_every_problem_is_listed_with_its_path(tmp_path: Path) -> None:
    text = """
    colour = "quantum"
    [fringes]
    number = [36, 35, 30]
    [scene]
    noise = -0.1
    [decode]
    threads = 0
    """
    with pytest.raises(ConfigError) as caught:
        load_system(write(tmp_path, text))
    message = str(caught.value)
    assert "system.toml: 4 problems" in message
    assert "fringes.number: this key is not known" in message
    for path in ("colour:", "scene.noise:", "decode.threads:"):
        assert path in message


@pytest.mark.parametrize("value", ["nan", "inf", "-1.0", "'much'"])
def test_numbers_must_be_numbers(tmp_path: Path, value: str) -> None:
    with pytest.raises(ConfigError, match=r"scene\.noise"):
        load_system(write(tmp_path, f"[scene]\nnoise = {value}\n"))


def test_a_broken_toml_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"system\.toml: not valid TOML"):
        load_system(write(tmp_path, "[scene\n"))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no\.toml: No such file"):
        load_system(tmp_path / "no.toml")


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    text = 'calibration = "c.json"\n[scene]\nheight_map = {file = "h.npy", pitch_mm = [1, 1], origin_mm = [0, 0]}\n'
    config = load_system(write(tmp_path, text))
    assert config.calibration == tmp_path / "c.json"
    assert config.scene.height_map is not None
    assert config.scene.height_map.file == tmp_path / "h.npy"


def test_settings_are_frozen() -> None:
    with pytest.raises(ValidationError):
        SystemConfig().fringes.numbers = (16.0, 15.0, 12.0)  # type: ignore[misc]


def test_a_missing_key_is_named() -> None:
    with pytest.raises(ConfigError, match="focal_px: this key is required and missing"):
        checked(Device, {"width_px": 8, "height_px": 8, "centre_px": (1, 1)}, "x")


def test_one_number_stands_for_all_channels(tmp_path: Path) -> None:
    scene = load_system(write(tmp_path, "[scene]\nambient = 0.1\ngain = [1, 2, 3, 4]\n")).scene
    assert scene.ambient == (0.1,) * 4
    assert scene.gain == (1, 2, 3, 4)


def test_channels_that_are_left_out_are_linear() -> None:
    response = Response.model_validate({"red": {"exponent": 0.5}})
    assert response.rows == [(0.0, 0.5, 0.0), *[(0.0, 1.0, 0.0)] * 3]


VISIBLE = {"port": "1-1", "hdmi": {"output": "HDMI-1"}}
INFRARED = {"port": "1-2", "flash": {"image": 0, "fringes": {}}, "leds": "r"}


def test_a_pair_of_projectors_is_told_apart_by_ports() -> None:
    config = checked(SystemConfig, {"projectors": {"visible": VISIBLE, "infrared": INFRARED}}, "s.toml")
    assert config.projectors is not None
    assert (config.projectors.visible.port, config.projectors.infrared.leds) == ("1-1", "r")
    assert SystemConfig().projectors is None


@pytest.mark.parametrize(
    ("visible", "infrared", "reason"),
    [
        ({"port": "left"}, {}, "projectors.visible.port"),
        ({"hdmi": None}, {}, "expected hdmi or flash, and one of them"),
        ({"flash": INFRARED["flash"]}, {}, "expected hdmi or flash, and one of them"),
        ({}, {"port": "1-1"}, "both at port 1-1"),
        ({}, {"flash": None, "hdmi": {"output": "HDMI-1"}}, "an output for each projector"),
        ({"hdmi": {}}, {"flash": None, "hdmi": {"output": "HDMI-1"}}, "an output for each projector"),
        ({"led_drive": [1, 2, 256]}, {}, "projectors.visible.led_drive.2"),
        ({"brightness": 1}, {}, "projectors.visible.brightness: this key is not known"),
        ({"leds": "x"}, {}, "projectors.visible.leds"),
        ({"light": "external", "led_drive": [1, 1, 1]}, {}, "led_drive needs led_drive_limit"),
    ],
)
def test_projectors_at_fault_are_named(visible: dict[str, object], infrared: dict[str, object], reason: str) -> None:
    pair = {"visible": VISIBLE | visible, "infrared": INFRARED | infrared}
    with pytest.raises(ConfigError, match=re.escape(reason)):
        checked(SystemConfig, {"projectors": pair}, "s.toml")


def test_a_virtual_camera_is_not_sold_as_a_real_one() -> None:
    config = checked(SystemConfig, {"projectors": {"visible": VISIBLE, "infrared": INFRARED}}, "s.toml")
    with pytest.raises(ConfigError, match="the virtual camera cannot see real projectors"):
        open_system(config)
