"""The results of a batch on disk: tied to one recording and one set of settings, with a checksum for each shot."""

from __future__ import annotations

import shutil
import sys
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from glob import escape
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import SystemConfig
from quadfringe.data import Shape
from quadfringe.errors import InputError, RecordingWarning
from quadfringe.files import PARTIAL, atomic_folder, folder_for
from quadfringe.recording import Recording
from quadfringe.recording._checksums import sha256_of
from quadfringe.recording.reader import listed

__all__ = ["DONE", "REFUSED", "Job", "locked", "maps_of", "open_results", "save"]

MAPS = ("phase_rad", "modulation", "quality")
# Maps that a shape has or has not, and the last dimension of those that have three.
MORE_MAPS = ("wrong_order_probability", "uncertainty_rad", "uncertainty_mm", "reason", "xyz_mm", "albedo")
LAST = {"xyz_mm": ("axis", 3), "albedo": ("channel", 4)}
DONE, REFUSED = 1, 2
FORMAT = "quadfringe batch 2"
LOCK = ".quadfringe-batch.lock"


@dataclass(frozen=True)
class Job:
    """One recording, the folder of its results, and the shots that remain to be decoded."""

    recording: Path
    out: Path
    config: SystemConfig
    ply: bool
    shots: int
    pending: tuple[int, ...]

    @property
    def store(self) -> Path:
        """The zarr group."""
        return self.out / f"{self.recording.stem}.zarr"

    @property
    def folder(self) -> Path:
        """The folder of the PLY files and of errors.json."""
        return self.out / self.recording.stem


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Hold the folder of results for one run; raises `InputError` while another run holds it.

    The lock ends with the process, however that ends. Its empty file stays, because removing it would let two runs in.
    """
    with (folder_for(out) / LOCK).open("a") as file:
        try:
            _lock(file)
        except OSError as error:
            raise InputError(
                f"{out}: another batch writes into this folder; wait for its end or choose another --out"
            ) from error
        yield


def _lock(file: IO[str]) -> None:
    """Lock a file until it is closed; raises OSError if another process has locked it."""
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def open_results(job: Job, take: Recording, settings: dict[str, Any], *, calibrated: bool) -> NDArray[np.bool_]:
    """Create the empty results of a job or find those of an earlier run; return which shots are finished, (N,).

    A finished shot whose files do not match their checksum is not finished, with a `RecordingWarning`. Raises
    `InputError` for results of another recording or of other settings.
    """
    import zarr

    _sweep(job)
    attributes = {"format": FORMAT, "source": job.recording.name, "recording": take.sha256, "settings": settings}
    if not job.store.exists():
        # Created in a temporary folder and renamed, so that an existing store is complete.
        with atomic_folder(job.store) as temporary:
            group = zarr.open_group(temporary, mode="w", attributes=attributes)
            _fill(group, take, maps_of(job.config, calibrated=calibrated))
            group.attrs["arrays_sha256"] = _arrays_sha256(temporary)
        return np.zeros(job.shots, bool)
    try:
        group = zarr.open_group(job.store, mode="r")
        found = dict(group.attrs)
        arrays_sha256 = found.pop("arrays_sha256", None)
        if found != attributes:
            raise InputError(
                f"{job.store}: made with other settings, from another recording or by an earlier version; "
                "choose another --out"
            )
        if arrays_sha256 != _arrays_sha256(job.store):
            raise InputError(f"{job.store}: changed since it was made; choose another --out")
        status, checksums = group["status"][:], group["checksum"][:]
    except InputError:
        raise
    except (KeyError, ValueError, OSError, RuntimeError) as error:
        raise InputError(f"{job.store}: expected the result of a batch: {error}; choose another --out") from error
    return _finished(job, status, checksums)


def maps_of(config: SystemConfig, *, calibrated: bool) -> tuple[str, ...]:
    """Name the maps of the shapes that these settings give."""
    without = {"uncertainty_rad"} if calibrated else {"uncertainty_mm", "xyz_mm"}
    if config.decode.method == "published" or config.decode.albedo is False:
        without.add("albedo")
    return tuple(name for name in (*MAPS, *MORE_MAPS) if name not in without)


def _finished(job: Job, status: NDArray[Any], checksums: NDArray[Any]) -> NDArray[np.bool_]:
    finished: NDArray[np.bool_] = status == DONE
    changed = [shot for shot in np.flatnonzero(finished).tolist() if _checksum(job, shot) != checksums[shot]]
    if changed:
        warnings.warn(
            f"{job.store}: results of {len(changed)} shots were changed and are made again: {listed(changed)}",
            RecordingWarning,
            stacklevel=2,
        )
    finished[changed] = False
    return finished


def save(job: Job, shot: int, shape: Shape, group: Any) -> None:
    """Write the results of a shot, then their checksum, then that they are done."""
    for name in (*MAPS, *MORE_MAPS):
        if (values := getattr(shape, name)) is not None:
            group[name][shot] = values
    if shape.xyz_mm is not None and job.ply:
        shape.save(_ply(job, shot))
    group["checksum"][shot] = _checksum(job, shot)
    group["status"][shot] = DONE


def _ply(job: Job, shot: int) -> Path:
    return job.folder / f"shot_{shot:06d}.ply"


def _checksum(job: Job, shot: int) -> int:
    """Return the CRC-32 of the files of a shot, with their names and sizes."""
    crc = 0
    for name in (*MAPS, *MORE_MAPS):
        for path in sorted((job.store / name / "c" / str(shot)).rglob("*")):
            crc = _crc_of_file(path, path.relative_to(job.store), crc)
    return _crc_of_file(_ply(job, shot), _ply(job, shot).relative_to(job.out), crc) if job.ply else crc


def _crc_of_file(path: Path, name: Path, crc: int) -> int:
    with suppress(FileNotFoundError, IsADirectoryError):
        data = path.read_bytes()
        crc = zlib.crc32(data, zlib.crc32(f"{name} {len(data)}".encode(), crc))
    return crc


def _arrays_sha256(store: Path) -> str:
    """Return the SHA-256 of the files that are written once: descriptions of arrays, numbers and times of shots."""
    paths = [*store.glob("*/zarr.json"), *(path for name in ("id", "time_us") for path in store.glob(f"{name}/c/**/*"))]
    files = {str(path.relative_to(store)): path.read_bytes().hex() for path in sorted(paths) if path.is_file()}
    return sha256_of(files)


def _sweep(job: Job) -> None:
    """Remove the partial files of a killed run."""
    for leftover in (*job.store.rglob("*.partial"), *job.folder.glob(".shot_*"), *job.folder.glob(".errors-*")):
        leftover.unlink(missing_ok=True)
    for leftover in job.out.glob(f".{escape(job.recording.stem)}-*{PARTIAL}"):
        shutil.rmtree(leftover, ignore_errors=True)


def _fill(group: Any, take: Recording, maps: tuple[str, ...]) -> None:
    from zarr.codecs import BloscCodec

    size = (take.header.height_px, take.header.width_px)
    for name in maps:
        dtype, empty = ("u1", 0) if name == "reason" else ("f4", float("nan"))
        last = dict([LAST[name]] if name in LAST else [])
        shape = (*size, *last.values())
        group.create_array(
            name,
            shape=(len(take), *shape),
            chunks=(1, *shape),
            dimension_names=("shot", "row", "column", *last),
            dtype=dtype,
            fill_value=empty,
            compressors=[BloscCodec(cname="lz4", clevel=1, shuffle="shuffle", typesize=np.dtype(dtype).itemsize)],
        )
    for name, numbers in (("id", take.ids), ("time_us", take.times_us)):
        group.create_array(name, data=numbers, dimension_names=("shot",))
    for name, dtype in (("status", "u1"), ("checksum", "u4")):
        one = {"shape": (len(take),), "chunks": (1,), "dimension_names": ("shot",)}
        group.create_array(name, dtype=dtype, fill_value=0, **one)
