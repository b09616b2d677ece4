"""A folder as a camera: images that another program writes become shots, and wrong ones are left out with a warning."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.folders import written_in_turn
from support.shots import first_values
from typer.testing import CliRunner

from quadfringe.cli.app import app
from quadfringe.config import FilesConfig, Fringes, SystemConfig, load_system
from quadfringe.data import BayerShot, Shape
from quadfringe.devices import open_camera
from quadfringe.devices.files import FilesCamera
from quadfringe.errors import CameraWarning, ConfigError, InputError, ShotTimeoutError
from quadfringe.io.images import write_image
from quadfringe.recording import Recording
from quadfringe.scanner import open_system

SHAPE = (24, 32)


def grey(value: int, dtype: type = np.uint8) -> np.ndarray:
    return np.full(SHAPE, value, dtype)


def colour(*values: int) -> np.ndarray:
    return np.stack([grey(value) for value in values], axis=2)


def watched(folder: Path, **settings: object) -> FilesCamera:
    return FilesCamera(FilesConfig(folder=folder, **({"settle_s": 0.05, "timeout_s": 10.0} | settings)))  # type: ignore[arg-type]


def later(write: Callable[[], object], after_s: float = 0.2) -> threading.Timer:
    timer = threading.Timer(after_s, write)
    timer.start()
    return timer


@pytest.mark.parametrize("names", ["{}", "007_{}", "{}-007", "shot 7/{}", "a/007.{}"])
def test_grey_images_become_a_shot_by_their_names(tmp_path: Path, names: str) -> None:
    def write() -> None:
        for value, role in enumerate(("red", "GREEN", "b", "infrared"), 1):
            path = tmp_path / f"{names.format(role)}.png"
            path.parent.mkdir(exist_ok=True)
            write_image(path, grey(value))

    with watched(tmp_path) as camera:
        later(write)
        shot = camera.snap()
    assert first_values(shot) == {"red": 1, "green": 2, "blue": 3, "ir": 4}
    assert shot.stamp is not None
    assert list(shot.stamp.frames) == ["visible", "infrared"]
    assert abs(shot.stamp.time_us - time.time_ns() // 1000) < 60e6


def test_a_colour_image_is_a_shot_without_infrared(tmp_path: Path) -> None:
    with watched(tmp_path, infrared_wait_s=0.1) as camera:
        later(lambda: write_image(tmp_path / "IMG_0001.tif", colour(10, 20, 30)))
        assert first_values(camera.snap()) == {"red": 10, "green": 20, "blue": 30}


def test_an_infrared_image_that_comes_later_belongs_to_the_colour_image(tmp_path: Path) -> None:
    with watched(tmp_path, infrared=True) as camera:
        later(lambda: write_image(tmp_path / "1_rgb.png", colour(10, 20, 30)))
        later(lambda: write_image(tmp_path / "1_ir.png", grey(40)), 0.6)
        assert first_values(camera.snap())["ir"] == 40


def test_mosaics_and_bits(tmp_path: Path) -> None:
    with watched(tmp_path, bayer="grbg", bits=12, infrared=False) as camera:
        later(lambda: write_image(tmp_path / "1.tif", grey(4095, np.uint16)))
        shot = camera.snap()
        assert isinstance(shot, BayerShot)
        assert (shot.bayer, shot.full_scale_value, first_values(shot)) == ("grbg", 4095.0, {"raw": 4095})
        later(lambda: write_image(tmp_path / "2.tif", grey(5000, np.uint16)))
        with (
            pytest.warns(CameraWarning, match=r"raw: values up to 5000, above 4095, the top of 12 bits"),
            pytest.raises(ShotTimeoutError),
        ):
            camera.snap(6.0)


def test_only_images_that_come_after_the_call_count(tmp_path: Path) -> None:
    write_image(tmp_path / "1.png", colour(1, 1, 1))
    with watched(tmp_path, infrared=False) as camera:
        write_image(tmp_path / "2.png", colour(2, 2, 2))
        with pytest.raises(ShotTimeoutError, match=r"no shot within 0\.3 s: no image came; let the camera software"):
            camera.snap(0.3)
        later(lambda: write_image(tmp_path / "1.png", colour(3, 3, 3)))
        assert first_values(camera.snap())["red"] == 3, "a file that is written again is a new image"


def test_images_that_are_there_can_be_taken_first_and_none_is_lost(tmp_path: Path) -> None:
    for number in range(1, 81):
        write_image(tmp_path / f"{number:03}.png", colour(number, 0, 0))
    with watched(tmp_path, start="all", infrared=False) as camera:
        assert not camera.paced
        assert first_values(camera.snap())["red"] == 1
        assert [first_values(shot)["red"] for shot in camera.stream(79)] == list(range(2, 81))
        assert camera.statistics().dropped == 0


def test_a_file_that_is_half_written_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadfringe.devices.files.UNREADABLE_S", 60.0)
    whole = cv2.imencode(".png", np.random.default_rng(1).integers(0, 255, (*SHAPE, 3), np.uint8))[1].tobytes()
    path = tmp_path / "1.png"

    def append() -> None:
        with path.open("ab") as file:
            file.write(whole[len(whole) // 2 :])

    with watched(tmp_path, infrared=False) as camera:
        later(lambda: path.write_bytes(whole[: len(whole) // 2]))
        later(append, 1.0)
        shot = camera.snap()
        np.testing.assert_array_equal(shot.images["red"], cv2.imread(str(path))[:, :, 2])
        assert camera.statistics().chips["files"].damaged == 0


def when_one_is_left_out(camera: FilesCamera, path: Path) -> None:
    while not camera.statistics().chips["files"].damaged:
        time.sleep(0.05)
    write_image(path, colour(9, 9, 9))


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        (
            "1.png",
            b"\x89PNG\r\n\x1a\n and no more",
            r"1\.png: not a readable .* bytes of the PNG file are missing",
        ),
        ("1.tif", b"text", r"1\.tif: not a readable image; expected PNG, TIFF or BMP, got 4 bytes of something else"),
        ("1.png", grey(5), r"1\.png: expected a colour image, got a grey one; name grey images 1_red\.png"),
        ("1_ir.png", colour(1, 2, 3), r"1_ir\.png came, but no image for red, green, blue within 1 s"),
        ("1_rgb.png", grey(7, np.uint16), "expected a colour image, got a grey one"),
        ("other.png", np.zeros((8, 8, 3), np.uint8), "8 x 8 uint8, but the shots before had 32 x 24 uint8; keep one"),
    ],
)
def test_a_wrong_file_is_left_out_and_later_ones_are_taken(
    tmp_path: Path, name: str, content: bytes | np.ndarray, reason: str
) -> None:
    def write() -> None:
        if isinstance(content, bytes):
            (tmp_path / name).write_bytes(content)
        else:
            write_image(tmp_path / name, content)

    with watched(tmp_path, infrared=False, incomplete_s=1.0) as camera:
        later(lambda: write_image(tmp_path / "0.png", colour(1, 1, 1)))
        camera.snap()
        later(write, 0.2)
        good = threading.Thread(target=when_one_is_left_out, args=(camera, tmp_path / "9.png"))
        good.start()
        with pytest.warns(CameraWarning, match=reason) as warned:
            assert first_values(camera.snap(60.0))["red"] == 9
        good.join()
        assert len(warned) == 1
        assert camera.statistics().chips["files"].damaged == 1


def test_planes_and_a_colour_image_of_one_shot_contradict(tmp_path: Path) -> None:
    write_image(tmp_path / "1_rgb.png", colour(1, 2, 3))
    write_image(tmp_path / "1_red.png", grey(1))
    with (
        watched(tmp_path, start="all") as camera,
        pytest.warns(CameraWarning, match=r"1_rgb\.png already holds the colours of red; keep one of them"),
        pytest.raises(ShotTimeoutError),
    ):
        camera.snap(0.5)


def test_jpeg_is_read_with_a_warning(tmp_path: Path) -> None:
    with watched(tmp_path, infrared=False) as camera:
        stored = cv2.imencode(".jpg", colour(90, 90, 90))[1].tobytes()
        later(lambda: (tmp_path / "1.jpg").write_bytes(stored))
        with pytest.warns(CameraWarning, match="JPEG changes the fringes"):
            assert first_values(camera.snap())["green"] == 90


def test_a_timeout_names_what_is_missing(tmp_path: Path) -> None:
    with watched(tmp_path) as camera:
        later(lambda: write_image(tmp_path / "5_red.png", grey(1)), 0.1)
        with pytest.raises(ShotTimeoutError, match=r"5_red\.png came, but no image for green, blue"):
            camera.snap(0.6)


def test_a_folder_that_vanishes_is_an_error_and_its_return_is_noticed(tmp_path: Path) -> None:
    folder = tmp_path / "captures"
    folder.mkdir()
    with watched(folder, infrared=False) as camera:
        folder.rmdir()
        with pytest.raises(OSError, match="captures: cannot be read: No such file"):
            camera.snap()
        folder.mkdir()
        later(lambda: write_image(folder / "1.png", colour(1, 1, 1)))
        camera.snap()


def test_errors_of_the_settings(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: no such folder; name the folder into which"):
        open_camera(f"files:{tmp_path / 'nowhere'}")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a file, not a folder"):
        open_camera(f"files:{tmp_path / 'file'}")
    with pytest.raises(ConfigError, match='expected "files:FOLDER" with the name of a folder'):
        open_camera("files:")
    with open_camera(f"files:{tmp_path}") as camera:
        stream = camera.stream(keep="all")
        later(camera.interrupt)
        assert list(stream) == []
    with pytest.raises(ValueError, match="the camera is closed"):
        camera.snap()


def test_a_system_file_names_the_folder_relative_to_itself(tmp_path: Path) -> None:
    (tmp_path / "captures").mkdir()
    (tmp_path / "system.toml").write_text('capture = "files:captures"\n')
    config = load_system(tmp_path)
    assert config.capture == FilesConfig(folder=tmp_path / "captures")
    with open_system(config) as scanner:
        assert "FilesCamera" in repr(scanner)


def test_a_stream_that_waits_is_closed_at_once(tmp_path: Path) -> None:
    with open_system(SystemConfig(capture=FilesConfig(folder=tmp_path))) as scanner:
        stream = scanner.stream()
        time.sleep(0.2)
        stream.close()
        assert not [thread for thread in threading.enumerate() if thread.name in ("capture", "decode")]


def test_measure_and_record_from_a_folder(tmp_path: Path) -> None:
    """The virtual bench stands for a person with camera software: its shots come as files."""
    captures, run = tmp_path / "captures", CliRunner().invoke
    captures.mkdir()
    with open_camera("virtual:") as bench:
        shot = bench.snap()
    out = tmp_path / "shape.npz"

    def write() -> None:
        for name, image in shot.images.items():
            write_image(captures / f"1_{name}.png", image)

    later(write, 1.0)
    done = run(app, ["measure", "--camera", f"files:{captures}", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert out.exists()
    with written_in_turn(captures, SHAPE, 10.0):
        take = ["record", "--camera", f"files:{captures}", "--out", str(tmp_path / "take.h5"), "--shots", "3"]
        done = run(app, [*take, "--json", "-"])
    assert json.loads(done.stdout)["figures"]["written"] == 3
    assert Recording(tmp_path / "take.h5")[0].images["red"].shape == SHAPE


def test_colour_images_are_measured_without_a_system_file(tmp_path: Path) -> None:
    with open_system(SystemConfig(fringes=Fringes(encoding="rgb"))) as bench:
        shot = bench.grab()
    image = np.dstack([shot.images[name] for name in ("blue", "green", "red")])
    later(lambda: cv2.imwrite(str(tmp_path / "take.png"), image), 1.0)
    out = tmp_path / "out" / "shape.npz"
    out.parent.mkdir()
    take = ["measure", "--camera", f"files:{tmp_path}", "--encoding", "rgb", "--fringes", "36 35 30", "--out", str(out)]
    done = CliRunner().invoke(app, take)
    assert done.exit_code == 0, done.output
    assert Shape.load(out).returned.any()


def test_a_recording_of_seconds_ends_although_no_image_comes(tmp_path: Path) -> None:
    (tmp_path / "captures").mkdir()
    take = ["record", "--camera", f"files:{tmp_path / 'captures'}", "--out", str(tmp_path / "take.h5")]
    done = CliRunner().invoke(app, [*take, "--seconds", "0.5"])
    assert done.exit_code == 0, done.output
    assert "0 shots" in done.stdout
