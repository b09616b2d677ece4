"""What a system is made of: a projector that shows fringes and a camera that takes shots of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import TracebackType
from typing import Literal, Protocol, Self

from quadfringe.config import Fringes, SystemConfig
from quadfringe.config.cameras import capture_config
from quadfringe.data import AnyShot, Calibration
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
]

Keep = Literal["latest", "all"]

# Where each kind of `[capture]` is implemented: a module with `open_devices`. A recording that is played back stands
# above the devices and is loaded by name.
CAMERAS = {
    "virtual": "quadfringe.devices.virtual",
    "aravis": "quadfringe.devices.aravis",
    "replay": "quadfringe.recording.replay",
}


class Projector(Protocol):
    """Shows a composite colour image and an infrared one, at one instant: the fringes of a shot, or other light."""

    def show(self, light: Light) -> None:
        """Project this light until told otherwise; ValueError for fringes that cannot number the field.

        Levels and single steps are what a calibration asks for; ValueError when this projector cannot show them.
        """

    def close(self) -> None:
        """Release the device; closing twice is allowed."""


@dataclass(frozen=True)
class ChipStatistics:
    """Frames of one chip: whole ones, and what became of the others.

    `damaged` frames were refused: incomplete, or of another size or format than agreed; `missed` is by how much the
    device's own numbers jumped; `unpaired` frames were whole and had no partner of the same instant.
    """

    frames: int = 0
    damaged: int = 0
    missed: int = 0
    unpaired: int = 0


@dataclass(frozen=True)
class CameraStatistics:
    """What a camera did since it was opened: complete shots, those that nobody took in time, and frames by chip."""

    shots: int = 0
    dropped: int = 0
    chips: Mapping[str, ChipStatistics] = field(default_factory=dict)

    @property
    def damaged(self) -> int:
        """Frames that were refused, of all chips."""
        return sum(chip.damaged for chip in self.chips.values())

    @property
    def missed(self) -> int:
        """Frame numbers that were skipped, of all chips."""
        return sum(chip.missed for chip in self.chips.values())

    @property
    def unpaired(self) -> int:
        """Whole frames without a partner, of all chips."""
        return sum(chip.unpaired for chip in self.chips.values())


class Camera(Protocol):
    """Takes four channels in one exposure: as four images, or as a raw mosaic and an infrared image.

    What the camera did is a `CameraError`; asked again after one, it connects anew. A closed camera is a ValueError.
    """

    @property
    def name(self) -> str:
        """Which camera this is, for people."""

    @property
    def paced(self) -> bool:
        """Whether shots come at the camera's own pace; otherwise they are made when asked for, and none is lost."""

    @property
    def calibration(self) -> Calibration | None:
        """What the camera knows of its bench; None when it knows nothing."""

    def snap(self, timeout_s: float | None = None) -> AnyShot:
        """Take one shot, exposed after this call."""

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:
        """Take shots until `count` or until the iterator is closed; one stream at a time.

        "latest" gives the newest shot there is; "all" gives them in order out of a queue. Both drop the oldest when
        nobody takes them in time, and count that.
        """

    def statistics(self) -> CameraStatistics:
        """Give the counts since the camera was opened; from any thread."""

    def close(self) -> None:
        """Release the device; closing twice is allowed."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class ExternalLight:
    """Fringes that somebody else shows, or that were shown when a recording was made."""

    def show(self, light: Light) -> None:
        """Trust that these fringes are there; raises `ConfigError` for the changing light of a calibration."""
        if not isinstance(light, Fringes):
            raise ConfigError(
                "no projector of this system can show the light of a calibration: name them under [projectors]"
            )

    def close(self) -> None:
        """Nothing to release."""


@dataclass(frozen=True)
class Devices:
    """The devices of a system, and its settings with what the devices made of them."""

    camera: Camera
    projector: Projector
    config: SystemConfig


def open_devices(config: SystemConfig) -> Devices:
    """Open camera and projector of a system; the module of the capture's kind knows how.

    Raises `ConfigError` for devices that do not go together, OSError when one cannot be opened.
    """
    devices: Devices = import_module(CAMERAS[config.capture.kind]).open_devices(config)
    return devices


def open_camera(word: str) -> Camera:
    """Open a camera alone by a word: "virtual:", "aravis:NAME" (or "aravis:" for the only one), "replay:FILE".

    >>> from quadfringe.devices import open_camera
    >>> with open_camera("virtual:") as camera:
    ...     camera.snap().id
    1
    """
    devices = open_devices(SystemConfig(capture=capture_config(word)))
    devices.projector.show(devices.config.fringes)
    return devices.camera


def open_projector(config: SystemConfig) -> Projector:
    """Open the projectors of a system: those of its `projectors`, or of a virtual bench when there are none.

    With a camera other than the virtual one, the light without `projectors` is somebody else's.
    Raises OSError when a device cannot be opened, ValueError when it cannot do what the settings ask.
    """
    if config.projectors is not None:
        from quadfringe.devices.lightcrafter import CoaxialPair

        known = None if config.calibration is None else Calibration.load(config.calibration)
        return CoaxialPair(config.projectors, known)
    if config.capture.kind != "virtual":
        return ExternalLight()
    from quadfringe.devices.virtual import VirtualBench, VirtualProjector

    return VirtualProjector(VirtualBench(config))
