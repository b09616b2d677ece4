"""The file format of a recording: one HDF5 file with these attributes, datasets and types.

    /               attributes: format, schema_version, software, created_utc, device, full_scale, and bayer
    /config         the resolved system, JSON; "null" when there is none
    /calibration    the calibration, JSON; "null" when there is none
    /red /green /blue /ir, or /raw /ir      (N, H, W), one uncompressed chunk per shot
    /id             (N,) uint64, number of the exposure
    /time_us        (N,) int64, start of the exposure, us since 1970 UTC
    /chip_stamps    (N, chips, 3) int64: id, device_ns, arrival_ns of the frame of each chip; for camera shots
    /crc32          (N, images) uint32, of the bytes of each image, in the order above
    /closed         1 once the file has been closed properly

All datasets are created before the single-writer multiple-reader mode of HDF5 starts, which permits no new objects.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import BayerPattern, SystemConfig, checked
from quadfringe.data import AnyShot, BayerShot, Calibration, FrameStamp, Shot, Stamp
from quadfringe.errors import InputError

__all__ = ["Header", "crcs_of", "make_datasets", "stamp_at", "stamp_values"]

FORMAT = "quadfringe recording"
SCHEMA_VERSION = 1
IMAGES = (("red", "green", "blue", "ir"), ("raw", "ir"))
SHOTS_PER_CHUNK = 512  # of the datasets of numbers; an image is a chunk of its shot


@dataclass(frozen=True)
class Header:
    """The properties that all shots of a recording share."""

    images: tuple[str, ...]
    height_px: int
    width_px: int
    dtype: np.dtype[Any]
    full_scale: float
    bayer: BayerPattern | None = None
    device: str = ""
    chips: tuple[str, ...] = ()
    config: SystemConfig | None = None
    calibration: Calibration | None = None

    @classmethod
    def of(cls, shot: AnyShot, config: SystemConfig | None, calibration: Calibration | None) -> Self:
        """Return the header of a recording for shots like this one; raises `InputError` for images that differ."""
        image = shot.ir
        odd = [n for n, i in shot.images.items() if i.shape != image.shape or i.dtype != image.dtype or i.ndim != 2]
        if odd:
            raise InputError(
                f"recording: expected images (H, W) of one size and type; {', '.join(odd)} differ from ir with "
                f"{image.dtype} {image.shape}"
            )
        height_px, width_px = image.shape
        return cls(
            tuple(shot.images),
            height_px,
            width_px,
            image.dtype,
            shot.full_scale_value,
            bayer=shot.bayer if isinstance(shot, BayerShot) else None,
            device=shot.stamp.device if shot.stamp else "",
            chips=tuple(shot.stamp.frames) if shot.stamp else (),
            config=config,
            calibration=calibration,
        )

    @property
    def shot_bytes(self) -> int:
        """Number of bytes of the images of one shot."""
        return len(self.images) * self.height_px * self.width_px * self.dtype.itemsize

    def require_alike(self, shot: AnyShot) -> None:
        """Raise `InputError` unless `shot` has the images, size, type and full scale of this recording."""
        other = Header.of(shot, self.config, self.calibration)
        if other != self:
            raise InputError(
                f"recording: expected {self.described}, got a shot with {other.described}; start another file for it"
            )

    @property
    def described(self) -> str:
        """The images with size, type and full scale, in words."""
        kind = ", ".join(self.images) + (f" ({self.bayer})" if self.bayer else "")
        device = f" from {self.device}" if self.device else ""
        return f"{kind} of {self.width_px} x {self.height_px} {self.dtype}, full scale {self.full_scale:g}{device}"

    def shot(self, images: Mapping[str, NDArray[Any]], stamp: Stamp) -> AnyShot:
        """Make a shot from its images and its stamp."""
        if self.bayer is not None:
            return BayerShot(images["raw"], self.bayer, images["ir"], self.full_scale, stamp=stamp)
        red, green, blue, ir = (images[name] for name in ("red", "green", "blue", "ir"))
        return Shot(red, green, blue, ir, self.full_scale, stamp=stamp)

    def write(self, file: h5py.File) -> None:
        """Write the header to a new file."""
        file.attrs["format"] = FORMAT
        file.attrs["schema_version"] = SCHEMA_VERSION
        file.attrs["software"] = f"quadfringe {_core.__version__}"
        file.attrs["created_utc"] = datetime.now(UTC).isoformat(timespec="seconds")
        file.attrs["device"] = self.device
        file.attrs["full_scale"] = self.full_scale
        if self.bayer is not None:
            file.attrs["bayer"] = self.bayer
        for name in ("config", "calibration"):
            model = getattr(self, name)
            file[name] = "null" if model is None else model.model_dump_json(exclude_none=True)

    @classmethod
    def read(cls, file: h5py.File, source: str) -> Self:
        """Read the header; raises `InputError` when the file is no recording or has another version."""
        if file.attrs.get("format") != FORMAT:
            raise InputError(f"{source}: expected a recording of quadfringe, got another HDF5 file")
        if (version := file.attrs.get("schema_version")) != SCHEMA_VERSION:
            raise InputError(
                f"{source}: recording version {version}, expected {SCHEMA_VERSION}; read it with the program that "
                "wrote it"
            )
        images = next((names for names in IMAGES if all(name in file for name in names)), None)
        missing = [name for name in ("id", "time_us", "crc32", "config", "calibration", "closed") if name not in file]
        if images is None or missing:
            raise InputError(
                f"{source}: the recording lacks {', '.join(missing) or 'images'}; copy it again from where it was "
                "recorded"
            )
        first = file[images[0]]
        chips = tuple(file["chip_stamps"].attrs["chips"]) if "chip_stamps" in file else ()
        full_scale, bayer, device = (file.attrs.get(name) for name in ("full_scale", "bayer", "device"))
        _, height_px, width_px = first.shape
        header = cls(images, height_px, width_px, first.dtype, float(full_scale), bayer, device, chips)
        config, calibration = (json.loads(file[name].asstr()[()]) for name in ("config", "calibration"))
        return replace(
            header,
            config=None if config is None else checked(SystemConfig, config, f"{source}, config"),
            calibration=None if calibration is None else checked(Calibration, calibration, f"{source}, calibration"),
        )


def make_datasets(file: h5py.File, header: Header) -> None:
    """Create the empty datasets of a recording."""
    size = (header.height_px, header.width_px)
    for name in header.images:
        file.create_dataset(name, (0, *size), header.dtype, maxshape=(None, *size), chunks=(1, *size))
    numbers: dict[str, tuple[type, tuple[int, ...]]] = {
        "id": (np.uint64, ()),
        "time_us": (np.int64, ()),
        "crc32": (np.uint32, (len(header.images),)),
    }
    if header.chips:
        numbers["chip_stamps"] = (np.int64, (len(header.chips), 3))
    for name, (dtype, shape) in numbers.items():
        file.create_dataset(name, (0, *shape), dtype, maxshape=(None, *shape), chunks=(SHOTS_PER_CHUNK, *shape))
    if header.chips:
        file["chip_stamps"].attrs["chips"] = list(header.chips)
    file.create_dataset("closed", data=np.uint8(0))


def stamp_values(stamp: Stamp) -> dict[str, Any]:
    """Return the value of a stamp for each dataset of numbers."""
    values: dict[str, Any] = {"id": stamp.id, "time_us": stamp.time_us}
    if stamp.frames:
        values["chip_stamps"] = [(frame.id, frame.device_ns, frame.arrival_ns) for frame in stamp.frames.values()]
    return values


def stamp_at(file: h5py.File, header: Header, index: int) -> Stamp:
    """Read the stamp of a shot."""
    rows = file["chip_stamps"][index].tolist() if header.chips else []
    frames = {chip: FrameStamp(*row) for chip, row in zip(header.chips, rows, strict=True)}
    return Stamp(int(file["id"][index]), int(file["time_us"][index]), header.device, frames)


def crcs_of(images: Mapping[str, NDArray[Any]]) -> list[int]:
    """Return the CRC-32 of the bytes of each image, in C order."""
    return [_core.crc32(np.ascontiguousarray(image).view(np.uint8)) for image in images.values()]
