"""`doctor --system`: faults of screens and webcams, as real devices have them, and what to do about each."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.screens import screen
from support.videos import FakeCapture, let_opencv_open
from typer.testing import CliRunner

from quadfringe.cli.app import app
from quadfringe.config import (
    AravisConfig,
    FilesConfig,
    Fringes,
    ProjectorsConfig,
    Response,
    SystemConfig,
    UvcConfig,
)
from quadfringe.data import ResponseCalibration
from quadfringe.devices.virtual import VirtualBench
from quadfringe.doctor import Finding, examine_system

SMALLER = ("eDP-1", 1920, 1080, 60.0, "1920 x 1080 pixels, not 1280 x 720: set its mode, unscaled")
SOUND = [("HDMI-1", 1280, 720, 60.0, None), SMALLER]
WEBCAM = UvcConfig(exposure_us=66_700, gamma=100)
RGB = Fringes(encoding="rgb")


class Webcam(FakeCapture):
    """A webcam that sends a frame every `period_s`, whose brightness changes by `drift` from frame to frame."""

    period_s, drift = 0.0667, 0.0

    def __init__(self) -> None:
        super().__init__(("YUYV",))
        self.controls |= {cv2.CAP_PROP_EXPOSURE: 667, cv2.CAP_PROP_GAMMA: 100, cv2.CAP_PROP_FPS: 15}

    def grab(self) -> bool:
        time.sleep(self.period_s)
        self.grabbed += 1
        return True

    def retrieve(self) -> tuple[bool, np.ndarray[Any, Any]]:
        return True, np.full((24, 32, 3), 100 * (1 + self.drift * (self.grabbed % 2)), np.uint8)


@pytest.fixture
def webcam(monkeypatch: pytest.MonkeyPatch) -> Webcam:
    fake = Webcam()
    monkeypatch.setattr("quadfringe.doctor.cameras.FRAMES", 4)
    monkeypatch.setattr("quadfringe._core.outputs", lambda _=None: SOUND)
    let_opencv_open(fake, monkeypatch)
    return fake


def system(capture: object = WEBCAM, fringes: Fringes = RGB, **settings: object) -> SystemConfig:
    given = {"output": "HDMI-1"} | settings
    return SystemConfig(capture=capture, projectors=ProjectorsConfig(visible=screen(**given)), fringes=fringes)  # type: ignore[arg-type]


def faults(config: SystemConfig) -> dict[str, Finding]:
    return {one.name: one for one in examine_system(config) if one.grade != "good"}


@pytest.mark.usefixtures("webcam")
def test_a_sound_system_has_nothing_wrong() -> None:
    found = examine_system(system())
    assert {one.name: one.found for one in found if one.grade != "good"} == {}
    names = ["settings", "visible screen", "exposure in frames", "camera", "camera format", "camera exposure"]
    assert [one.name for one in found] == [*names, "camera gamma", "camera rate", "camera steadiness"]


SCREENS = {
    "size": ([("HDMI-1", 1920, 1080, 60.0, "1920 x 1080 pixels, not 1280 x 720")], "not 1280", "--mode 1280x720"),
    "scaling": ([("HDMI-1", 1280, 720, 60.0, "scaled from a mode of 1920 x 1080")], "scaled from", "a scale of 100 %"),
    "absent": ([SMALLER], "no output HDMI-1 is active; active outputs: eDP-1 (1920 x 1080)", "extend the desktop"),
    "none": ([], "active outputs: none", "switch the projector on"),
}


@pytest.mark.usefixtures("webcam")
@pytest.mark.parametrize("what", SCREENS)
def test_screens_at_fault(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rows, words, fix = SCREENS[what]
    monkeypatch.setattr("quadfringe._core.outputs", lambda _=None: rows)
    found = faults(system())["visible screen"]
    assert found.grade == "fault"
    assert words in found.found
    assert fix in found.fix


@pytest.mark.usefixtures("webcam")
def test_screens_that_cannot_be_told_apart_or_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    twins = [("HDMI-1", 1280, 720, 60.0, None), ("HDMI-2", 1280, 720, 60.0, None)]
    monkeypatch.setattr("quadfringe._core.outputs", lambda _=None: twins)
    assert faults(system(output=None))["visible screen"].fix == 'name one of them: output = "HDMI-1"'

    def no_display(_: object = None) -> None:
        raise OSError("no display")

    monkeypatch.setattr("quadfringe._core.outputs", no_display)
    assert "graphical session" in faults(system())["visible screen"].fix


@pytest.mark.usefixtures("webcam")
def test_rates_and_exposures_that_do_not_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadfringe._core.outputs", lambda _=None: [("HDMI-1", 1280, 720, 50.0, None)])
    assert faults(system())["visible screen rate"].found == "frame_rate_hz is 60, and HDMI-1 runs at 50 Hz"
    found = faults(system(frame_rate_hz=None))
    assert found["exposure in frames"].fix.startswith("set 60000, or match_exposure")
    assert found["exposures of a calibration"].fix.startswith("set 80000.0 us (4 frames)")
    assert "exposure in frames" not in faults(system(frame_rate_hz=None, match_exposure=True))


def test_webcams_at_fault(webcam: Webcam) -> None:
    webcam.formats, webcam.format = ("MJPG",), "MJPG"
    webcam.stuck = {cv2.CAP_PROP_AUTO_EXPOSURE, cv2.CAP_PROP_AUTO_WB}
    webcam.drift = 0.06
    found = faults(system(UvcConfig()))
    assert found["camera format"].fix.startswith("take an uncompressed one, such as YUYV")
    assert found["camera exposure"].fix.startswith("set whole frames of the projector, such as 66667")
    assert found["camera gamma"].fix.startswith("set the value of linear light, 100 for most cameras")
    assert found["camera steadiness"].found == "the brightness of 4 frames differs by 5.8 %"
    assert "v4l2-ctl --list-ctrls-menus" in found["camera automatic"].fix
    automatic = [one for one in examine_system(system(UvcConfig())) if one.name == "camera automatic"]
    assert [one.grade for one in automatic] == ["fault", "warning"]


def test_frames_that_come_too_fast_or_too_slowly(webcam: Webcam) -> None:
    webcam.period_s = 0.01
    fast = faults(system())["camera rate"]
    assert (fast.grade, "cannot be exposed for 66.7 ms" in fast.found) == ("fault", True)
    assert fast.fix.startswith("set frame_rate_hz to 15 or less")
    webcam.period_s = 0.12
    slow = faults(system())["camera rate"]
    assert (slow.grade, slow.fix.startswith("use a USB port without other devices")) == ("warning", True)


def test_a_camera_that_refuses_a_value_is_named(webcam: Webcam) -> None:
    webcam.stuck = {cv2.CAP_PROP_GAMMA}
    webcam.controls[cv2.CAP_PROP_GAMMA] = 220
    refused = faults(system())["camera"]
    assert "gamma: asked for 100, the camera took 220" in refused.found
    assert refused.fix.startswith("choose a value that it has")


@pytest.mark.usefixtures("webcam")
def test_other_cameras(tmp_path: Path) -> None:
    missing = faults(system(FilesConfig(folder=tmp_path / "none")))["camera"]
    assert (missing.grade, "no such folder" in missing.found) == ("fault", True)
    found = examine_system(system(FilesConfig(folder=tmp_path)))
    assert [one.grade for one in found] == ["good"] * len(found)
    assert "its program must write PNG or TIFF, not JPEG" in found[-1].found
    assert faults(system(AravisConfig(device="none")))["camera"].grade == "fault"


@pytest.mark.usefixtures("webcam")
def test_settings_that_do_not_belong_together(tmp_path: Path) -> None:
    assert faults(system(fringes=Fringes()))["settings"].fix == 'add [fringes] with encoding = "rgb"'
    bench = VirtualBench(SystemConfig(fringes=RGB)).calibration()
    twice = bench.model_copy(update={"projector_response": Response.from_powers((0.0,) * 4, (0.5,) * 4)})
    twice.save(tmp_path / "calibration.json")
    ResponseCalibration().save(tmp_path / "response.json")
    known = system().model_copy(update={"calibration": tmp_path / "calibration.json"})
    assert "912 x 1140 pixels, this system has 1280 x 720" in faults(known)["settings"].found
    decode = known.decode.model_copy(update={"response": tmp_path / "response.json"})
    assert faults(known.model_copy(update={"decode": decode}))["settings"].fix == "leave the response out"


@pytest.mark.usefixtures("webcam")
def test_the_command_lists_what_to_check_by_hand(tmp_path: Path) -> None:
    (tmp_path / "system.toml").write_text(
        '[capture]\nkind = "uvc"\nexposure_us = 66700\n[projectors.visible]\nkind = "hdmi"\noutput = "HDMI-1"\n'
        'size_px = [1280, 720]\n[fringes]\nencoding = "rgb"\n'
    )
    command = ["doctor", "--system", str(tmp_path / "system.toml"), "--json", str(tmp_path / "found.json")]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert "check by hand:\n  keystone correction" in done.stdout
    assert "WARNING camera gamma: gamma is not stated, and is 100 in the device" in done.stdout
    assert "0 faults, 1 warnings" in done.stdout
    grades = {one["name"]: one["grade"] for one in json.loads((tmp_path / "found.json").read_text())["findings"]}
    assert (grades["visible screen"], grades["camera gamma"]) == ("good", "warning")
    both = CliRunner().invoke(app, ["doctor", str(tmp_path), "--camera", "virtual:"])
    assert (both.exit_code, "give one of them" in both.stderr) == (2, True)
