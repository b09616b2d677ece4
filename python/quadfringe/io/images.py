"""Read and write image files: PNG, TIFF and BMP, 8 and 16 bit, colour in R, G, B order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.errors import InputError
from quadfringe.files import atomic, read_bytes
from quadfringe.io.declared import check_image, without_texts
from quadfringe.io.tiff import has_more_pages

__all__ = ["full_scale", "read_grey", "read_image", "read_rgb", "write_image"]

DTYPES = ("uint8", "uint16", "float32")


def read_image(path: Path | str) -> NDArray[Any]:
    """Read an image as (H, W) or (H, W, 3), uint8, uint16 or float32; raises `InputError` naming the file.

    A TIFF of several pages is an error, because nothing says which of them is meant.
    """
    import cv2

    stored = read_bytes(Path(path))
    check_image(path, stored)
    if has_more_pages(stored):
        raise InputError(f"{path}: holds several pages; expected one image, so save the page that is meant alone")
    data = np.frombuffer(without_texts(stored), np.uint8)
    try:
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    except cv2.error:
        image = None
    if image is None:
        raise InputError(
            f"{path}: not a readable image; expected PNG, TIFF or BMP, got {data.size} bytes of something else"
        )
    if image.dtype.name not in DTYPES:
        raise InputError(f"{path}: expected {', '.join(DTYPES)} pixels, got {image.dtype.name}")
    if image.ndim == 3 and image.shape[2] == 4:
        image = image[:, :, :3]  # an alpha channel carries no light
    colour: NDArray[Any] = image if image.ndim == 2 else np.ascontiguousarray(image[:, :, ::-1])
    return colour


def full_scale(image: NDArray[Any]) -> np.float32:
    """Return the intensity of a saturated pixel by dtype: 255, 65535, or 1 for float32."""
    return np.float32(np.iinfo(image.dtype).max if image.dtype.kind == "u" else 1.0)


def read_grey(path: Path) -> NDArray[Any]:
    """Read one channel, (H, W); raises `InputError` for a colour image whose planes differ."""
    image = read_image(path)
    if image.ndim == 2:
        return image
    if (image == image[:, :, :1]).all():
        return image[:, :, 0]
    raise InputError(f"{path}: expected one grey channel, got a colour image; give it as --rgb")


def read_rgb(path: Path) -> NDArray[Any]:
    """Read a colour image, (H, W, 3) in R, G, B order; raises `InputError` for a grey image."""
    image = read_image(path)
    if image.ndim != 3:
        raise InputError(
            f"{path}: expected a colour image, got one grey channel; give it as --red, --green, --blue or --ir"
        )
    return image


def write_image(path: Path, image: NDArray[Any]) -> None:
    """Write an image (H, W) or (H, W, 3) in R, G, B order; the file is complete or does not exist."""
    import cv2

    stored = image if image.ndim == 2 else image[:, :, ::-1]
    # Encoded in memory: OpenCV crashes on a path that is not valid UTF-8, and Linux allows any bytes in one.
    suffix = path.suffix if path.suffix.isascii() else ""
    try:
        done, data = cv2.imencode(suffix, np.ascontiguousarray(stored))
    except cv2.error:
        done = False
    if not done:
        raise InputError(f"{path}: cannot be written as an image; use .png, .tif or .bmp")
    with atomic(path) as temporary:
        temporary.write_bytes(data.tobytes())
