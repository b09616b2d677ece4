"""One call from light to shape: project, grab, decode.

>>> import quadfringe as qf
>>> with qf.open() as scanner:          # no system file: the virtual bench
...     shape = scanner.measure()
>>> shape.xyz_mm.shape
(768, 1024, 3)
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from quadfringe.config import SystemConfig, load_system
from quadfringe.data import AnyShot, Calibration, Shape
from quadfringe.decoding import Decoder, Plan
from quadfringe.devices import Camera, Keep, Projector, open_devices
from quadfringe.scanner.streaming import LiveStream, Tap

__all__ = ["Scanner", "open_system"]

LIGHTCRAFTER_COLUMNS = 912  # projector columns that fringes cover when no calibration and no system file says otherwise


class Scanner:
    """A projector, a camera and a decoder that belong together; close it, or use it in a `with` block.

    `calibration` turns shots into millimetres; it is None when the system has none, and shapes then hold phase only.
    """

    def __init__(
        self, config: SystemConfig, projector: Projector, camera: Camera, calibration: Calibration | None
    ) -> None:
        self.config = config
        self.calibration = calibration
        self.projector = projector
        self.camera = camera
        self._described = config.model_dump(mode="json", exclude_none=True)
        self._idle: list[Decoder] = []
        self._live: LiveStream | None = None

    @property
    def projector_width_px(self) -> int:
        """Projector columns that the fringes cover: those of the calibration, else of the system file, else 912."""
        projector = self.config.projector if self.calibration is None else self.calibration.projector
        return LIGHTCRAFTER_COLUMNS if projector is None else projector.width_px

    def grab(self) -> AnyShot:
        """Project the fringes and take one shot of them."""
        self.projector.show(self.config.fringes)
        return self.camera.snap()

    def decode(self, shot: AnyShot) -> Shape:
        """Give the shape of a shot of this system; raises `DecodeError` when none can be trusted.

        Threads may call this at the same time: each then has a decoder of its own.
        """
        try:
            decoder = self._idle.pop()
        except IndexError:
            decoder = Decoder(shot, self._plan())
        try:
            shape = decoder.decode(shot)
        finally:
            self._idle.append(decoder)
        return shape.with_settings(self._described | {"decode": shape.config["decode"]}, self.calibration)

    def measure(self) -> Shape:
        """Project, grab, decode: one exposure in, one metric shape out."""
        return self.decode(self.grab())

    def stream(
        self,
        count: int | None = None,
        *,
        keep: Keep = "latest",
        taps: Mapping[str, Tap] | None = None,
        resume: bool = False,
    ) -> LiveStream:
        """Measure without pause: `count` shots are captured, or as many as come until the stream is closed.

        Capture, decode and the caller run at a pace of their own; "latest" gives the newest shape there is, "all" keeps
        up to 64 shots waiting. Both drop the oldest shot when they must, and count it. `taps` are called with every
        captured shot, each in a thread of its own: a recorder, say. With `resume` a camera that fails is asked again
        until the stream is closed; otherwise its `CameraError` ends the stream. A second stream ends the first.

        >>> import quadfringe as qf
        >>> with qf.open() as scanner, scanner.stream(2, keep="all") as stream:
        ...     depths = [measured.shape.depth_mm for measured in stream]
        >>> len(depths)
        2
        """
        self._end_stream()
        self.projector.show(self.config.fringes)
        # The published method leaves processors idle between its rows and the next shot; the best one keeps them
        # busy, and two shots at once would only be later.
        at_once = 2 if self.config.decode.method == "published" else 1
        self._live = LiveStream(self.camera, self.decode, count, keep=keep, taps=taps, resume=resume, at_once=at_once)
        return self._live

    def _end_stream(self) -> None:
        if self._live is not None:
            self._live.close()
            self._live = None

    def _plan(self) -> Plan:
        return Plan(
            projector_width_px=self.projector_width_px,
            fringes=self.config.fringes,
            calibration=self.calibration,
            decode=self.config.decode,
        )

    def close(self) -> None:
        """End the stream and release the devices, the light also when the camera fails."""
        self._end_stream()
        try:
            self.camera.close()
        finally:
            self.projector.close()

    def __enter__(self) -> Scanner:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def open_system(system: Path | str | SystemConfig | None = None) -> Scanner:
    """Open the system of a TOML file, of a config, or the virtual bench as it comes.

    Raises `ConfigError` when the file has unknown keys or wrong values, or names devices that do not go together;
    OSError when a device cannot be opened.
    """
    if system is None:
        config = SystemConfig()
    elif isinstance(system, SystemConfig):
        config = system
    else:
        config = load_system(Path(system))
    # The file is read first: a device that is open for nothing stays busy.
    calibration = None if config.calibration is None else Calibration.load(config.calibration)
    devices = open_devices(config)
    return Scanner(devices.config, devices.projector, devices.camera, calibration or devices.camera.calibration)
