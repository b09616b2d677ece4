"""Record a live stream; after a full disk has room again, recording resumes in a new file."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from quadfringe.config import SystemConfig
from quadfringe.data import AnyShot, Calibration
from quadfringe.errors import InputError, RecordingError
from quadfringe.recording._layout import Header
from quadfringe.recording.writer import RecordingWriter

__all__ = ["Recorder", "RecorderStatistics"]

RETRY_S = 1.0  # pause between attempts to create a new file


@dataclass(frozen=True)
class RecorderStatistics:
    """Shots on file, shots that the disk refused, bytes of images, files, and the current fault, if any."""

    written: int
    refused: int
    image_bytes: int
    files: tuple[Path, ...]
    fault: str | None


class Recorder:
    """Writes shots to take.h5, and to take_001.h5 and so on after a disk fault or at a size of `file_gb`.

    `write` is meant as a tap of a stream: it blocks for one write and does not raise when the disk is full. It then
    counts the shot as refused, sets `statistics().fault`, and tries once a second to start a new file. Raises
    `InputError` for a file that exists, and for shots that differ from the first.
    """

    def __init__(
        self,
        path: Path | str,
        config: SystemConfig | None = None,
        calibration: Calibration | None = None,
        *,
        file_gb: float | None = None,
    ) -> None:
        self.path = Path(path)
        self.config, self.calibration = config, calibration
        self._file_bytes = None if file_gb is None else file_gb * 1e9
        self._writer: RecordingWriter | None = None
        self._files: list[Path] = []
        self._written = self._refused = self._image_bytes = 0
        self._fault: str | None = None
        self._retry_at = 0.0
        self._lock = Lock()
        if self.path.suffix != ".h5":
            raise InputError(f"{path}: expected a name that ends in .h5")
        if self.path.exists():
            raise InputError(f"{path}: exists already; recordings are never overwritten")
        if not self.path.parent.is_dir():
            raise InputError(f"{path}: the folder {self.path.parent} does not exist; create it first")

    def write(self, shot: AnyShot) -> None:
        """Write a shot; count it as written once it is safe on file."""
        with self._lock:
            try:
                writer = self._writer_for(shot)
                if writer is None:
                    self._refused += 1
                    return
                writer.append(shot)
            except RecordingError as error:
                self._fail(str(error))
            else:
                self._written += 1
                self._image_bytes += writer.header.shot_bytes
                self._fault = None

    def _fail(self, reason: str) -> None:
        self._refused += 1
        self._fault = reason
        self._retry_at = time.monotonic() + RETRY_S
        self._end_file()

    def _writer_for(self, shot: AnyShot) -> RecordingWriter | None:
        """Return the current file, or a new one, or None while a fault waits for the next attempt."""
        if self._is_long_enough():
            self._end_file()
        writer = self._writer
        if writer is None:
            if time.monotonic() < self._retry_at:
                return None
            path = self._next_path()
            writer = RecordingWriter(path, Header.of(shot, self.config, self.calibration))
            self._writer = writer
            self._files.append(path)
        return writer

    def _is_long_enough(self) -> bool:
        writer = self._writer
        if writer is None or self._file_bytes is None or not writer.written:
            return False
        return (writer.written + 1) * writer.header.shot_bytes > self._file_bytes

    def _next_path(self) -> Path:
        number = len(self._files)
        return self.path if number == 0 else self.path.with_name(f"{self.path.stem}_{number:03d}.h5")

    def _end_file(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    def statistics(self) -> RecorderStatistics:
        """Return the counters; safe to call at any time from any thread."""
        return RecorderStatistics(self._written, self._refused, self._image_bytes, tuple(self._files), self._fault)

    def close(self) -> None:
        """Close the file properly; further calls do nothing."""
        with self._lock:
            self._end_file()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()
