"""Any projector that is a screen of the computer: its native size, and exposures of whole frames."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from support.screens import SIZE_PX, SYSTEM, FakeWindow, capture, screen, windows
from support.videos import FakeCapture
from typer.testing import CliRunner

from quadfringe.cli.app import app
from quadfringe.config import (
    AravisConfig,
    ChipConfig,
    Fringes,
    ProjectorsConfig,
    ReplayConfig,
    SystemConfig,
    UvcConfig,
    load_system,
)
from quadfringe.devices import _frames, open_devices, open_projector
from quadfringe.devices.hdmi import PICTURE_MODES, HdmiProjectors
from quadfringe.devices.light import Levels, Light, Step, light_images
from quadfringe.errors import CameraWarning, ConfigError, InputError
from quadfringe.scanner import open_system

STEP = Step(8.0, 0.0, "columns", "visible")

__all__ = ["capture", "windows"]


def system(capture: AravisConfig | UvcConfig | None = None, **settings: object) -> SystemConfig:
    given = {} if capture is None else {"capture": capture}
    return SystemConfig(projectors=ProjectorsConfig(visible=screen(**settings)), **given)


@pytest.mark.parametrize("light", [Fringes(numbers=(36, 35, 30)), Levels((1.0, 0.5, 0.0, 1.0)), STEP])
@pytest.mark.parametrize("size_px", [(1280, 720), (1920, 1080), (912, 1140)])
def test_light_is_shown_pixel_by_pixel(windows: list[FakeWindow], light: Light, size_px: tuple[int, int]) -> None:
    with HdmiProjectors(ProjectorsConfig(visible=screen(size_px=size_px))) as projector:
        projector.show(light)
        np.testing.assert_array_equal(windows[0].image, light_images(light, size_px).visible)
    assert windows[0].closed


def test_a_second_screen_shows_infrared(windows: list[FakeWindow]) -> None:
    both = ProjectorsConfig(visible=screen(output="HDMI-1"), infrared=screen(output="HDMI-2"))
    with HdmiProjectors(both) as projector:
        assert repr(projector) == "HdmiProjectors(visible HDMI-1, infrared HDMI-2)"
        projector.show(Fringes())
        infrared = light_images(Fringes(), SIZE_PX).infrared
        np.testing.assert_array_equal(windows[1].image, np.repeat(infrared[:, :, None], 3, axis=2))
        projector.show(Step(8.0, 0.0, "columns", "infrared"))
        assert not windows[0].image.any()


def test_what_one_projector_cannot_show(windows: list[FakeWindow]) -> None:
    with open_projector(system()) as projector:  # type: ignore[attr-defined]
        with pytest.raises(ConfigError, match=r"no infrared projector; name it under \[projectors\.infrared\]"):
            projector.show(Step(8.0, 0.0, "columns", "infrared"))
        with pytest.raises(ValueError, match="fringe"):
            projector.show(Fringes(numbers=(16, 8, 4)))
        with pytest.raises(InputError, match="needs a calibration of both projectors"):
            projector.show(Fringes(predeformed_z_mm=800))
    assert len(windows) == 1


def test_only_a_new_image_is_waited_for(windows: list[FakeWindow], monkeypatch: pytest.MonkeyPatch) -> None:
    waits_s: list[float] = []
    monkeypatch.setattr("quadfringe.devices.hdmi.time.sleep", waits_s.append)
    with HdmiProjectors(ProjectorsConfig(visible=screen(settle_s=0.3))) as projector:
        for light in (Fringes(), Fringes(), STEP):
            projector.show(light)
    assert waits_s == [0.3, 0.3]
    assert windows[0].closed


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ("size_px = [1280, 720]\n[projectors.infrared]\nport = '1-2'\nhdmi = {}", "infrared of the same kind and size"),
        ("", r"projectors\.visible\.size_px: this key is required"),
        ("size_px = [1280, 720]\nport = '1-1'", r"projectors\.visible\.port: this key is not known"),
        (
            "size_px = [1280, 720]\n[projectors.infrared]\nkind = 'hdmi'\nsize_px = [1280, 720]",
            "expected an output for each projector, and two of them",
        ),
    ],
)
def test_settings_at_fault(tmp_path: Path, table: str, reason: str) -> None:
    file = tmp_path / "system.toml"
    file.write_text(f"[projectors.visible]\nkind = 'hdmi'\n{table}\n")
    with pytest.raises(ConfigError, match=reason):
        load_system(file)


def test_a_lightcrafter_and_a_screen_are_no_pair() -> None:
    lightcrafter = {"port": "1-1", "hdmi": {}}
    with pytest.raises(ConfigError, match=r"visible is of kind hdmi: .* a LightCrafter in video mode is a screen"):
        ProjectorsConfig.model_validate({"visible": screen(output="HDMI-1"), "infrared": lightcrafter})
    with pytest.raises(ConfigError, match="visible is of kind lightcrafter: expected infrared of the same kind"):
        ProjectorsConfig.model_validate({"visible": lightcrafter, "infrared": screen(output="HDMI-1")})
    as_screens = [screen(output=f"HDMI-{n}", size_px=(912, 1140)) for n in (1, 2)]
    assert ProjectorsConfig(visible=as_screens[0], infrared=as_screens[1]).lightcrafters is None


def test_kinds_at_fault() -> None:
    with pytest.raises(ConfigError, match='expected a table whose kind is "lightcrafter", the default, or "hdmi"'):
        ProjectorsConfig.model_validate({"visible": {"kind": "laser"}})
    one = {"port": "1-1", "hdmi": {}}
    with pytest.raises(ConfigError, match='also a LightCrafter in video mode, is of kind "hdmi"'):
        ProjectorsConfig.model_validate({"visible": one})
    older = ProjectorsConfig.model_validate(
        {"kind": "lightcrafter", "visible": one, "infrared": {"port": "1-2", "hdmi": {}, "leds": "r"} | {"hdmi": None}}
        | {"infrared": {"port": "1-2", "flash": {"image": 0, "fringes": {}}}}
    )
    assert older.lightcrafters is not None
    with pytest.raises(ConfigError, match="got LightCrafters; use open_projector"):
        HdmiProjectors(older)


@pytest.mark.parametrize(
    ("wanted_us", "rate_hz", "whole_us"),
    [(1000, 60.0, 16666.7), (24_000, 60.0, 16666.7), (26_000, 60.0, 33333.3), (20_000, 50.0, 20_000.0)],
)
def test_whole_frames(wanted_us: float, rate_hz: float, whole_us: float) -> None:
    assert _frames.whole_frames_us(wanted_us, rate_hz) == whole_us


@pytest.mark.usefixtures("windows")
def test_an_exposure_of_a_part_of_a_frame_is_a_warning(capture: FakeCapture) -> None:
    with pytest.warns(CameraWarning, match=r"exposure_us: 20000 us is 1\.20 frames .*60 Hz.* set 16666\.7") as warned:
        open_devices(system(UvcConfig(exposure_us=20_000))).camera.close()
    assert len(warned) == 1
    open_devices(system(UvcConfig(exposure_us=16_700))).camera.close()  # within a step of the camera
    devices = open_devices(system(UvcConfig(exposure_us=20_000), match_exposure=True))
    devices.camera.close()
    assert devices.config.capture.exposure_us == 16_700  # type: ignore[union-attr]
    assert capture.get(cv2.CAP_PROP_EXPOSURE) == 167


def test_exposures_of_each_chip_become_whole_frames() -> None:
    chips = AravisConfig(visible=ChipConfig(exposure_us=20_000), infrared=ChipConfig(exposure_us=40_000))
    matched = _frames.with_whole_frames(system(chips, match_exposure=True)).capture
    assert _frames.exposures_us(system(matched)) == {  # type: ignore[arg-type]
        "visible.exposure_us": 16_666.7,
        "infrared.exposure_us": 33_333.3,
    }
    assert _frames.with_whole_frames(system(chips)).capture == chips


def test_the_rate_is_that_of_the_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [("HDMI-1", 1280, 720, 50.0, None), ("DP-1", 1920, 1080, 144.0, None)]
    monkeypatch.setattr("quadfringe._core.outputs", lambda: rows)
    one = system(UvcConfig(exposure_us=30_000), frame_rate_hz=None, match_exposure=True, output="HDMI-1")
    assert _frames.exposures_us(_frames.with_whole_frames(one)) == {"exposure_us": 40_000.0}
    unnamed = system(UvcConfig(exposure_us=30_000), frame_rate_hz=None, match_exposure=True)
    assert _frames.exposures_us(_frames.with_whole_frames(unnamed)) == {"exposure_us": 33_333.3}


@pytest.mark.usefixtures("capture")
def test_fringes_cover_the_columns_of_the_screen(tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM)
    with open_system(tmp_path) as scanner:
        assert scanner.projector_width_px == 1280
        assert scanner.grab().images["red"].shape == (180, 320)


@pytest.mark.usefixtures("capture")
def test_a_replay_knows_the_columns_of_the_screen(tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM)
    take = tmp_path / "take.h5"
    done = CliRunner().invoke(app, ["record", str(tmp_path / "system.toml"), "--out", str(take), "--shots", "2"])
    assert done.exit_code == 0, done.output
    with open_system(SystemConfig(capture=ReplayConfig(file=take))) as scanner:
        assert scanner.projector_width_px == 1280
        assert repr(scanner.projector) == "ExternalLight()"


@pytest.mark.parametrize("command", ["status", "pause", "stop", "start"])
def test_a_screen_takes_no_commands(tmp_path: Path, command: str) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM)
    done = CliRunner().invoke(app, ["projector", command, "--system", str(tmp_path / "system.toml")])
    assert done.exit_code == 2
    assert "is of kind hdmi, which takes no commands" in done.stderr


def test_projector_show_tells_what_to_check(windows: list[FakeWindow], tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(SYSTEM)
    command = ["projector", "show", "--system", str(tmp_path / "system.toml"), "--seconds", "0"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert PICTURE_MODES[0] in done.stdout
    np.testing.assert_array_equal(windows[0].image, light_images(Fringes(), SIZE_PX).visible)
