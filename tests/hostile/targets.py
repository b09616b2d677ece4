"""Readers as targets of `hostile.fuzz`: each takes the bytes of a file, and raises `InputError` or `RecordingError`."""

from __future__ import annotations

import io
import json
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

import quadfringe as qf
from hostile.files import KINDS, LIMITS, originals
from quadfringe.config import SystemConfig, load_system
from quadfringe.data import Calibration
from quadfringe.errors import InputError, RecordingError
from quadfringe.evaluation._takes import numbered_shot
from quadfringe.io.bounded import Helper
from quadfringe.recording import Recorder, Recording

__all__ = ["KEPT", "TARGETS", "corpus", "input_name", "refusal", "sound_inputs", "target"]

# "member" is one member of the archive of a shape, with the right checksum around it.
TARGETS = ("recording", "calibration", "response", "system", "shape", "member", "npy", "opencv", "png", "image")
KEPT = Path(__file__).with_name("corpus")  # inputs that failed once, or are made to mislead a reader
SUFFIXES = {"recording": ".h5", "system": ".toml", "shape": ".npz", "member": ".npz", "opencv": ".yml"}
SMALL_PX = 1 << 14  # cameras up to this size are simulated

Target = Callable[[bytes], None]


def read_recording(path: Path) -> None:
    with Recording(path) as take:
        for index in range(len(take)):
            take.read(index)


def simulate_system(path: Path) -> None:
    """Read a system file; if it names a small virtual bench, take a shot with it."""
    config = load_system(path)
    camera = config.camera
    if config.capture.kind == "virtual" and camera is not None and camera.width_px * camera.height_px <= SMALL_PX:
        with qf.open(config) as scanner:
            scanner.grab()


def decode_with(path: Path) -> None:
    """Read a calibration and decode a shot of noise with it."""
    calibration = Calibration.load(path)
    noise = np.random.default_rng(0).integers(60, 200, (4, 64, 96), np.uint8)
    shot, plan = qf.Shot(*noise), qf.Plan(912, calibration=calibration, decode={"method": "published"})
    qf.Decoder(shot, plan).decode_without_verdict(shot)


def archive_with(sound: bytes, data: bytes) -> bytes:
    """Return an archive in which one member, chosen by the first byte, has other content and its checksum."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(sound)) as old, zipfile.ZipFile(out, "w") as new:
        names = old.namelist()
        chosen = names[data[0] % len(names)] if data else names[0]
        for name in names:
            new.writestr(name, data[1:] if name == chosen else old.read(name))
    return out.getvalue()


def sound_inputs(kind: str, folder: Path) -> list[bytes]:
    """Return inputs that can be read, also without the digest that stops most changes at once."""
    if kind == "recording":
        with Recorder(folder / "take.h5", SystemConfig(), None) as recorder:
            for number in range(3):
                recorder.write(numbered_shot(number, (16, 24)))
        return [(folder / "take.h5").read_bytes()]
    files = [path.read_bytes() for path in originals(folder)["shape" if kind == "member" else kind]]
    if kind == "member":
        with zipfile.ZipFile(io.BytesIO(files[0])) as archive:
            return [bytes([i]) + archive.read(name) for i, name in enumerate(archive.namelist())]
    if kind in ("calibration", "response"):
        values = [json.loads(file) for file in files]
        files += [json.dumps({k: v for k, v in value.items() if k != "digest"}).encode() for value in values]
    return files


def corpus(kind: str) -> list[Path]:
    """Return the kept inputs of a kind."""
    return sorted((KEPT / kind).glob("*"))


@contextmanager
def target(kind: str, folder: Path) -> Iterator[Target]:
    """Give the function that libFuzzer calls; `folder` holds the file that is read."""
    path = folder / input_name(kind)
    sound = originals(folder)["shape"][0].read_bytes() if kind == "member" else b""
    with Helper(LIMITS) as helper:
        read = reader(kind, helper)

        def attack(data: bytes) -> None:
            path.write_bytes(archive_with(sound, data) if kind == "member" else data)
            with warnings.catch_warnings(action="ignore"), suppress(InputError, RecordingError):
                read(path)

        yield attack


def input_name(kind: str) -> str:
    """Return the name of a file of this kind."""
    return f"input{SUFFIXES.get(kind, '')}"


def refusal(kind: str, path: Path) -> str:
    """Read a file; return the words of the error, "" when there is none."""
    with warnings.catch_warnings(action="ignore"), Helper(LIMITS) as helper:
        try:
            reader(kind, helper)(path)
        except (InputError, RecordingError) as error:
            return str(error)
    return ""


def reader(kind: str, helper: Helper) -> Callable[[Path], Any]:
    if kind == "recording":
        return read_recording
    if kind == "system":
        return simulate_system
    if kind == "calibration":
        return decode_with
    read = KINDS["shape" if kind == "member" else kind].read
    return lambda path: read(path, helper)
