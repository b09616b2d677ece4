"""The file format of a recording, version 2: one HDF5 file with these attributes, datasets and types.

    /               attributes: format, schema_version, software, created_utc, device, full_scale, and bayer;
                    header_sha256, config_sha256 and calibration_sha256; origin, when the shots were copied from a file
                    of version 1, whose stamps, settings and calibration nobody verified
    /config         the resolved system, JSON; "null" when there is none
    /calibration    the calibration, JSON; "null" when there is none
    /red /green /blue /ir, or /raw /ir      (N, H, W), one uncompressed chunk per shot; no /ir without infrared
    /id             (N,) uint64, number of the exposure
    /time_us        (N,) int64, start of the exposure, us since 1970 UTC
    /chip_stamps    (N, chips, 3) int64: id, device_ns, arrival_ns of the frame of each chip; for camera shots
    /crc32          (N, images + 1) uint32: of each image, in the order above, and of the shot (see `_checksums`)
    /closed         1 once the file has been closed properly; then a seal follows behind the HDF5 file (see `_seal`)

Version 1 has no SHA-256, no CRC-32 of shots and no seal. All datasets are created before the single-writer
multiple-reader mode of HDF5 starts, which permits no new objects.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any, Self, get_args

import h5py
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import BayerPattern, SystemConfig, checked
from quadfringe.data import AnyShot, BayerShot, Calibration, Shot, Stamp
from quadfringe.errors import ConfigError, InputError
from quadfringe.io.declared import IMAGE_PX
from quadfringe.io.texts import json_of
from quadfringe.recording._checksums import sha256_of
from quadfringe.recording._stored import Stored

__all__ = ["Header", "StoredHeader", "frames_of", "make_datasets"]

FORMAT = "quadfringe recording"
SCHEMA_VERSION = 2
# A recording has the first of these whose images are all there.
IMAGES = (("red", "green", "blue", "ir"), ("raw", "ir"), ("red", "green", "blue"), ("raw",))
PIXELS = tuple(np.dtype(kind).str for kind in ("u1", "u2", "f4"))  # in the order of bytes of this machine
TEXTS: dict[str, type[SystemConfig] | type[Calibration]] = {"config": SystemConfig, "calibration": Calibration}
UNVERIFIED = "version 1"
SHOTS_PER_CHUNK = 512  # of the datasets of numbers; an image is a chunk of its shot


@dataclass(frozen=True)
class Header:
    """The properties that all shots of a recording share.

    `origin` is `UNVERIFIED` for shots from a recording of version 1, and "" for all others.
    """

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
    origin: str = field(default="", compare=False)

    @classmethod
    def of(cls, shot: AnyShot, config: SystemConfig | None, calibration: Calibration | None) -> Self:
        """Return the header of a recording for shots like this one; raises `InputError` for images that differ."""
        image = shot.first
        odd = [n for n, i in shot.images.items() if i.shape != image.shape or i.dtype != image.dtype or i.ndim != 2]
        if odd:
            raise InputError(
                f"recording: expected images (H, W) of one size and type; {', '.join(odd)} differ from "
                f"{next(iter(shot.images))} with {image.dtype} {image.shape}"
            )
        if image.dtype.str not in PIXELS:
            raise InputError(f"recording: expected images of uint8, uint16 or float32, got {image.dtype.str}")
        height_px, width_px = image.shape
        _require_size(height_px, width_px)
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
            return BayerShot(images["raw"], self.bayer, images.get("ir"), self.full_scale, stamp=stamp)
        red, green, blue = (images[name] for name in ("red", "green", "blue"))
        return Shot(red, green, blue, images.get("ir"), self.full_scale, stamp=stamp)

    def write(self, file: h5py.File) -> str:
        """Write the header to a new file; return its SHA-256."""
        known: dict[str, Any] = {
            "format": FORMAT,
            "schema_version": SCHEMA_VERSION,
            "software": f"quadfringe {_core.__version__}",
            "created_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "device": self.device,
            "full_scale": float(self.full_scale),
        }
        known |= {name: text for name, text in (("bayer", self.bayer), ("origin", self.origin)) if text}
        for name in TEXTS:
            model = getattr(self, name)
            text = "null" if model is None else model.model_dump_json(exclude_none=True)
            file[name] = text
            known[f"{name}_sha256"] = sha256_of(text)
        digest = sha256_of(known, self._geometry)
        file.attrs.update(known | {"header_sha256": digest})
        return digest

    @property
    def _geometry(self) -> list[Any]:
        return [self.images, self.height_px, self.width_px, np.dtype(self.dtype).str, self.chips]


@dataclass(frozen=True)
class StoredHeader:
    """The header of a file.

    `sha256` is that in the file, "" in version 1; `identity` stands for it there; `changed_texts` are left out.
    """

    header: Header
    sha256: str
    identity: str
    changed_texts: tuple[str, ...]

    @classmethod
    def of(cls, stored: Stored) -> Self:
        """Check what a file contains; raises `InputError` when it is no recording, was changed or has another version.

        The message does not name the file.
        """
        attributes = stored.attributes
        if attributes.get("format") != FORMAT:
            raise InputError("expected a recording of quadfringe, got another HDF5 file")
        if (version := attributes.get("schema_version")) not in (1, SCHEMA_VERSION):
            raise InputError(
                f"recording version {version!r}, expected {SCHEMA_VERSION} or 1; read it with the program that wrote it"
            )
        bare = _bare_header(stored)
        said = attributes.get("header_sha256", "")
        if version == SCHEMA_VERSION:
            rest = {name: value for name, value in attributes.items() if name != "header_sha256"}
            if said != sha256_of(rest, bare._geometry):
                raise InputError(
                    "the header does not match its checksum; copy the file again from where it was recorded"
                )
            changed = tuple(n for n in TEXTS if sha256_of(stored.texts[n]) != attributes.get(f"{n}_sha256"))
        elif said:
            raise InputError(
                "version 1 with the checksums of version 2; copy the file again from where it was recorded"
            )
        else:
            changed = ()
        models = {name: _model(stored.texts[name], name) for name in TEXTS if name not in changed}
        identity = said or sha256_of(attributes, bare._geometry, *stored.texts.values())
        return cls(replace(bare, **models), said, identity, changed)


def _bare_header(stored: Stored) -> Header:
    """Return the header without settings and calibration; raises `InputError` for datasets that do not fit."""
    images = next((names for names in IMAGES if all(name in stored.shapes for name in names)), None)
    present = {*stored.shapes, *stored.texts, *(() if stored.closed is None else ("closed",))}
    missing = [name for name in ("id", "time_us", "crc32", *TEXTS, "closed") if name not in present]
    if images is None or missing:
        raise InputError(
            f"the recording lacks {', '.join(missing) or 'images'}; copy it again from where it was recorded"
        )
    columns = len(images) + (stored.attributes["schema_version"] == SCHEMA_VERSION)
    size, dtype = stored.shapes[images[0]][1:], stored.dtypes[images[0]]
    expected: dict[str, tuple[str, tuple[int, ...]]] = dict.fromkeys(images, (dtype, size))
    expected |= {name: (np.dtype(kind).str, shape) for name, (kind, shape) in _numbers(columns, stored.chips).items()}
    odd = [n for n, found in expected.items() if (stored.dtypes.get(n), stored.shapes.get(n, ())[1:]) != found]
    if odd or len(size) != 2 or 0 in size or dtype not in PIXELS:
        raise InputError(f"{', '.join(odd) or dtype}: not the type or size of a recording; copy the file again")
    _require_size(*size)
    full_scale, bayer, device = (stored.attributes.get(name) for name in ("full_scale", "bayer", "device"))
    if not isinstance(full_scale, float) or not isinstance(device, str) or bayer not in (None, *get_args(BayerPattern)):
        raise InputError("full_scale, bayer or device: not the values of a recording; copy the file again")
    unverified = stored.attributes["schema_version"] == 1 or "origin" in stored.attributes
    origin = UNVERIFIED if unverified else ""
    return Header(images, *size, np.dtype(dtype), full_scale, bayer, device, stored.chips, origin=origin)


def _require_size(height_px: int, width_px: int) -> None:
    """Raise `InputError` for images of more pixels than those of files may have: some kB of holes can declare them."""
    if height_px * width_px > IMAGE_PX:
        raise InputError(f"recording: expected images of at most {IMAGE_PX:,} pixels, got {width_px} x {height_px}")


def _model(text: str, name: str) -> Any:
    try:
        values = json_of(text, name)
    except ConfigError as error:
        raise InputError(f"{error}; copy the file again") from error
    return None if values is None else checked(TEXTS[name], values, name)


def make_datasets(file: h5py.File, header: Header) -> None:
    """Create the empty datasets of a recording."""
    size = (header.height_px, header.width_px)
    for name in header.images:
        file.create_dataset(name, (0, *size), header.dtype, maxshape=(None, *size), chunks=(1, *size))
    for name, (dtype, shape) in _numbers(len(header.images) + 1, header.chips).items():
        file.create_dataset(name, (0, *shape), dtype, maxshape=(None, *shape), chunks=(SHOTS_PER_CHUNK, *shape))
    if header.chips:
        file["chip_stamps"].attrs["chips"] = list(header.chips)
    file.create_dataset("closed", data=np.uint8(0))


def _numbers(crcs: int, chips: Sequence[str]) -> dict[str, tuple[type, tuple[int, ...]]]:
    """Return type and shape of a row for each dataset of numbers."""
    numbers: dict[str, tuple[type, tuple[int, ...]]] = {"id": (np.uint64, ()), "time_us": (np.int64, ())}
    if chips:
        numbers["chip_stamps"] = (np.int64, (len(chips), 3))
    return numbers | {"crc32": (np.uint32, (crcs,))}


def frames_of(stamp: Stamp) -> list[tuple[int, int, int]]:
    """Return the row of `chip_stamps` for a stamp."""
    return [(frame.id, frame.device_ns, frame.arrival_ns) for frame in stamp.frames.values()]
