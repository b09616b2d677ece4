"""Read damaged files: every one gives what was saved, or one clear error, in time."""

from __future__ import annotations

import os
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import quadfringe as qf
from hostile.mutations import damaged
from quadfringe.calibration.opencv_files import read_opencv_by, write_opencv
from quadfringe.config import ChannelResponse, Device, load_system
from quadfringe.data import Calibration, CalibrationRecord, CalibrationStep, ResponseCalibration
from quadfringe.errors import InputError
from quadfringe.io import read_image, read_npy
from quadfringe.io.bounded import BoundedError, Helper, Limits

__all__ = ["KINDS", "LIMITS", "Outcome", "attack", "importable", "originals"]

TIME_S = 5.0
LIMITS = Limits(time_s=TIME_S, memory_bytes=4 << 30)
SMALL = Device(width_px=96, height_px=64, focal_px=(240.0, 240.0), centre_px=(47.5, 31.5))
SYSTEM = """schema_version = 1
capture = { kind = "virtual" }
[camera]
width_px = 96
height_px = 64
focal_px = [240.0, 240.0]
centre_px = [47.5, 31.5]
[fringes]
numbers = [36.0, 35.0, 30.0]
[scene]
surface = "steps"
noise = 0.01
[decode]
method = "published"
depth_range_mm = [600.0, 1000.0]
"""


@dataclass(frozen=True)
class Kind:
    """How files of a kind are read; `exact` when a change of what they hold must be noticed."""

    read: Callable[[Path, Any], Any]
    exact: bool


@dataclass(frozen=True)
class Outcome:
    """What happened to a damaged file: "same", "refused", or with `exact` unset "other"; all else is a fault."""

    kind: str
    name: str
    seed: int
    found: str
    words: str = ""

    @property
    def fault(self) -> bool:
        return self.found not in ("same", "refused", "other")


def _bytes_of(array: Any) -> Any:
    return str(array.dtype), array.shape, array.tobytes()


def _shape_of(path: Path, _: object) -> Any:
    shape = qf.Shape.load(path)
    return (
        {name: (str(m.dtype), m.shape, m.tobytes()) for name, m in shape.maps.items()},
        shape.config,
        shape.calibration,
    )


def _image_of(path: Path, _: object) -> Any:
    return _bytes_of(read_image(path))


# TOML, OpenCV files, NPY, TIFF and BMP have no checksum: a change that leaves a valid file shows nowhere. Calibrations
# and responses have a digest, NPZ and PNG checksums.
KINDS: dict[str, Kind] = {
    "calibration": Kind(lambda path, _: Calibration.load(path), exact=True),
    "response": Kind(lambda path, _: ResponseCalibration.load(path), exact=True),
    "system": Kind(lambda path, _: load_system(path), exact=False),
    "shape": Kind(_shape_of, exact=True),
    "npy": Kind(lambda path, _: _bytes_of(read_npy(path)), exact=False),
    "opencv": Kind(lambda path, helper: read_opencv_by(helper, path), exact=False),
    "png": Kind(_image_of, exact=True),
    "image": Kind(_image_of, exact=False),
}


def originals(folder: Path) -> dict[str, list[Path]]:
    """Write sound files of every kind."""
    with qf.open(qf.SystemConfig(camera=SMALL, scene=qf.SceneConfig(surface="steps", noise=0.01))) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    pose = {"T_camera_board": np.eye(4).tolist(), "seen": ["1", "2"]}
    step = CalibrationStep(
        name="poses", good=True, verdict="µ good", settings={"pose_1": pose}, figures={"rms_px": 0.1}
    )
    record = CalibrationRecord(made_utc="2026-01-01T00:00:00+00:00", quadfringe_version="0", rig="r", steps=(step,))
    known = calibration.model_copy(update={"record": record})
    made: dict[str, list[Path]] = {name: [] for name in KINDS}

    def new(kind: str, name: str) -> Path:
        made[kind].append(folder / name)
        return made[kind][-1]

    known.save(new("calibration", "c.json"))
    ResponseCalibration(red=ChannelResponse(exponent=0.5), inputs=("a.png",)).save(new("response", "r.json"))
    new("system", "s.toml").write_text(SYSTEM)
    decoder = qf.Decoder(shot, qf.Plan(912, calibration=calibration, decode={"method": "published"}))
    decoder.decode_without_verdict(shot).save(new("shape", "s.npz"))
    np.save(new("npy", "height.npy"), np.zeros((8, 9)))
    for suffix in ("yml", "xml", "json"):
        write_opencv(new("opencv", f"cv.{suffix}"), known)
    grey = shot.red[:32, :48]
    for suffix, kind in (("png", "png"), ("tif", "image"), ("bmp", "image")):
        qf.io.write_image(new(kind, f"grey.{suffix}"), grey)
        qf.io.write_image(new(kind, f"colour.{suffix}"), np.dstack([grey, grey[::-1], grey]))
    for suffix, kind in (("png", "png"), ("tif", "image")):
        qf.io.write_image(new(kind, f"deep.{suffix}"), grey.astype(np.uint16) * 257)
    return made


@contextmanager
def importable() -> Iterator[None]:
    """Let helper processes import this package."""
    before = os.environ.get("PYTHONPATH", "")
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(Path(__file__).parents[1]), before)))
    try:
        yield
    finally:
        os.environ["PYTHONPATH"] = before


def attack(kind: str, files: list[Path], seeds: range, keep: Path | None = None) -> Iterator[Outcome]:
    """Read files of a kind, damaged by one seed after another; `keep` is a folder that keeps them."""
    with tempfile.TemporaryDirectory() as folder, importable(), Helper(LIMITS) as helper:
        sound = {file: KINDS[kind].read(file, helper) for file in files}
        for seed in seeds:
            random = np.random.default_rng(seed)
            file = files[int(random.integers(len(files)))]
            path = (keep or Path(folder)) / f"{kind}-{seed}{file.suffix}"
            path.write_bytes(damaged(file.read_bytes(), random))
            yield _outcome(kind, Outcome(kind, file.name, seed, "same"), path, sound[file], helper)


def _outcome(kind: str, unknown: Outcome, path: Path, sound: Any, helper: Helper) -> Outcome:
    """Read a damaged file. OpenCV's parser is in a helper already; else a crash of the reader is a fault."""
    try:
        found = _tried(kind, path, helper) if kind == "opencv" else helper.run(_tried, kind, path)
    except BoundedError as error:
        return replace(unknown, found="hang or crash", words=str(error))
    if isinstance(found, _Refusal):
        return replace(unknown, found=found.found, words=found.words)
    if found == sound:
        return unknown
    return replace(unknown, found="changed" if KINDS[kind].exact else "other")


@dataclass(frozen=True)
class _Refusal:
    found: str
    words: str


def _tried(kind: str, path: Path, helper: Helper | None = None) -> Any:
    """Read a file, mostly in the helper process; errors come as words, because not all of them can be pickled."""
    try:
        return KINDS[kind].read(path, helper)
    except InputError as error:
        return _Refusal("refused", str(error))
    except BoundedError:
        raise
    except Exception:  # noqa: BLE001 - to find any is what the attack is for
        return _Refusal("traceback", traceback.format_exc())
