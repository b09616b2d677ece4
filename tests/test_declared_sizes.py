"""Files that declare more than they hold are refused before anything is decoded."""

from __future__ import annotations

import struct
import zipfile
import zlib
from io import BytesIO

import cv2
import numpy as np
import pytest

from quadfringe.errors import InputError
from quadfringe.io.declared import ARRAYS, ARRAYS_BYTES, check_arrays, check_image, pixels_declared


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
def test_images_that_declare_too_much_are_refused(bomb: bytes) -> None:
    with pytest.raises(InputError, match=r"^a\.png: declares [\d,]+ pixels; expected at most 268,435,456$"):
        check_image("a.png", bomb)


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
        with pytest.raises(InputError, match="expected PNG, TIFF or BMP"):
            check_image("x", nothing)


def archive(*sizes: int) -> bytes:
    """A ZIP archive of zeros, small as long as it is not unpacked."""
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as packed:
        for index, size in enumerate(sizes):
            packed.writestr(f"{index}.npy", bytes(size))
    return stream.getvalue()


def test_archives_that_declare_too_much_are_refused() -> None:
    stream = BytesIO()
    np.savez_compressed(stream, phase_rad=np.zeros((64, 64), np.float32))
    check_arrays("a.npz", stream.getvalue())
    check_arrays("a.npz", b"no archive")
    packed = archive(1000)
    place = packed.rindex(b"PK\x01\x02")
    bomb = packed[: place + 24] + struct.pack("<I", 2**32 - 2) + packed[place + 28 :]
    check_arrays("a.npz", bomb)
    directory, end = bomb[place : bomb.rindex(b"PK\x05\x06")], 5
    several = bomb[:place] + directory * end
    several += struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, end, end, len(directory) * end, place, 0)
    with pytest.raises(InputError, match=f"declares 5 arrays with [0-9,]+ bytes; .*{ARRAYS_BYTES:,}"):
        check_arrays("a.npz", several)
    with pytest.raises(InputError, match=f"declares {ARRAYS + 1} arrays"):
        check_arrays("a.npz", archive(*[1] * (ARRAYS + 1)))
