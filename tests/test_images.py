"""Image files: any bit depth, R, G, B order, clear errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from quadfringe.data.shot_files import read_shot
from quadfringe.errors import InputError
from quadfringe.io.images import read_grey, read_image, read_rgb, write_image

RNG = np.random.default_rng(3)


def image(dtype: str, *shape: int) -> np.ndarray:
    return RNG.integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)


@pytest.mark.parametrize(
    ("suffix", "dtype"),
    [("png", "uint8"), ("png", "uint16"), ("tif", "uint8"), ("tif", "uint16"), ("bmp", "uint8")],
)
def test_grey_and_colour_come_back(tmp_path: Path, suffix: str, dtype: str) -> None:
    for read, shape in ((read_grey, (5, 7)), (read_rgb, (5, 7, 3))):
        written = image(dtype, *shape)
        write_image(tmp_path / f"a.{suffix}", written)
        np.testing.assert_array_equal(read(tmp_path / f"a.{suffix}"), written)


def test_float_tiff_comes_back(tmp_path: Path) -> None:
    written = RNG.random((4, 5), np.float32)
    write_image(tmp_path / "a.tif", written)
    np.testing.assert_array_equal(read_image(tmp_path / "a.tif"), written)


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x89PNG\r\n\x1a\n" + b"\0" * 40])
def test_an_unreadable_image_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "bad.png").write_bytes(content)
    with pytest.raises(InputError, match=r"bad\.png: not a readable image"):
        read_image(tmp_path / "bad.png")


def test_a_missing_image_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no\.png: No such file"):
        read_image(tmp_path / "no.png")


def test_colour_where_grey_is_expected(tmp_path: Path) -> None:
    write_image(tmp_path / "c.png", image("uint8", 4, 4, 3))
    with pytest.raises(InputError, match="--rgb"):
        read_grey(tmp_path / "c.png")
    write_image(tmp_path / "g.png", image("uint8", 4, 4))
    with pytest.raises(InputError, match="expected a colour image"):
        read_rgb(tmp_path / "g.png")


def test_grey_stored_as_colour_passes(tmp_path: Path) -> None:
    grey = image("uint8", 4, 4)
    write_image(tmp_path / "g.png", np.repeat(grey[:, :, None], 3, axis=2))
    np.testing.assert_array_equal(read_grey(tmp_path / "g.png"), grey)


def test_an_unwritable_kind_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_image(tmp_path / "a.xyz", image("uint8", 4, 4))
    assert list(tmp_path.iterdir()) == []


def files(folder: Path, **images: np.ndarray) -> dict[str, Path | None]:
    for name, pixels in images.items():
        write_image(folder / f"{name}.png", pixels)
    return {name: folder / f"{name}.png" for name in images}


def test_a_colour_file_is_three_channels(tmp_path: Path) -> None:
    rgb, ir = image("uint8", 6, 8, 3), image("uint8", 6, 8)
    shot = read_shot(files(tmp_path, rgb=rgb, ir=ir))
    np.testing.assert_array_equal(shot.red, rgb[:, :, 0])
    np.testing.assert_array_equal(shot.blue, rgb[:, :, 2])
    assert shot.full_scale == 255


def test_bits_in_use_set_the_full_scale(tmp_path: Path) -> None:
    named = {name: image("uint16", 4, 4) >> 4 for name in ("red", "green", "blue", "ir")}
    assert read_shot(files(tmp_path, **named), bits=12).full_scale == 4095
    with pytest.raises(InputError, match="the top of 10 bits"):
        read_shot(files(tmp_path, **{k: v | 2048 for k, v in named.items()}), bits=10)


def test_mixed_depths_become_fractions(tmp_path: Path) -> None:
    white8, white16 = np.full((3, 3, 3), 255, np.uint8), np.full((3, 3), 4095, np.uint16)
    shot = read_shot(files(tmp_path, rgb=white8, ir=white16), bits=12)
    assert shot.full_scale == 1.0
    for channel in shot.channels.values():
        assert channel.dtype == np.float32
        np.testing.assert_array_equal(channel, 1.0)


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (("red", "ir"), "give green, blue"),
        (("rgb", "red", "ir"), "leave out red"),
    ],
)
def test_missing_channels_are_named(tmp_path: Path, names: tuple[str, ...], reason: str) -> None:
    shapes = {"rgb": (4, 4, 3)}
    images = {name: image("uint8", *shapes.get(name, (4, 4))) for name in names}
    with pytest.raises(InputError, match=reason):
        read_shot(files(tmp_path, **images))
