"""A folder as a camera: images that another program writes there become shots as they arrive.

>>> from quadfringe.devices import open_camera
>>> with open_camera("files:captures") as camera:  # doctest: +SKIP
...     shot = camera.snap()  # the next image that appears in the folder
>>> from tempfile import TemporaryDirectory
>>> import numpy as np
>>> from quadfringe.config import FilesConfig, SystemConfig
>>> from quadfringe.data import Shot, write_shot
>>> from quadfringe.devices.files import *
>>> with TemporaryDirectory() as folder:
...     _ = write_shot(f"{folder}/one", Shot(*[np.full((48, 64), grey, np.uint8) for grey in (10, 20, 30, 40)]))
...     settings = FilesConfig(folder=folder, start="all", settle_s=0.0)
...     with FilesCamera(settings) as camera:
...         shot = camera.snap()
...     open_devices(SystemConfig(capture=settings)).camera.close()
>>> [int(image[0, 0]) for image in shot.channels.values()]
[10, 20, 30, 40]
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from itertools import count as numbers
from threading import Event
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadfringe.config import SystemConfig
from quadfringe.config.cameras import FilesConfig
from quadfringe.data import AnyShot, Calibration, FrameStamp, Stamp
from quadfringe.data.host_clock import HOST_CLOCK
from quadfringe.devices import CameraStatistics, ChipStatistics, Devices, Keep, open_projector
from quadfringe.devices._folder import JPEG, Group, WatchedFolder
from quadfringe.devices._shots import shot_of, split_colours
from quadfringe.errors import CameraWarning, InputError, ShotTimeoutError
from quadfringe.io.images import full_scale, read_image

__all__ = ["FilesCamera", "open_devices"]

LOOK_S = 0.05  # pause between two looks at the folder
MAY_WAIT = {"latest": 1, "all": 64}  # shots that the queue of another camera would hold
UNREADABLE_S = 2.0  # a file that is unchanged for this time and cannot be read is not being written: it is wrong


class FilesCamera:
    """Makes shots of the images of a folder; close it, or use it in a `with` block.

    A file is read when it has not changed for `settle_s`. Files that are wrong, and shots of which images are missing,
    are left out with a `CameraWarning` and counted as damaged. A stream waits until images come, without a limit.
    Raises `InputError` for a folder that does not exist.
    """

    def __init__(self, config: FilesConfig) -> None:
        if not config.folder.is_dir():
            what = "is a file, not a folder" if config.folder.exists() else "no such folder"
            raise InputError(f"{config.folder}: {what}; name the folder into which the camera software writes")
        self.config = config
        self._folder = WatchedFolder(config.folder, config.bayer)
        self._form: tuple[tuple[int, ...], Any] | None = None  # shape and type of the first shot
        self._last_id = self._last_us = self._shots = self._dropped = self._damaged = 0
        self._streaming = False
        self._closed, self._interrupted = Event(), Event()
        if config.start == "new":
            self._folder.take_all()

    def __repr__(self) -> str:
        return f"FilesCamera({self.config.folder}, {self._shots} shots)"

    @property
    def name(self) -> str:
        """Name of the folder."""
        return f"folder {self.config.folder}"

    @property
    def paced(self) -> bool:
        """Whether shots come by themselves; those that are there from the start wait until they are taken."""
        return self.config.start == "new"

    @property
    def calibration(self) -> Calibration | None:
        """None: a folder of images does not know its bench."""
        return None

    def snap(self, timeout_s: float | None = None) -> AnyShot:
        """Return the shot of the next images; raises `ShotTimeoutError` when none are whole in time.

        Images that are there already do not count, unless `start` is "all".
        """
        self._check_free()
        if self.paced:
            self._folder.take_all()
        timeout_s = self.config.timeout_s if timeout_s is None else timeout_s
        deadline_s = time.monotonic() + timeout_s
        with HOST_CLOCK.held():
            while (shot := self._next("all")) is None:
                if time.monotonic() >= deadline_s:
                    raise ShotTimeoutError(f"{self.name}: no shot within {timeout_s:g} s: {self._lacking()}")
                self._closed.wait(LOOK_S)
                self._check_open()
        return shot

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:
        """Yield `count` shots as images come, or shots until the iterator is closed or `interrupt` is called."""
        self._check_free()
        return self._play(count, keep)

    def _play(self, count: int | None, keep: Keep) -> Iterator[AnyShot]:
        self._check_free()
        self._streaming = True
        self._interrupted.clear()
        try:
            with HOST_CLOCK.held():
                for _ in numbers() if count is None else range(count):
                    shot = None
                    while shot is None:
                        if self._interrupted.is_set():
                            return
                        shot = self._next(keep)
                        if shot is None:
                            self._interrupted.wait(LOOK_S)
                    yield shot
        finally:
            self._streaming = False

    def interrupt(self) -> None:
        """End a stream that waits in another thread; do nothing without a stream."""
        self._interrupted.set()

    def _next(self, keep: Keep) -> AnyShot | None:
        """Give the shot that is next, or None while none is whole."""
        self._folder.look()
        whole = [group for group in self._folder.groups() if self._is_whole(group)]
        most = MAY_WAIT[keep] if self.paced else len(whole)
        for group in whole[: max(len(whole) - most, 0)]:
            self._take(group)
            self._shots += 1
            self._dropped += 1
        for group in whole[-most:]:
            if (shot := self._shot(group)) is not None:
                return shot
        return None

    def _is_whole(self, group: Group) -> bool:
        """Say whether a shot can be read; leave one out whose images are missing for too long, or contradict."""
        if group.rest_s < self.config.settle_s:
            return False
        lacking = self._missing(group)
        if "rgb" in group.files and len(group.files.keys() - {"ir"}) > 1:
            others = ", ".join(sorted(group.files.keys() - {"ir", "rgb"}))
            self._leave_out(group, f"{group.files['rgb'].name} already holds the colours of {others}; keep one of them")
            return False
        if lacking and group.rest_s > self.config.incomplete_s:
            there = ", ".join(path.name for path in group.files.values())
            words = f"{there} came, but no image for {', '.join(lacking)} within {self.config.incomplete_s:g} s"
            self._leave_out(group, f"{words}; write all images of a shot, or one colour image")
        may_come = self.config.infrared is None and "ir" not in group.files
        return not lacking and not (may_come and group.rest_s < self.config.infrared_wait_s)

    def _missing(self, group: Group) -> list[str]:
        wanted = ["ir"] if self.config.infrared and "ir" not in group.files else []
        return group.missing + wanted

    def _shot(self, group: Group) -> AnyShot | None:
        """Read a shot; None while it may still be written, or when it is wrong and left out."""
        try:
            shot = self._read(group)
        except InputError as error:
            if group.rest_s >= UNREADABLE_S:
                self._leave_out(group, str(error))
            return None
        self._take(group)
        self._shots += 1
        return shot

    def _read(self, group: Group) -> AnyShot:
        images = self._images(group)
        scales = {name: self._full_scale(name, image) for name, image in images.items()}
        bayer = self.config.bayer if "raw" in images else None
        now_ns = HOST_CLOCK.now_ns()
        time_us = max(min(group.changed_ns, now_ns) // 1000, self._last_us + 1)
        frame = FrameStamp(self._last_id + 1, group.changed_ns, now_ns)
        chips = ("visible", "infrared") if "ir" in images else ("visible",)
        stamp = Stamp(self._last_id + 1, time_us, self.name, dict.fromkeys(chips, frame))
        shot = shot_of(images, min(scales.values()), bayer=bayer, stamp=stamp)
        form = next(iter(images.values()))
        if self._form is not None and (form.shape, form.dtype) != self._form:
            shape, dtype = self._form
            raise InputError(
                f"{form.shape[1]} x {form.shape[0]} {form.dtype}, but the shots before had {shape[1]} x {shape[0]} "
                f"{dtype}; keep one size and type, or start again"
            )
        self._form, self._last_us = (form.shape, form.dtype), time_us
        return shot

    def _images(self, group: Group) -> dict[str, NDArray[Any]]:
        images: dict[str, NDArray[Any]] = {}
        for role, path in group.files.items():
            if role == "ir" and self.config.infrared is False:
                continue
            if path.suffix.lower() in JPEG:
                self._warn("JPEG changes the fringes by its compression; let the camera software write PNG or TIFF")
            image = read_image(path)
            if role == "rgb":
                if image.ndim != 3:
                    raise InputError(
                        f"{path.name}: expected a colour image, got a grey one; name grey images "
                        f"{group.name}_red{path.suffix} and so on, or set bayer for a raw mosaic"
                    )
                images |= split_colours(image)
            else:
                images[role] = _grey(path.name, role, image)
        return images

    def _full_scale(self, name: str, image: NDArray[Any]) -> float:
        if self.config.bits is None or image.dtype != np.uint16:
            return float(full_scale(image))
        full = 2**self.config.bits - 1
        if int(image.max()) > full:
            raise InputError(f"{name}: values up to {image.max()}, above {full}, the top of {self.config.bits} bits")
        return float(full)

    def _leave_out(self, group: Group, reason: str) -> None:
        """Warn of a shot that is wrong, and never look at its files again unless they change."""
        self._take(group)
        self._damaged += 1
        self._warn(f"shot {group.name or 'of this name'} is left out: {reason.removeprefix(f'{self.config.folder}/')}")

    def _warn(self, words: str) -> None:
        warnings.warn(f"{self.name}: {words}", CameraWarning, stacklevel=2)

    def _take(self, group: Group) -> None:
        self._folder.take(group)
        self._last_id += 1

    def _lacking(self) -> str:
        """Say why there is no shot, and what to do."""
        waiting = self._folder.groups()
        if not waiting:
            return "no image came; let the camera software write PNG, TIFF or BMP files into this folder"
        group = waiting[-1]
        there = ", ".join(path.name for path in group.files.values())
        missing = ", ".join(self._missing(group))
        return f"{there} came, but no image for {missing}" if missing else f"{there} is not readable yet"

    def _check_open(self) -> None:
        if self._closed.is_set():
            raise ValueError(f"{self.name}: the camera is closed")

    def _check_free(self) -> None:
        self._check_open()
        if self._streaming:
            raise ValueError(f"{self.name} already streams; close that stream first")

    def statistics(self) -> CameraStatistics:
        """Return how many shots came, how many of them nobody took, and how many others were left out."""
        chips = {"files": ChipStatistics(frames=self._shots, damaged=self._damaged)}
        return CameraStatistics(self._shots, self._dropped, chips)

    def close(self) -> None:
        """Leave the folder alone; further calls do nothing."""
        self._closed.set()
        self._interrupted.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _grey(name: str, role: str, image: NDArray[Any]) -> NDArray[Any]:
    if image.ndim == 2:
        return image
    if (image == image[:, :, :1]).all():
        return np.ascontiguousarray(image[:, :, 0])
    raise InputError(f"{name}: expected a grey image of {role}, got a colour image; name it without {role}")


def open_devices(config: SystemConfig) -> Devices:
    """Watch the folder of `capture`, and open the projectors of the system."""
    assert isinstance(config.capture, FilesConfig)
    camera = FilesCamera(config.capture)
    try:
        return Devices(camera, open_projector(config), config)
    except BaseException:
        camera.close()
        raise
