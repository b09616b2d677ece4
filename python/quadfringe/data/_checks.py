"""Checks of new records: images and maps have one size, and types that the kernel takes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.data.reason import Reason
from quadfringe.errors import InputError

__all__ = ["check_full_scale", "check_images", "check_maps", "check_stamp", "check_types"]

DTYPES = ("uint8", "uint16", "float32")
USUAL = tuple(np.dtype(name) for name in DTYPES)


def check_images(images: Mapping[str, Any]) -> None:
    """Raise `InputError` unless all images are arrays (H, W) of one size and one type that can be decoded."""
    for name, image in images.items():
        wanted = f"{name}: expected one grey image (H, W) of {', '.join(DTYPES[:2])} or {DTYPES[2]}"
        if not isinstance(image, np.ndarray):
            raise InputError(f"{wanted}, got {'None' if image is None else type(image).__name__}")
        if image.ndim != 2:
            colour = "; give each plane of a colour image as a channel" if image.ndim == 3 else ""
            raise InputError(f"{wanted}, got an array of shape {image.shape}{colour}")
        if not image.size:
            raise InputError(f"{wanted}, got one without pixels, of shape {image.shape}")
        # Every decode cuts shots into bands, and the name of a type takes most of the time of a check.
        if image.dtype not in USUAL and image.dtype.name not in DTYPES:
            raise InputError(f"{wanted}, got {image.dtype.name}; convert it, fractions of full scale to float32")
    if len({(image.shape, image.dtype) for image in images.values()}) > 1:
        _check_equal("size", {name: f"{image.shape[1]} x {image.shape[0]}" for name, image in images.items()})
        _check_equal("type", {name: image.dtype.name for name, image in images.items()})


def check_full_scale(full_scale: float | None) -> None:
    """Raise `InputError` unless the full scale is None or a positive number."""
    if full_scale is not None and not (np.isfinite(full_scale) and full_scale > 0):
        raise InputError(f"full_scale: expected a positive number, such as 4095 for 12 bit, got {full_scale}")


def check_maps(maps: Mapping[str, Any]) -> None:
    """Raise `InputError` unless all maps are of one size: (H, W), points (H, W, 3), albedo (H, W, 4)."""
    for name, values in maps.items():
        last = (3,) if name.startswith("xyz") else (4,) if name == "albedo" else ()
        shape = values.shape if isinstance(values, np.ndarray) else None
        if shape is None or shape[2:] != last or len(shape) < 2 or 0 in shape:
            got = type(values).__name__ if shape is None else f"an array of shape {shape}"
            raise InputError(f"{name}: expected an array ({', '.join(['H', 'W', *map(str, last)])}), got {got}")
    _check_equal("size", {name: f"{values.shape[1]} x {values.shape[0]}" for name, values in maps.items()})


def check_types(maps: Mapping[str, NDArray[Any]], path: Path) -> None:
    """Raise `InputError` unless the maps of a file are floating, and the reasons uint8 with a meaning."""
    reason = maps.get("reason")
    other = [
        f"{name} of {values.dtype}" for name, values in maps.items() if name != "reason" and values.dtype.kind != "f"
    ]
    if other:
        raise InputError(f"{path}: expected maps of float32, got {', '.join(other)}")
    if reason is None:
        return
    if reason.dtype != np.uint8:
        raise InputError(f"{path}, reason: expected uint8, got {reason.dtype}")
    if reason.max(initial=0) >= len(Reason):
        raise InputError(f"{path}, reason: expected 0 to {len(Reason) - 1}, got {int(reason.max())}")


def check_stamp(number: Any, time_us: Any, device: Any) -> None:
    """Raise `InputError` unless number and time are integers and the device is a name."""
    for name, value in (("id", number), ("time_us", time_us)):
        if not isinstance(value, (int, np.integer)):
            raise InputError(f"{name}: expected an integer, got {value!r}")
    if not isinstance(device, str):
        raise InputError(f"device: expected the name of a camera, got {device!r}")


def _check_equal(what: str, found: Mapping[str, str]) -> None:
    if len(set(found.values())) > 1:
        listed = ", ".join(f"{name} {value}" for name, value in found.items())
        raise InputError(f"expected one {what} for all of {', '.join(found)}, got {listed}")
