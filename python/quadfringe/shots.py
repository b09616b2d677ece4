"""Shots to image files and back: four grey files, or one colour file and one infrared."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data import Shot
from quadfringe.errors import InputError
from quadfringe.images import full_scale, read_grey, read_rgb, write_image

__all__ = ["read_shot", "write_shot"]

COLOURS = ("red", "green", "blue")


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
    return _shot({n: (image / full_scales[n]).astype(np.float32) for n, image in images.items()}, 1.0)


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


def write_shot(folder: Path, shot: Shot) -> dict[str, Path]:
    """Write the four channels of a shot as red.png, green.png, blue.png, ir.png; returns the paths."""
    paths = {name: folder / f"{name}.png" for name in shot.channels}
    for name, image in shot.channels.items():
        write_image(paths[name], image)
    return paths
