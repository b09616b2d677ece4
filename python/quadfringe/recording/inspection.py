"""Describe the content of a file as lines of text."""

from __future__ import annotations

from pathlib import Path
from textwrap import shorten, wrap
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from quadfringe.config import SystemConfig, brief, load_system
from quadfringe.data import Calibration, ResponseCalibration
from quadfringe.data.calibration import DIGEST
from quadfringe.data.reason import Reason
from quadfringe.errors import InputError
from quadfringe.files import TEXT_BYTES, read_bytes
from quadfringe.io.arrays import read_npy, read_npz
from quadfringe.io.images import read_image
from quadfringe.io.texts import json_of
from quadfringe.recording import Recording

__all__ = ["lines_about"]

DIGEST_FOUND = {
    True: "unchanged since it was saved",
    False: "without a digest, so a change since it was saved cannot be told",
}
SCREEN_COLUMNS, SCREEN_LINES = 80, 24
SETTINGS = 12  # changed settings of a recording that are listed
IMAGES = (".png", ".tif", ".tiff", ".bmp")


def lines_about(path: Path, *, full: bool = False) -> list[str]:
    """Describe a shape, calibration, response, system file, recording, array or image; else raises `InputError`.

    A recording is described on one screen, 80 columns and 24 lines at most; `full` gives all its settings.
    """
    suffix = path.suffix.lower()
    if suffix == ".npz":
        return _arrays(read_npz(path))
    if suffix == ".npy":
        return _arrays({"array": read_npy(path)})
    if suffix == ".json":
        return _json(path)
    if suffix == ".toml":
        return load_system(path).model_dump_json(indent=2, exclude_none=True).splitlines()
    if suffix in IMAGES:
        return _arrays({"image": read_image(path)})
    if suffix == ".ply":
        return _ply_header(path)
    if suffix == ".h5":
        return _recording(path, full=full)
    raise InputError(f"{path}: expected .npz, .npy, .json, .toml, .ply, .h5 or {', '.join(IMAGES)}")


def _arrays(stored: dict[str, NDArray[Any]]) -> list[str]:
    return [line for name, array in stored.items() for line in (_array(name, array), *_reasons(name, array))]


def _reasons(name: str, array: NDArray[Any]) -> list[str]:
    """Give the share of each reason that occurs, in words, for the map of reasons of a shape."""
    if name != "reason" or array.dtype != np.uint8 or not array.size:
        return []
    shares = {one: 100 * float((array == one).mean()) for one in Reason}
    return [
        f"reason {one.name}, {one.words}: {share:.2g} %"
        for one, share in shares.items()
        if share and one != Reason.RETURNED
    ]


def _array(name: str, array: NDArray[Any]) -> str:
    if array.dtype.kind == "U":
        return f"{name}: {array}"
    size = f"{name}: {array.dtype.name} {array.shape}"
    if array.dtype.kind not in "fui" or not array.size:
        return size
    finite = np.isfinite(array)
    if not finite.any():
        return f"{size}, all NaN"
    values = array[finite]
    return f"{size}, {values.min():.6g} to {values.max():.6g}, {100 * finite.mean():.1f} % valid"


def _json(path: Path) -> list[str]:
    values = json_of(read_bytes(path, TEXT_BYTES), str(path))
    keys = set(values) if isinstance(values, dict) else set()
    if "figures" in keys and isinstance(values["figures"], dict):
        return ["Figures of a command", *(f"{name}: {value}" for name, value in values["figures"].items())]
    known_by = Calibration if {"camera", "projector"} & keys else ResponseCalibration
    if keys and not keys & set(known_by.model_fields):
        raise InputError(
            f"{path}: expected a calibration, a camera response or figures, got JSON with the keys {', '.join(values)}"
        )
    loaded = known_by.load(path)
    return [
        f"{type(loaded).__name__}, {DIGEST_FOUND[DIGEST in keys]}",
        *loaded.model_dump_json(indent=2, exclude_none=True).splitlines(),
    ]


def _recording(path: Path, *, full: bool) -> list[str]:
    with Recording(path, rescue=True) as recording:
        lines = [f"Recording: {len(recording)} shots of {recording.header.described}", f"SHA-256: {recording.sha256}"]
        ids, times_us = recording.ids[recording.stamped], recording.times_us[recording.stamped]
        if len(ids):
            lost = int(ids[-1]) - int(ids[0]) + 1 - len(ids)
            begin = np.datetime_as_string(times_us[0].astype("datetime64[us]"), unit="ms", timezone="UTC")
            spent_s = (int(times_us[-1]) - int(times_us[0])) / 1e6
            lines.append(f"begin: {begin}, {spent_s:.3f} s, {lost} exposures missing")
        if not recording.closed_in_order:
            lines.append("not closed: still being written, or its writer was killed (then use quadfringe recover)")
        calibration, config = recording.calibration, recording.config
        if full:
            return [*lines, *_whole("calibration", calibration), *_whole("config", config)]
    summed = [_fitting(line) for line in (*lines, *_devices(calibration), *_changed(config))]
    screen = [line for lines in summed for line in lines][: SCREEN_LINES - 2]  # a line for the prompt
    return [*screen, "all settings and the whole calibration: quadfringe info --full"]


def _whole(name: str, model: BaseModel | None) -> list[str]:
    known = None if model is None else model.model_dump_json(indent=2, exclude_none=True)
    return [f"{name}:", *("none" if known is None else known).splitlines()]


def _fitting(line: str) -> list[str]:
    return wrap(line, SCREEN_COLUMNS, subsequent_indent="  ") or [line]


def _devices(calibration: Calibration | None) -> list[str]:
    """Sum up a calibration: its devices, what it corrects, and its record."""
    if calibration is None:
        return ["calibration: none"]
    devices = {"camera": calibration.camera, "projector": calibration.projector, "infrared": calibration.infrared}
    sizes = [f"{name} {one.width_px} x {one.height_px}" for name, one in devices.items() if one is not None]
    kept = ("dark", "response", "projector_response", "crosstalk", "ir_registration")
    corrected = [name.replace("_", " ") for name in kept if getattr(calibration, name, None) is not None]
    record = calibration.record
    made = "" if record is None else f"; {record.rig}, {record.made_utc}"
    return [f"calibration: {', '.join(sizes)}{made}", *([f"it corrects: {', '.join(corrected)}"] if corrected else [])]


def _changed(config: SystemConfig | None) -> list[str]:
    """List the settings that differ from the defaults, as in a system file."""
    if config is None:
        return ["config: none"]
    values = config.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    found = [f"{key} = {brief(value)}" for key, value in _flat(values)]
    more = [f"... and {len(found) - SETTINGS} more"] if len(found) > SETTINGS else []
    shown = [shorten(one, SCREEN_COLUMNS - 2, placeholder=" ...") for one in (*found[:SETTINGS], *more)]
    return [f"config, changed from the defaults: {'' if found else 'nothing'}".rstrip(), *(f"  {one}" for one in shown)]


def _flat(values: dict[str, Any], head: str = "") -> list[tuple[str, Any]]:
    """Give nested settings with dotted keys."""
    found: list[tuple[str, Any]] = []
    for key, value in values.items():
        name = f"{head}{key}"
        found += _flat(value, f"{name}.") if isinstance(value, dict) else [(name, value)]
    return found


def _ply_header(path: Path) -> list[str]:
    header, end, _ = read_bytes(path).partition(b"end_header\n")
    if not header.startswith(b"ply") or not end:
        raise InputError(f"{path}: expected a PLY file, got another format")
    return header.decode("ascii", "replace").splitlines()
