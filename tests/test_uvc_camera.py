"""A webcam through OpenCV: settings are fixed and read back, frames are fresh; a video file in its place."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from support.shots import sees_no_infrared
from support.videos import FakeCapture, let_opencv_open, write_video
from typer.testing import CliRunner

from quadfringe.calibration.session.exposures import exposed
from quadfringe.cli.app import app
from quadfringe.config import SystemConfig, UvcConfig, load_system
from quadfringe.data import BayerShot
from quadfringe.devices import open_camera, open_devices
from quadfringe.devices.uvc import UvcCamera, _source, found
from quadfringe.errors import (
    CameraBusyError,
    CameraError,
    CameraLostError,
    CameraNotFoundError,
    CameraWarning,
    ConfigError,
    MissingExtraError,
    ShotTimeoutError,
)
from quadfringe.recording import Recording

SHAPE = (24, 32)


@pytest.fixture
def capture(monkeypatch: pytest.MonkeyPatch) -> FakeCapture:
    """The camera that OpenCV opens, whichever is named."""
    fake = FakeCapture()
    let_opencv_open(fake, monkeypatch)
    return fake


def camera_of(**settings: object) -> UvcCamera:
    return UvcCamera(UvcConfig(**settings))  # type: ignore[arg-type]


def test_a_camera_is_made_manual_and_uncompressed(capture: FakeCapture) -> None:
    with camera_of(exposure_us=16_600, gain=5, white_balance_k=5000) as camera:
        accepted = camera.config
        shot = camera.snap()
    assert (accepted.pixel_format, accepted.exposure_us, accepted.gain) == ("YUYV", 16_600, 5)
    assert (accepted.white_balance_k, accepted.gamma, accepted.size_px) == (5000, None, (32, 24))
    expected = {cv2.CAP_PROP_AUTO_EXPOSURE: 1, cv2.CAP_PROP_AUTO_WB: 0, cv2.CAP_PROP_SHARPNESS: 0}
    assert {prop: capture.get(prop) for prop in expected} == expected
    assert capture.get(cv2.CAP_PROP_EXPOSURE) == 166, "in units of 100 us"
    assert sees_no_infrared(shot)
    assert camera.doubts == ()
    assert capture.released


def test_an_old_frame_is_not_taken_for_a_new_one(capture: FakeCapture) -> None:
    capture.stuck.add(cv2.CAP_PROP_BUFFERSIZE)
    with camera_of(skip_frames=2) as camera:
        assert int(camera.snap().images["red"][0, 0]) == 7, "4 waited in the driver, 2 may have begun before the call"
        before = capture.grabbed
        assert int(camera.snap().images["red"][0, 0]) == before + 7


def test_what_a_camera_does_not_take_is_an_error(capture: FakeCapture) -> None:
    with pytest.raises(CameraError, match="gamma: this camera does not let it be set; leave it out"):
        camera_of(gamma=100)
    assert capture.released
    capture.stuck.add(cv2.CAP_PROP_EXPOSURE)
    with pytest.raises(CameraError, match="exposure_us: asked for 5000 us, the camera took 15600 us; choose a value"):
        camera_of(exposure_us=5000)
    FakeCapture.__init__(capture)
    with pytest.raises(CameraError, match="pixel_format: asked for NV12, the camera sends MJPG"):
        camera_of(pixel_format="NV12")
    capture.stuck |= {cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FPS}
    with pytest.raises(CameraError, match="size_px: asked for 64 x 48, the camera sends 32 x 48"):
        camera_of(size_px=(64, 48))
    with pytest.raises(CameraError, match="frame_rate_hz: asked for 60 Hz, the camera took 30 Hz"):
        camera_of(frame_rate_hz=60)


@pytest.mark.parametrize(
    ("stuck", "formats", "words"),
    [
        (None, ("MJPG",), "the format is MJPG, whose compression changes the fringes; take an uncompressed one"),
        (cv2.CAP_PROP_AUTO_EXPOSURE, ("YUYV",), "the automatic exposure cannot be switched off"),
        (cv2.CAP_PROP_AUTO_WB, ("YUYV",), "the automatic white balance cannot be switched off"),
        (cv2.CAP_PROP_SHARPNESS, ("YUYV",), "the sharpening cannot be switched off"),
    ],
)
def test_doubts_are_warnings(capture: FakeCapture, stuck: int | None, formats: tuple[str, ...], words: str) -> None:
    FakeCapture.__init__(capture, formats)
    capture.stuck |= set() if stuck is None else {stuck}
    with pytest.warns(CameraWarning, match=words) as warned, camera_of() as camera:
        assert len(camera.doubts) == 1
    assert len(warned) == 1


def test_a_setting_that_changes_later_is_a_warning(capture: FakeCapture) -> None:
    with camera_of(gain=5) as camera:
        camera.snap()
        capture.controls[cv2.CAP_PROP_GAIN] = 30
        with pytest.warns(CameraWarning, match=r"gain is now 30, it was 5; another program or an automatic control"):
            camera.snap()


@pytest.mark.parametrize(("backend", "raw"), [("MSMF", -6), ("DSHOW", -6)])
def test_exposures_on_windows_are_powers_of_two(capture: FakeCapture, backend: str, raw: int) -> None:
    FakeCapture.__init__(capture, backend=backend)
    with camera_of(exposure_us=15_625) as camera:
        assert capture.get(cv2.CAP_PROP_EXPOSURE) == raw
        assert camera.config.exposure_us == 15_625
    with pytest.raises(CameraError, match="asked for 20000 us, the camera took 15625 us"):
        camera_of(exposure_us=20_000)
    FakeCapture.__init__(capture, backend="AVFOUNDATION")
    with pytest.raises(ConfigError, match="unit of the exposure is not known for the backend AVFOUNDATION"):
        camera_of(exposure_us=20_000)


def test_raw_mosaics(capture: FakeCapture) -> None:
    FakeCapture.__init__(capture, ("BA81",))
    capture.controls[cv2.CAP_PROP_CONVERT_RGB] = 1
    capture.raw = np.arange(24 * 32, dtype=np.uint16).reshape(1, -1)  # as V4L2 hands over what it does not convert
    with camera_of(bayer="bggr") as camera:
        shot = camera.snap()
        assert isinstance(shot, BayerShot)
        assert (shot.bayer, shot.raw.shape, shot.full_scale_value) == ("bggr", SHAPE, 65535)
        assert capture.get(cv2.CAP_PROP_CONVERT_RGB) == 0
        capture.raw = np.zeros((24, 32, 2), np.uint8)
        with pytest.raises(CameraError, match=r"expected a raw mosaic of 32 x 24 pixels, got shape \(24, 32, 2\)"):
            camera.snap()
    FakeCapture.__init__(capture, ("GREY",))
    capture.raw = np.zeros(SHAPE, np.uint8)
    with camera_of(pixel_format="GREY") as camera, pytest.raises(CameraError, match="expected colour images"):
        camera.snap()


def test_a_lost_camera_is_opened_again(capture: FakeCapture) -> None:
    with camera_of() as camera:
        capture.ends_after = capture.grabbed + 8
        with pytest.raises(CameraLostError, match="no longer sends frames: check its cable"):
            list(camera.stream(keep="all"))
        assert capture.released
        capture.ends_after = None
        assert camera.snap().id is not None


def test_closing_ends_a_stream_and_streams_exclude_each_other(capture: FakeCapture) -> None:
    camera = camera_of()
    stream = camera.stream(keep="all")
    next(stream)
    with pytest.raises(ValueError, match="already streams"):
        camera.snap()
    camera.close()
    camera.close()
    assert capture.released
    with pytest.raises(ValueError, match="closed"):
        list(stream)
    with pytest.raises(ValueError, match="is closed"):
        camera.snap()


def test_a_camera_that_is_not_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(_source, "SYSFS", tmp_path)
    assert found() == []
    for name, index, label in (("video0", 0, "Webcam"), ("video1", 1, "Webcam"), ("video10", 0, "HDMI in")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "index").write_text(f"{index}\n")
        (tmp_path / name / "name").write_text(f"{label}\n")
    assert [(one.where, one.name) for one in found()] == [("0", "Webcam"), ("10", "HDMI in")]
    with pytest.raises(CameraNotFoundError, match=r"no /dev/video77; .*: uvc:0 \(Webcam\), uvc:10 \(HDMI in\)"):
        open_camera("uvc:77")
    with pytest.raises(CameraNotFoundError, match=r"nowhere\.avi; check cable"):
        open_camera(f"uvc:{tmp_path / 'nowhere.avi'}")
    with pytest.raises(ConfigError, match='expected "uvc:0" with the number'):
        open_camera("uvc:")
    monkeypatch.setattr(_source, "_check_present", lambda *_: None)
    with pytest.raises(CameraBusyError, match="cannot be opened; close other programs"):
        open_camera("uvc:77")


def test_a_video_file_is_played_once_with_every_value(tmp_path: Path) -> None:
    path = write_video(tmp_path / "take.avi", SHAPE, 6)
    with open_camera(f"uvc:{path}") as camera:
        shots = list(camera.stream(keep="all"))
        assert [int(shot.images["red"][0, 0]) for shot in shots] == list(range(6))
        assert {int(shot.images["blue"][0, 0]) for shot in shots} == {2}
        with pytest.raises(ShotTimeoutError, match="no more frames: the video ended"):
            camera.snap()


def test_a_video_file_has_no_settings_and_compression_is_a_warning(tmp_path: Path) -> None:
    path = write_video(tmp_path / "take.avi", SHAPE, 2, "MJPG")
    with pytest.warns(CameraWarning, match="the format is MJPG"):
        open_camera(f"uvc:{path}").close()
    with pytest.raises(ConfigError, match=r"exposure_us, size_px: .* is a file, which has no settings"):
        camera_of(device=str(path), exposure_us=1000, size_px=(32, 24))
    (tmp_path / "text.avi").write_text("no video")
    with pytest.raises(CameraError, match="OpenCV cannot read this file; check that it is a video"):
        open_camera(f"uvc:{tmp_path / 'text.avi'}")


def test_a_system_file_and_the_commands_take_it(tmp_path: Path) -> None:
    path = write_video(tmp_path / "take.avi", SHAPE, 20)
    (tmp_path / "system.toml").write_text('capture = "uvc:take.avi"\n')
    config = load_system(tmp_path)
    assert config.capture == UvcConfig(device=str(path))
    devices = open_devices(config)
    with devices.camera:
        assert devices.config.capture.pixel_format == "FFV1"  # type: ignore[union-attr]
    done = CliRunner().invoke(app, ["record", "--camera", f"uvc:{path}", "--out", str(tmp_path / "take.h5")])
    assert done.exit_code == 0, done.output
    assert [int(shot.images["red"][0, 0]) for shot in Recording(tmp_path / "take.h5")] == list(range(20))
    done = CliRunner().invoke(app, ["camera", "snap", f"uvc:{path}", "--out", str(tmp_path / "shot")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "shot" / "green.png").exists()


def test_a_calibration_takes_levels_at_a_share_of_the_exposure() -> None:
    config = SystemConfig(capture=UvcConfig(exposure_us=10_000))
    assert exposed(config, 0.25).capture == UvcConfig(exposure_us=2500)
    with pytest.raises(ConfigError, match=r"capture\.exposure_us: missing"):
        exposed(SystemConfig(capture=UvcConfig()), 0.25)


def test_webcams_are_listed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def no_aravis() -> list[object]:
        raise MissingExtraError("cameras need Aravis")

    monkeypatch.setattr(_source, "SYSFS", tmp_path)
    monkeypatch.setattr("quadfringe.devices.aravis.found", no_aravis)
    assert "cameras need Aravis" in CliRunner().invoke(app, ["camera", "list"]).output
    (tmp_path / "video2").mkdir()
    (tmp_path / "video2" / "name").write_text("Webcam\n")
    done = CliRunner().invoke(app, ["camera", "list"])
    assert (done.exit_code, done.output) == (0, "uvc:2  Webcam\n")
