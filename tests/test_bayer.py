"""Raw mosaics of a Bayer chip: records, files, decoding, and error messages."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bars import hold, tolerance
from typer.testing import CliRunner, Result

import quadfringe as qf
from quadfringe import _core
from quadfringe.cli import app
from quadfringe.config import Device
from quadfringe.decoding import stages
from quadfringe.errors import DecodeError, InputError
from quadfringe.io.images import write_image

PATTERNS = ("rggb", "grbg", "gbrg", "bggr")
METHODS = ("joint", "published")
CODE = ((36.0, 35.0, 30.0), 912)
CAMERA = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
FRINGES = ["--fringes", "36", "35", "30", "--projector-width", "912"]
Image = np.ndarray[Any, Any]


def bench(**scene: Any) -> qf.SystemConfig:
    return qf.SystemConfig(camera=CAMERA, scene=qf.SceneConfig.model_validate({"surface": "peaks", **scene}))


def grab(**scene: Any) -> qf.BayerShot:
    with qf.open(bench(**scene)) as scanner:
        shot = scanner.grab()
    assert isinstance(shot, qf.BayerShot)
    return shot


def mosaic(planes: list[Image], pattern: str) -> Image:
    """Give the raw image of a Bayer chip from red, green and blue planes."""
    raw = planes[1].copy()
    row, column = divmod(pattern.index("r"), 2)
    raw[row::2, column::2] = planes[0][row::2, column::2]
    raw[1 - row :: 2, 1 - column :: 2] = planes[2][1 - row :: 2, 1 - column :: 2]
    return raw


def plan(method: str) -> qf.Plan:
    return qf.Plan(912, decode=qf.DecodeConfig.model_validate({"method": method}))


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def ideal() -> list[Image]:
    """Red, green, blue, infrared of a camera that sees the projector one to one, (96, 912) float32."""
    return [0.1 + 0.8 * _core.pattern(channel, *CODE, 96) for channel in ("R", "G", "B", "IR")]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_every_pattern_gives_the_shape(pattern: str, method: str) -> None:
    shot = grab(bayer=pattern, bit_depth=12)
    assert shot.raw.dtype == np.uint16
    assert shot.truth is not None
    shape = qf.decode(shot, plan(method))
    error = shape.phase_rad - shot.truth.column_px * (2 * np.pi * 36 / 912)
    hold("bayer.returned", shape.returned.mean())
    hold("bayer.phase_rms_rad", np.sqrt(np.nanmean(error**2)))


def test_the_scanner_takes_a_mosaic_to_millimetres() -> None:
    with qf.open(bench(bayer="gbrg", noise=0.01, seed=2)) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    assert shot.truth is not None
    hold("bayer.depth_median_mm", np.nanmedian(np.abs(shape.depth_mm - shot.truth.depth_mm)))
    assert shape.config["scene"]["bayer"] == "gbrg"


def test_demosaicing_by_the_camera_gives_planes() -> None:
    with qf.open(bench(bayer="gbrg", demosaic="bilinear")) as scanner:
        shot = scanner.grab()
    assert isinstance(shot, qf.Shot)
    raw = grab(bayer="gbrg")
    for y, x, name in ((1, 0, "red"), (0, 0, "green"), (1, 1, "green"), (0, 1, "blue")):
        np.testing.assert_array_equal(shot.channels[name][y::2, x::2], raw.raw[y::2, x::2])
    np.testing.assert_array_equal(shot.ir, raw.ir)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_light_comes_back_where_another_colour_was_seen(ideal: list[Image], pattern: str) -> None:
    shot = qf.BayerShot(mosaic(ideal, pattern), pattern, ideal[3])  # type: ignore[arg-type]
    for image, light in zip(ideal, stages.linear_light(shot).values(), strict=True):
        np.testing.assert_allclose(light[8:-8, 8:-8], image[8:-8, 8:-8], atol=2e-4)
        np.testing.assert_allclose(light, image, atol=tolerance("bayer.light"))


def test_channels_are_samples_of_their_own_colour() -> None:
    grey = [np.full((6, 8), level, np.uint8) for level in (10, 20, 30)]
    for pattern in PATTERNS:
        shot = qf.BayerShot(mosaic(grey, pattern), pattern, grey[0])  # type: ignore[arg-type]
        assert {name: set(image.ravel()) for name, image in shot.channels.items()} == {
            "red": {10}, "green": {20}, "blue": {30}, "ir": {10},
        }  # fmt: skip
        assert list(shot.images) == ["raw", "ir"]


@pytest.mark.parametrize("method", METHODS)
def test_a_wrong_pattern_is_named(method: str) -> None:
    shot = grab(bayer="rggb", noise=0.01)
    for other in PATTERNS[1:]:
        with pytest.raises(DecodeError, match=f"the Bayer pattern seems to be rggb, not {other}"):
            qf.decode(replace(shot, bayer=other), plan(method))  # type: ignore[arg-type]


def test_a_blind_colour_is_named() -> None:
    shot = grab(bayer="grbg")
    raw = shot.raw.copy()
    raw[0::2, 1::2] = 0
    with pytest.raises(DecodeError, match="channel red is black"):
        qf.decode(replace(shot, raw=raw), plan("joint"))


@pytest.mark.parametrize("name", ["rgbg", "RGGB", ""])
def test_an_unknown_pattern_lists_the_four(ideal: list[Image], name: str) -> None:
    image = ideal[0]
    with pytest.raises(InputError, match=r"rggb, grbg, gbrg, bggr, got "):
        qf.BayerShot(image, name, image)  # type: ignore[arg-type]
    listed = f"Bayer pattern: expected rggb, grbg, gbrg or bggr, got {name!r}".replace("'", '"')
    with pytest.raises(ValueError, match=listed):
        _core.linear_light_bayer(image, name, image)
    with pytest.raises(ValueError, match=listed):
        _core.Decoder((96, 912), *CODE).decode_bayer(image, name, image)
    small = _core.Bench(camera=_core.Device(32, 24, (80.0, 80.0), (15.5, 11.5)))
    with pytest.raises(ValueError, match=listed):
        small.render(small.cast("plane"), CODE[0], bayer=name)


def test_what_does_not_fit_is_named(ideal: list[Image]) -> None:
    image = ideal[0]
    with pytest.raises(InputError, match=r"raw: expected one grey image .* shape \(96, 912, 3\)"):
        qf.BayerShot(np.stack(ideal[:3], axis=2), "rggb", image)
    with pytest.raises(InputError, match="expected one size"):
        qf.BayerShot(image, "rggb", image[1:])
    decoder = _core.Decoder((96, 912), *CODE)
    with pytest.raises(TypeError, match="ir: expected a 2D float32 array, got a 2D float64 array"):
        decoder.decode_bayer(image, "rggb", image.astype(float))
    with pytest.raises(TypeError, match="raw: expected a 2D uint8, uint16 or float32 array"):
        decoder.decode_bayer(image.astype(float), "rggb", image)
    with pytest.raises(ValueError, match="demosaic: expected a Bayer pattern"):
        grab(demosaic="bilinear")


def test_files_of_two_depths_become_fractions(tmp_path: Path) -> None:
    raw = np.arange(48, dtype=np.uint16).reshape(6, 8) * 85
    infrared = np.full((6, 8), 51, np.uint8)
    write_image(tmp_path / "raw.tif", raw)
    write_image(tmp_path / "ir.png", infrared)
    shot = qf.read_shot(tmp_path, 12, bayer="bggr")
    assert (shot.bayer, shot.full_scale) == ("bggr", 1.0)
    np.testing.assert_allclose(shot.raw, raw / 4095, atol=1e-6)
    np.testing.assert_allclose(shot.ir, 0.2, atol=1e-6)
    with pytest.raises(InputError, match=re.escape("raw.tif: has values up to 3995")):
        qf.read_shot(tmp_path, 10, bayer="bggr")


def test_the_command_line_simulates_and_decodes_mosaics(tmp_path: Path) -> None:
    system = tmp_path / "system.toml"
    system.write_text(
        "[camera]\nwidth_px = 512\nheight_px = 384\nfocal_px = [1290.0, 1290.0]\ncentre_px = [255.5, 191.5]\n"
    )
    made = run("simulate", system, "--surface", "sphere", "--bayer", "grbg", "--out", tmp_path / "shot")
    assert made.exit_code == 0, made.output
    names = {path.name for path in (tmp_path / "shot").iterdir()}
    assert names == {"raw.png", "ir.png", "calibration.json", "truth.npz"}
    raw, ir = tmp_path / "shot" / "raw.png", tmp_path / "shot" / "ir.png"
    images = ["--raw", raw, "--bayer", "grbg", "--ir", ir]
    calibration = ["--calibration", tmp_path / "shot" / "calibration.json"]
    done = run("decode", *images, *FRINGES, *calibration, "--out", tmp_path / "x.npz")
    assert done.exit_code == 0, done.output
    shape = qf.Shape.load(tmp_path / "x.npz")
    same = qf.decode(qf.read_shot({"raw": raw, "ir": ir}, bayer="grbg"), plan("joint"))
    np.testing.assert_array_equal(shape.phase_rad, same.phase_rad)
    assert shape.xyz_mm is not None
    wrong = run("decode", "--raw", raw, "--bayer", "bggr", "--ir", ir, *FRINGES, "--out", tmp_path / "y.npz")
    assert wrong.exit_code == 1
    assert "the Bayer pattern seems to be grbg" in wrong.stderr
    assert not (tmp_path / "y.npz").exists()


@pytest.mark.parametrize(
    ("arguments", "reasons"),
    [
        (["--raw", "r.png", "--ir", "i.png"], ["raw is the mosaic", "bayer = rggb"]),
        (["--bayer", "rggb", "--ir", "i.png"], ["bayer needs the image raw"]),
        (["--raw", "r.png", "--bayer", "rggb"], ["r.png: No such file"]),
        (["--raw", "r.png", "--bayer", "rggb", "--ir", "i.png", "--red", "r.png"], ["leave out red"]),
        (["--raw", "r.png", "--bayer", "rgbg", "--ir", "i.png"], [*PATTERNS, "rgbg"]),
        (["--raw", "r.png", "--bayer", "rggb", "--ir", "i.png"], ["r.png: No such file"]),
    ],
)
def test_wrong_usage_says_what_to_do(tmp_path: Path, arguments: list[str], reasons: list[str]) -> None:
    result = run("decode", *arguments, *FRINGES, "--out", tmp_path / "x.npz")
    assert result.exit_code == 2
    for reason in reasons:
        assert reason in result.stderr
