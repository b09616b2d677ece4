"""Files that declare more than they hold are refused before anything is decoded."""

from __future__ import annotations

import struct
import time
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from quadfringe.errors import InputError
from quadfringe.io.declared import check_image, pixels_declared
from quadfringe.io.images import read_image, write_image


def png(width: int, height: int) -> bytes:
    """A PNG of a few bytes that declares any size."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head))


def tiff(order: str, *pages: tuple[int, int]) -> bytes:
    """A TIFF without pixels; its second page is declared with shorts."""
    data = (b"II" if order == "<" else b"MM") + struct.pack(f"{order}HI", 42, 8)
    for index, (width, height) in enumerate(pages):
        kind, form = (3, "HHIHxx") if index else (4, "HHII")
        entries = b"".join(struct.pack(order + form, tag, kind, 1, size) for tag, size in ((256, width), (257, height)))
        after = len(data) + 2 + len(entries) + 4
        data += struct.pack(f"{order}H", 2) + entries + struct.pack(f"{order}I", after if index + 1 < len(pages) else 0)
    return data


@pytest.mark.parametrize("suffix", [".png", ".tif", ".bmp", ".jpg", ".pgm"])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(5, 7), (300, 2, 3)])
def test_the_declared_size_is_that_of_the_image(suffix: str, kind: type, shape: tuple[int, ...]) -> None:
    if suffix == ".pgm" and len(shape) == 3:
        suffix = ".ppm"
    if suffix in (".jpg", ".bmp"):
        kind = np.uint8
    done, data = cv2.imencode(suffix, np.zeros(shape, kind))
    assert done
    assert pixels_declared(data.tobytes()) == shape[0] * shape[1]
    check_image("image", data.tobytes())


@pytest.mark.parametrize(
    "bomb",
    [
        png(65536, 65536),
        png(2**31 - 1, 2**31 - 1),
        b"BM" + bytes(16) + struct.pack("<ii", 65536, -65536),
        tiff("<", (65536, 65536)),
        tiff(">", (16, 16), (65535, 65535)),
        b"\xff\xd8\xff\xe0\x00\x04ab\xff\xc2" + struct.pack(">HBHH", 17, 8, 65535, 65535),
        b"P5\n# 1 1\n99999 99999\n255\n",
    ],
    ids=lambda bomb: repr(bomb[:8]),
)
def test_images_that_declare_too_much_are_refused(bomb: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(bomb)
    with pytest.raises(InputError, match=r"a\.png: declares [\d,]+ pixels; expected at most 268,435,456$"):
        read_image(path)


@pytest.mark.parametrize("kind", [9, 16, 17])
def test_sizes_of_a_tiff_count_in_every_type_that_the_decoder_takes(kind: int) -> None:
    data = struct.pack("<2sHI", b"II", 42, 8)
    wide = struct.pack({9: "<i", 16: "<Q", 17: "<q"}[kind], 40_000)
    places = [struct.pack("<I", 8 + 2 + 24 + 4 + 8 * i) if len(wide) > 4 else wide for i in range(2)]
    entries = b"".join(
        struct.pack("<HHI4s", tag, kind, 1, place) for tag, place in zip((256, 257), places, strict=True)
    )
    data += struct.pack("<H", 2) + entries + bytes(4) + 2 * wide
    assert pixels_declared(data) == 40_000**2


def test_a_big_tiff_and_its_tiles_are_judged(tmp_path: Path) -> None:
    import tifffile

    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.zeros((9, 7), np.uint16), bigtiff=True)
    assert pixels_declared(path.read_bytes()) == 63
    tifffile.imwrite(path, np.zeros((16, 16), np.uint8), tile=(8192, 8192), compression="zlib")
    assert pixels_declared(path.read_bytes()) == 8192**2


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_much_larger_pixels_than_the_file_are_refused(suffix: str, tmp_path: Path) -> None:
    """Some 100 kB would take several seconds; grey images of the largest cameras are read at any compression."""
    rows = np.zeros((6500, 7000, 3), np.uint16)
    path = tmp_path / f"a{suffix}"
    write_image(path, rows)
    with pytest.raises(InputError, match=rf"a{suffix}: declares pixels of 273 MB in a file of .* most 268 MB, so save"):
        read_image(path)
    write_image(path, rows[:, :, 0])
    assert read_image(path).shape == (6500, 7000)


@pytest.mark.parametrize("suffix", [".webp", ".jp2", ".hdr", ".gif"])
def test_images_of_other_kinds_are_refused(suffix: str, tmp_path: Path) -> None:
    """Nothing says how large they are before they are decoded."""
    done, data = cv2.imencode(suffix, np.zeros((90, 70, 3), np.uint8))
    assert done
    (tmp_path / "a.png").write_bytes(data.tobytes())
    with pytest.raises(InputError, match=r"a\.png: not a readable image; expected PNG, TIFF or BMP, got \d+ bytes"):
        read_image(tmp_path / "a.png")


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


@pytest.mark.parametrize("head", [b"zTXtk\0\0", b"iTXtk\0\1\0\0\0", b"iCCPk\0\0"])
def test_compressed_texts_of_a_png_are_not_unpacked(head: bytes, tmp_path: Path) -> None:
    """7 MB of them took half a minute."""
    image = np.arange(48, dtype=np.uint8).reshape(6, 8)
    data = cv2.imencode(".png", image)[1].tobytes()
    text = chunk(head[:4], head[4:] + zlib.compress(bytes(7_900_000), 9))
    (tmp_path / "a.png").write_bytes(data[:33] + 300 * text + data[33:])
    begin_s = time.process_time()
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), image)
    assert time.process_time() - begin_s < 1.0
    (tmp_path / "a.png").write_bytes(data[:33] + 1_000_001 * chunk(b"abCd", b"") + data[33:])
    with pytest.raises(InputError, match=r"a\.png: expected a PNG of at most 1,000,000 chunks, got more"):
        read_image(tmp_path / "a.png")


@pytest.mark.parametrize("length", [1, 2**31 - 1, 2**32 - 1])
def test_a_chunk_of_a_png_that_is_longer_than_the_file_is_refused(length: int, tmp_path: Path) -> None:
    """OpenCV reserves memory for the whole chunk, up to 4 GB, before it reads."""
    (tmp_path / "i.png").write_bytes(png(48, 32) + struct.pack(">I", length) + b"IDAT")
    with pytest.raises(
        InputError, match=rf"i.png: not a readable image: {length + 4:,} bytes of the PNG file are missing"
    ):
        read_image(tmp_path / "i.png")


def test_bytes_after_the_end_of_a_png_do_no_harm(tmp_path: Path) -> None:
    image = np.arange(48, dtype=np.uint8).reshape(6, 8)
    (tmp_path / "i.png").write_bytes(cv2.imencode(".png", image)[1].tobytes() + b"\xff" * 9)
    np.testing.assert_array_equal(read_image(str(tmp_path / "i.png")), image)


def test_every_start_of_an_image_is_judged_without_a_crash() -> None:
    images = [png(4, 4), tiff("<", (4, 4), (5, 5)), tiff(">", (4, 4))]
    images += [cv2.imencode(suffix, np.eye(9, dtype=np.uint8))[1].tobytes() for suffix in (".jpg", ".tif", ".bmp")]
    random = np.random.default_rng(1)
    for data in images:
        for end in range(min(len(data), 200)):
            pixels_declared(data[:end])
        for _ in range(300):
            damaged = bytearray(data)
            damaged[random.integers(len(data))] = random.integers(256)
            pixels_declared(bytes(damaged))
    for nothing in (b"", b"text", b"II*\0", b"\xff\xd8" + b"\xff\xfe\x00\x00" * 100):
        assert pixels_declared(nothing) is None
