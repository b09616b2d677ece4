"""Shots to image files and back: grey files, or one of all colours, plain or raw mosaic, and infrared if any."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args, overload

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import BayerPattern
from quadfringe.data.shot import AnyShot, BayerShot, Shot
from quadfringe.errors import InputError
from quadfringe.files import folder_for
from quadfringe.io.images import full_scale, read_grey, read_rgb, write_image

__all__ = ["SUFFIXES", "read_shot", "write_shot"]

COLOURS = ("red", "green", "blue")
NAMES = ("rgb", *COLOURS, "raw", "ir")
SUFFIXES = (".png", ".tif", ".tiff", ".bmp")
IN_FOLDER = (
    "red.png, green.png, blue.png and ir.png, or rgb.png and ir.png, or raw.png and ir.png (no ir without infrared)"
)
Source = Mapping[str, Path | str | None] | Path | str


@overload
def read_shot(source: Source, bits: int | None = None, *, bayer: None = None) -> Shot: ...
@overload
def read_shot(source: Source, bits: int | None = None, *, bayer: BayerPattern) -> BayerShot: ...
@overload
def read_shot(source: Source, bits: int | None = None, *, bayer: BayerPattern | None) -> AnyShot: ...
def read_shot(source: Source, bits: int | None = None, *, bayer: BayerPattern | None = None) -> AnyShot:
    """Read a shot from image files: a folder, or a mapping of names to paths.

    The names are `ir`, and `rgb` or all of `red`, `green`, `blue`; with `bayer` (rggb, grbg, gbrg or bggr) they are
    `raw`, the mosaic of a Bayer chip, and `ir`. Without `ir` the shot has no infrared image. In a folder they are
    followed by .png, .tif, .tiff or .bmp. `bits` is the number of bits in use in 16-bit files, 10 or 12 for example;
    other files have none to choose. Files of different depth become float32 fractions of full scale. Raises
    `InputError` that names the file or argument at fault.

    >>> import tempfile
    >>> import numpy as np
    >>> import quadfringe as qf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     paths = qf.data.write_shot(folder, qf.Shot(*np.zeros((4, 6, 8), np.uint8)))
    ...     qf.read_shot(folder), qf.read_shot(paths)
    (Shot(8 x 6 uint8 up to 255), Shot(8 x 6 uint8 up to 255))
    """
    given = _files_of(source, bayer)
    try:
        _check_names(given, bayer, folder=not isinstance(source, Mapping))
    except InputError as error:
        raise error if isinstance(source, Mapping) else InputError(f"{source}: {error}") from None
    images = _read(given)
    _check_bits(bits, images, next(iter(given.values())))
    full_scales = {name: _full_scale(image, bits, given.get(name)) for name, image in images.items()}
    if len({image.dtype for image in images.values()}) > 1:
        images = {name: (image / full_scales[name]).astype(np.float32) for name, image in images.items()}
        full_scales = dict.fromkeys(images, 1.0)
    full, infrared = next(iter(full_scales.values())), images.get("ir")
    if bayer is not None:
        return BayerShot(images["raw"], bayer, infrared, full)
    return Shot(images["red"], images["green"], images["blue"], infrared, full)


def _files_of(source: Any, bayer: BayerPattern | None) -> dict[str, Path]:
    if isinstance(source, Mapping):
        if unknown := [name for name in source if name not in NAMES]:
            raise InputError(f"expected images named {', '.join(NAMES)}, got {', '.join(map(str, unknown))}")
        return {name: Path(path) for name in NAMES if (path := source.get(name)) is not None}
    if not isinstance(source, (str, Path)):
        raise InputError(f"expected a folder or a mapping of names to image files, got {type(source).__name__}")
    folder = Path(source)
    if not folder.is_dir():
        reason = "a file, not a folder" if folder.exists() else "no such folder"
        raise InputError(f"{folder}: {reason}; expected a folder with {IN_FOLDER}")
    found = {name: path for name in NAMES if (path := _image_of(folder, name)) is not None}
    if not found:
        raise InputError(f"{folder}: no image of a shot in it; expected {IN_FOLDER}")
    # A folder may hold the mosaic and the planes that a camera made of it; `bayer` says which of them is meant.
    others = (*COLOURS, "rgb") if bayer is not None else ("raw",) * bool(found.keys() - {"raw", "ir"})
    return {name: path for name, path in found.items() if name not in others}


def _image_of(folder: Path, name: str) -> Path | None:
    found = [folder / f"{name}{suffix}" for suffix in SUFFIXES if (folder / f"{name}{suffix}").is_file()]
    if len(found) > 1:
        raise InputError(f"{folder}: {' and '.join(path.name for path in found)}; keep one of them")
    return found[0] if found else None


def _check_names(given: Mapping[str, Path], bayer: BayerPattern | None, *, folder: bool) -> None:
    """Raise unless the images make a shot, and no colour is given twice."""
    colours = [name for name in (*COLOURS, "rgb") if name in given]
    if bayer is not None and bayer not in get_args(BayerPattern):
        raise InputError(f"bayer: expected one of {', '.join(get_args(BayerPattern))}, got {bayer!r}")
    if "raw" in given and bayer is None:
        raise InputError("raw is the mosaic of a Bayer chip: say its pattern too, bayer = rggb, grbg, gbrg or bggr")
    if bayer is not None and "raw" not in given:
        raise InputError("bayer needs the image raw, the mosaic of the Bayer chip, in place of the colours")
    if "raw" in given and colours:
        raise InputError(f"raw already holds red, green and blue; leave out {', '.join(colours)}")
    if "rgb" in given and len(colours) > 1:
        raise InputError(f"rgb already holds red, green and blue; leave out {', '.join(colours[:-1])}")
    if not {"raw", "rgb"} & given.keys() and len(colours) < 3:
        missing = ", ".join(name for name in COLOURS if name not in given)
        raise InputError(f"no image for {missing}: {_advice(missing, folder)}, or one colour image rgb")


def _advice(missing: str, folder: bool) -> str:
    """Say what to do about images that are missing: add files to a folder, or give them by name."""
    return f"add {missing.replace(',', '.png,')}.png" if folder else f"give {missing}"


def _read(given: Mapping[str, Path]) -> dict[str, NDArray[Any]]:
    images = {name: read_grey(path) for name, path in given.items() if name != "rgb"}
    if "rgb" in given:
        colour = read_rgb(given["rgb"])
        images |= {name: colour[:, :, i] for i, name in enumerate(COLOURS)}
    return images


def _check_bits(bits: int | None, images: Mapping[str, NDArray[Any]], path: Path) -> None:
    if bits is None:
        return
    if not isinstance(bits, (int, np.integer)) or not 1 <= bits <= 16:
        raise InputError(f"bits: expected the number of bits in use, from 1 to 16, such as 12, got {bits!r}")
    if all(image.dtype != np.uint16 for image in images.values()):
        raise InputError(
            f"{path}: expected uint16 pixels for bits = {bits}, got {next(iter(images.values())).dtype}; leave bits out"
        )


def _full_scale(image: NDArray[Any], bits: int | None, path: Path | None) -> float:
    if bits is None or image.dtype != np.uint16:
        return float(full_scale(image))
    full = 2**bits - 1
    if int(image.max()) > full:
        raise InputError(f"{path or 'rgb'}: has values up to {image.max()}, above {full}, the top of {bits} bits")
    return float(full)


def write_shot(folder: Path | str, shot: AnyShot) -> dict[str, Path]:
    """Write red.png, green.png, blue.png, ir.png of a shot, or raw.png and ir.png of a mosaic; gives the paths.

    A shot without infrared has no ir.png.
    A missing folder is made. Raises `InputError` when a file cannot be written.
    """
    paths = {name: folder_for(Path(folder)) / f"{name}.png" for name in shot.images}
    for name, image in shot.images.items():
        write_image(paths[name], image)
    return paths
