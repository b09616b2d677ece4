"""The devices of a system: the protocols of camera and projector, and how they are opened.

>>> import quadfringe as qf
>>> from quadfringe.devices import *
>>> keep: Keep = "all"
>>> with open_camera("virtual:") as camera:
...     statistics = camera.statistics()
>>> isinstance(statistics, CameraStatistics)
True
>>> all(isinstance(chip, ChipStatistics) for chip in statistics.chips.values())
True
>>> small = qf.Device(width_px=256, height_px=192, focal_px=(645, 645), centre_px=(127.5, 95.5))
>>> devices = open_devices(qf.SystemConfig(camera=small))
>>> isinstance(devices, Devices)
True
>>> projector: Projector = devices.projector
>>> projector.show(qf.Fringes())
>>> camera: Camera = devices.camera
>>> camera.snap().red.shape
(192, 256)
>>> ExternalLight().show(qf.Fringes())  # light that no program drives
>>> with open_projector(qf.SystemConfig(projectors={"visible": {"port": "1-1", "hdmi": {}}})) as pair:  # doctest: +SKIP
...     pair.show(qf.Fringes())
>>> system = qf.SystemConfig(capture={"kind": "uvc", "exposure_us": 16700.0}, projectors={
...     "visible": {"kind": "hdmi", "size_px": (1280, 720), "frame_rate_hz": 60.0, "match_exposure": True}
... }, fringes=qf.Fringes(encoding="rgb"))
>>> list(part_frames(system)), with_whole_frames(system).capture.exposure_us
([], 16666.7)
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import TracebackType
from typing import Literal, Protocol, Self

from quadfringe.config import Fringes, SystemConfig, check_system
from quadfringe.config.cameras import capture_config
from quadfringe.data import AnyShot, Calibration
from quadfringe.devices._frames import part_frames, warn_of_part_frames, with_whole_frames
from quadfringe.devices.light import Light
from quadfringe.errors import ConfigError

__all__ = [
    "Camera",
    "CameraStatistics",
    "ChipStatistics",
    "Devices",
    "ExternalLight",
    "Keep",
    "Projector",
    "open_camera",
    "open_devices",
    "open_projector",
    "part_frames",
    "with_whole_frames",
]

Keep = Literal["latest", "all"]

# The module with `open_devices` for each kind of `[capture]`. The replay of recordings belongs to a higher layer, so it
# is imported by name.
CAMERAS = {
    "virtual": "quadfringe.devices.virtual",
    "aravis": "quadfringe.devices.aravis",
    "files": "quadfringe.devices.files",
    "uvc": "quadfringe.devices.uvc",
    "replay": "quadfringe.recording.replay",
}


class Projector(Protocol):
    """Shows a composite colour image and an infrared image at the same time: the fringes of a shot, or other light."""

    def show(self, light: Light) -> None:
        """Project this light until the next call.

        Raises ValueError for fringe numbers that are ambiguous over the projector width, and for levels and single
        steps, the light of a calibration, when this projector cannot show them.
        """

    def close(self) -> None:
        """Release the device; further calls do nothing."""


@dataclass(frozen=True)
class ChipStatistics:
    """Counts of the frames of one chip.

    `frames` arrived complete; `damaged` frames were rejected, because they were incomplete or had a wrong size or
    format; `missed` counts gaps in the frame numbers of the device; `unpaired` frames were complete, but the other chip
    sent none of the same instant.
    """

    frames: int = 0
    damaged: int = 0
    missed: int = 0
    unpaired: int = 0


@dataclass(frozen=True)
class CameraStatistics:
    """Counts since the camera was opened: complete shots, shots dropped because nothing took them, frames by chip."""

    shots: int = 0
    dropped: int = 0
    chips: Mapping[str, ChipStatistics] = field(default_factory=dict)

    @property
    def damaged(self) -> int:
        """Rejected frames of all chips."""
        return sum(chip.damaged for chip in self.chips.values())

    @property
    def missed(self) -> int:
        """Skipped frame numbers of all chips."""
        return sum(chip.missed for chip in self.chips.values())

    @property
    def unpaired(self) -> int:
        """Complete frames of all chips without a partner."""
        return sum(chip.unpaired for chip in self.chips.values())


class Camera(Protocol):
    """Takes all channels in one exposure: as four images, or as a raw mosaic and an infrared image.

    The infrared image of a camera without an infrared chip is black.

    Raises `CameraError` for faults of the camera; the next call after one reconnects. Raises ValueError when closed.
    """

    @property
    def name(self) -> str:
        """Name of the camera, for messages."""

    @property
    def paced(self) -> bool:
        """Whether the camera sets the pace of the shots; otherwise shots are made on demand and none is lost."""

    @property
    def calibration(self) -> Calibration | None:
        """Calibration of the bench, if the camera knows it, as the virtual one does; otherwise None."""

    def snap(self, timeout_s: float | None = None) -> AnyShot:
        """Take one shot that is exposed after this call; `timeout_s` overrides the longest wait of the camera, s."""

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:
        """Yield `count` shots, or shots until the iterator is closed; only one stream can be open.

        `keep="latest"` yields the newest shot; `keep="all"` yields them in order from a queue. Both drop and count the
        oldest shot when the shots are not taken in time.
        """

    def interrupt(self) -> None:
        """End a stream that waits for a shot in another thread; do nothing without a stream."""

    def statistics(self) -> CameraStatistics:
        """Return the counts since the camera was opened; safe to call from any thread."""

    def close(self) -> None:
        """Release the device; further calls do nothing."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class ExternalLight:
    """A projector outside the system: its fringes are shown by other means, or were shown during a recording."""

    def __repr__(self) -> str:
        return "ExternalLight()"

    def show(self, light: Light) -> None:
        """Do nothing for fringes; raise `ConfigError` for the light of a calibration, which nothing would show."""
        if not isinstance(light, Fringes):
            raise ConfigError(
                "this system has no projector to show the light of a calibration; name both under [projectors]"
            )

    def close(self) -> None:
        """Do nothing."""


