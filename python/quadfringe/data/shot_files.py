"""Shots to image files and back: four grey files, or an infrared one and one of all colours, plain or raw mosaic."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import BayerPattern
from quadfringe.data import AnyShot, BayerShot, Shot
from quadfringe.errors import InputError
from quadfringe.io.images import full_scale, read_grey, read_rgb, write_image

__all__ = ["read_bayer_shot", "read_folder", "read_shot", "write_shot"]

COLOURS = ("red", "green", "blue")
SUFFIXES = (".png", ".tif", ".tiff", ".bmp")


def read_shot(files: Mapping[str, Path | None], bits: int | None = None) -> Shot:
    """Read a shot from `files`: `ir`, and either `rgb` or all of `red`, `green`, `blue`.

    `bits` is the number of bits in use in 16-bit files (10 or 12 of 16, say). Files of different depth
    become float32 fractions of full scale. Raises `InputError` that names the file at fault.
    """
    given = {name: path for name, path in files.items() if path is not None}
    _check_names(given)
    images = _read(given)
    full_scales = {name: _full_scale(image, bits, given.get(name)) for name, image in images.items()}
    if len({image.dtype for image in images.values()}) == 1:
        return _shot(images, full_scales["ir"])
    return _shot(_fractions(images, full_scales), 1.0)


def read_bayer_shot(raw: Path, bayer: BayerPattern, ir: Path, bits: int | None = None) -> BayerShot:
    """Read a raw mosaic of the pattern `bayer` (rggb, grbg, gbrg or bggr) and an infrared image.

    `bits` and files of different depth are as for `read_shot`. Raises `InputError` that names the file at fault.
    """
    images = {"raw": read_grey(raw), "ir": read_grey(ir)}
    full_scales = {name: _full_scale(images[name], bits, path) for name, path in (("raw", raw), ("ir", ir))}
    if images["raw"].dtype != images["ir"].dtype:
        images, full_scales = _fractions(images, full_scales), {"ir": 1.0}
    return BayerShot(images["raw"], bayer, images["ir"], full_scales["ir"])


def read_folder(folder: Path, bayer: BayerPattern | None = None, bits: int | None = None) -> AnyShot:
    """Read a shot from a folder: red, green, blue or rgb, and ir; raw and ir when `bayer` is given.

    The images are .png, .tif, .tiff or .bmp. Raises `InputError` that names what is missing.
    """
    files = {name: _image_of(folder, name) for name in ("rgb", *COLOURS, "raw", "ir")}
    if bayer is not None:
        raw, ir = (files[name] for name in ("raw", "ir"))
        if raw is None or ir is None:
            raise InputError(f"{folder}: expected raw.png and ir.png")
        return read_bayer_shot(raw, bayer, ir, bits)
    del files["raw"]
    missing = [name for name in (*COLOURS, "ir") if files[name] is None]
    if files["ir"] is None or (files["rgb"] is None and missing):
        raise InputError(f"{folder}: no {', '.join(f'{name}.png' for name in missing)}")
    return read_shot(files, bits)


def _image_of(folder: Path, name: str) -> Path | None:
    found = [folder / f"{name}{suffix}" for suffix in SUFFIXES if (folder / f"{name}{suffix}").is_file()]
    if len(found) > 1:
        raise InputError(f"{folder}: {' and '.join(path.name for path in found)}; leave one of them")
    return found[0] if found else None


def _fractions(images: Mapping[str, NDArray[Any]], full_scales: Mapping[str, float]) -> dict[str, NDArray[np.float32]]:
    return {name: (image / full_scales[name]).astype(np.float32) for name, image in images.items()}


def _shot(images: Mapping[str, NDArray[Any]], full_scale: float) -> Shot:
    return Shot(images["red"], images["green"], images["blue"], images["ir"], full_scale)


def _check_names(given: Mapping[str, Path]) -> None:
    colours = [name for name in COLOURS if name in given]
    if "ir" not in given:
        raise InputError("the infrared image is missing: give --ir FILE")
    if "rgb" in given and colours:
        raise InputError(f"--rgb already holds red, green and blue; leave out --{' --'.join(colours)}")
    if "rgb" not in given and len(colours) < 3:
        missing = [name for name in COLOURS if name not in given]
        raise InputError(f"no image for {', '.join(missing)}: give --{' --'.join(missing)}, or one --rgb FILE")


def _read(given: Mapping[str, Path]) -> dict[str, NDArray[Any]]:
    ir = read_grey(given["ir"])
    if "rgb" in given:
        colour = read_rgb(given["rgb"])
        return {**{name: colour[:, :, i] for i, name in enumerate(COLOURS)}, "ir": ir}
    return {**{name: read_grey(given[name]) for name in COLOURS}, "ir": ir}


def _full_scale(image: NDArray[Any], bits: int | None, path: Path | None) -> float:
    if bits is None or image.dtype != np.uint16:
        return float(full_scale(image))
    full = 2**bits - 1
    if int(image.max()) > full:
        raise InputError(f"{path or '--rgb'}: has values up to {image.max()}, above {full}, the top of {bits} bits")
    return float(full)


def write_shot(folder: Path, shot: AnyShot) -> dict[str, Path]:
    """Write red.png, green.png, blue.png, ir.png of a shot, or raw.png and ir.png of a mosaic; returns the paths."""
    paths = {name: folder / f"{name}.png" for name in shot.images}
    for name, image in shot.images.items():
        write_image(paths[name], image)
    return paths
