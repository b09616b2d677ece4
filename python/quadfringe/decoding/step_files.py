"""The files of a reference measurement: which image is which step of which fringe number."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from quadfringe.data.shot_files import SUFFIXES
from quadfringe.errors import InputError
from quadfringe.io.images import read_grey

__all__ = ["Order", "read_steps"]

Order = Literal["frequency", "step"]


def read_steps(
    source: Sequence[Path | str] | Path | str, count: int, steps: int, order: Order = "frequency"
) -> list[NDArray[Any]]:
    """Read the images of `count` fringe numbers with `steps` steps each: one stack (steps, H, W) for each number.

    `source` is a folder, whose images are taken sorted by name, or the files in their order. With `order` "frequency"
    all steps of a fringe number follow each other; with "step" the fringe numbers alternate. Raises `InputError` for
    another number of images, and for images that differ in size or type.
    """
    if isinstance(source, (Path, str)):
        source = [source]
    files = _files([Path(path) for path in source], count * steps, f"{steps} steps of {count} fringe numbers")
    images = np.stack(_read_alike(files))
    if order == "step":
        return [np.ascontiguousarray(images[k::count]) for k in range(count)]
    return [images[k * steps : (k + 1) * steps] for k in range(count)]


def _files(paths: list[Path], wanted: int, words: str) -> list[Path]:
    """Give the files, those of a folder by name; raise `InputError` unless they are as many as wanted."""
    folder = paths[0] if len(paths) == 1 and paths[0].is_dir() else None
    if folder is None:
        files, where = paths, "given"
    else:
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
        where = f"in {folder}"
    if len(files) == wanted:
        return files
    advice = "give the missing ones too"
    if len(files) > wanted:
        advice = f"name only the images of the steps (after the first {wanted} comes {files[wanted].name})"
    raise InputError(f"{words}: expected {wanted} images, {len(files)} are {where}; {advice}")


def _read_alike(files: list[Path]) -> list[NDArray[Any]]:
    """Read grey images; raise `InputError` unless all have one size and type."""
    images: list[NDArray[Any]] = []
    for path in files:
        image = read_grey(path)
        if images and (image.shape, image.dtype) != (images[0].shape, images[0].dtype):
            kinds = [f"{one.shape[1]} x {one.shape[0]} {one.dtype}" for one in (image, images[0])]
            raise InputError(f"{path}: {kinds[0]}, but {files[0]} is {kinds[1]}; all must have one size and type")
        images.append(image)
    return images