@dataclass(frozen=True)
class Devices:
    """The opened devices of a system, and its settings as the devices accepted them.

    `offset_px` is the first column and row of the images on the chip, if the camera or a recording of it tells.
    """

    camera: Camera
    projector: Projector
    config: SystemConfig
    offset_px: tuple[int, int] | None = None


def open_devices(config: SystemConfig) -> Devices:
    """Open camera and projector of a system, with the module for its kind of capture.

    Raises `ConfigError` for devices that cannot be combined, and OSError when one cannot be opened.
    """
    check_system(config)
    config = with_whole_frames(config)
    devices: Devices = import_module(CAMERAS[config.capture.kind]).open_devices(config)
    warn_of_part_frames(devices.config)
    return devices


def open_camera(word: str) -> Camera:
    """Open a camera without a system file: "virtual:", "aravis:NAME", "uvc:0", "files:FOLDER", "replay:FILE".

    "aravis:" is the only GenICam camera that answers.

    >>> from quadfringe.devices import open_camera
    >>> with open_camera("virtual:") as camera:
    ...     camera.snap().id
    1
    """
    devices = open_devices(SystemConfig(capture=capture_config(word)))
    devices.projector.show(devices.config.fringes)
    return devices.camera


def open_projector(config: SystemConfig) -> Projector:
    """Open the projectors of a system: those under `projectors`, else those of the virtual bench.

    With a real camera and no `projectors`, the fringes are shown by other means (`ExternalLight`). Raises OSError when
    a device cannot be opened, and ValueError when it does not support the settings.
    """
    check_system(config)
    if config.projectors is not None:
        known = None if config.calibration is None else Calibration.load(config.calibration)
        if config.projectors.lightcrafters is None:
            from quadfringe.devices.hdmi import HdmiProjectors

            return HdmiProjectors(config.projectors, known)
        from quadfringe.devices.lightcrafter import ProjectorPair

        return ProjectorPair(config.projectors, known)
    if config.capture.kind != "virtual":
        return ExternalLight()
    from quadfringe.devices.virtual import VirtualBench, VirtualProjector

    return VirtualProjector(VirtualBench(config))
