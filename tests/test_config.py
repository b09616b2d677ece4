"""Settings: one TOML, everything wrong in it named at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from quadfringe.config import (
    DeviceModel,
    Response,
    SystemConfig,
    checked,
    load_system,
)
from quadfringe.errors import ConfigError, InputError


def write(folder: Path, text: str) -> Path:
    path = folder / "system.toml"
    path.write_text(text)
    return path


def test_an_empty_file_is_the_virtual_bench(tmp_path: Path) -> None:
    assert load_system(write(tmp_path, "")) == SystemConfig()


def test_every_problem_is_listed_with_its_path(tmp_path: Path) -> None:
    text = """
    kind = "quantum"
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
    for path in ("kind:", "scene.noise:", "decode.threads:"):
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
        checked(DeviceModel, {"width_px": 8, "height_px": 8, "centre_px": (1, 1)}, "x")


def test_one_number_stands_for_all_channels(tmp_path: Path) -> None:
    scene = load_system(write(tmp_path, "[scene]\nambient = 0.1\ngain = [1, 2, 3, 4]\n")).scene
    assert scene.ambient == (0.1,) * 4
    assert scene.gain == (1, 2, 3, 4)


def test_channels_that_are_left_out_are_linear() -> None:
    response = Response.model_validate({"red": {"exponent": 0.5}})
    assert response.rows() == [(0.0, 0.5, 0.0), *[(0.0, 1.0, 0.0)] * 3]
