"""One call from light to shape: project, grab, decode.

>>> import quadfringe as qf
>>> with qf.open() as scanner:          # no system file: the virtual bench
...     shape = scanner.measure()
>>> shape.xyz_mm.shape
(768, 1024, 3)
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from quadfringe.config import (
    DecodeConfig,
    HdmiProjectorConfig,
    ResponseChoice,
    SystemConfig,
    brief,
    check_system,
    load_system,
    shortened,
)
from quadfringe.data import AnyShot, Calibration, ResponseCalibration, Shape
from quadfringe.decoding import Decoder, Plan
from quadfringe.decoding.plan import calibration_of, stated_response
from quadfringe.devices import Camera, Keep, Projector, open_devices
from quadfringe.devices.region import check_region
from quadfringe.errors import DecodeError, InputError
from quadfringe.io.locks import ForkedLock
from quadfringe.scanner.reference import REFERENCE_STEPS, Beam, measure_reference
from quadfringe.scanner.streaming import LiveStream, Tap

__all__ = ["Scanner", "open_system"]

LIGHTCRAFTER_COLUMNS = 912  # projector columns that fringes cover if neither calibration nor system file say otherwise
SETTLING_SHOTS = 64  # most shots that are decoded to estimate a response; a refused shot costs some 14 decodes


class Scanner:
    """A projector, a camera and a decoder that belong together; close it, or use it in a `with` block.

    `config` holds the settings, with those that the devices added. `calibration`, a `Calibration` or the path of its
    file, turns shots into millimetres; without one it is None, and shapes hold phase only. `plan` is what shots are
    decoded with. Raises `InputError` for a calibration or a response that cannot be read.
    """

    def __init__(
        self,
        config: SystemConfig,
        projector: Projector,
        camera: Camera,
        calibration: Calibration | Path | str | None = None,
    ) -> None:
        check_system(config)
        self.calibration = calibration_of(calibration)
        self.projector = projector
        self.camera = camera
        self._planning = ForkedLock()
        self._live: LiveStream | None = None
        self._use(config)

    def __repr__(self) -> str:
        known = "uncalibrated" if self.calibration is None else "calibrated"
        return shortened(f"Scanner({self.camera!r}, {self.projector!r}, {known})")

    @property
    def projector_width_px(self) -> int:
        """Projector columns that the fringes cover: those of the calibration, else of the system file, else 912."""
        projector = self.config.projector if self.calibration is None else self.calibration.projector
        if projector is not None:
            return projector.width_px
        visible = None if self.config.projectors is None else self.config.projectors.visible
        return visible.size_px[0] if isinstance(visible, HdmiProjectorConfig) else LIGHTCRAFTER_COLUMNS

    @property
    def response(self) -> ResponseChoice:
        """The response that is corrected, as in `Decoder.response`; "auto" until a sound shot was decoded."""
        if self._decoder is not None:
            return self._decoder.response
        return stated_response(self.plan.response, self.plan.calibration)

    def change_decode(self, **settings: Any) -> None:
        """Change settings of `DecodeConfig` from the next shot on; raises `ConfigError` for wrong ones.

        >>> import quadfringe as qf
        >>> with qf.open() as scanner:
        ...     scanner.change_decode(method="published")
        ...     shape = scanner.measure()
        >>> shape.config["decode"]["method"]
        'published'
        """
        decode = self.config.decode
        given = {name: getattr(decode, name) for name in decode.model_fields_set} | settings
        self._use(self.config.model_copy(update={"decode": DecodeConfig(**given)}))

    def _use(self, config: SystemConfig) -> None:
        """Decode with the settings of `config`; the decoder is planned with the next shot."""
        with self._planning:
            self.config = config
            self.plan = Plan(self.projector_width_px, config.fringes, self.calibration, decode=config.decode)
            self._settings = config.model_dump(mode="json", exclude_none=True, exclude={"decode"})
            self._decoder: Decoder | None = None

    def grab(self) -> AnyShot:
        """Project the fringes and take one shot of them."""
        self.projector.show(self.config.fringes)
        return self.camera.snap()

    def decode(self, shot: AnyShot) -> Shape:
        """Give the shape of a shot of this system; raises `DecodeError` when it cannot be trusted.

        All shots are decoded by one `Decoder`, so that a response that is not given is estimated once and then held.
        Threads may call this at the same time.
        """
        shape = self._decoder_for(shot).decode(shot)
        return replace(shape, config=self._settings | dict(shape.config))

    def settle_response(self, shots: Iterable[AnyShot]) -> ResponseChoice:
        """Estimate the response from the first sound ones of these shots, in their order, unless it is known.

        Gives the value that `decode.response` of the settings must have for the same result in another process: "auto"
        if the calibration holds the response. At most 64 shots are decoded; if none of them is sound, the result is
        "linear".
        """
        if stated_response(self.plan.response, self.plan.calibration) != "auto":
            return self.plan.response
        for shot in islice(shots, SETTLING_SHOTS):
            with suppress(DecodeError):
                self.decode(shot)
            if self.response != "auto":
                return self.response
        return "linear"

    def measure(self, *, reference: bool = False, steps: int = REFERENCE_STEPS, infrared: bool = False) -> Shape:
        """Project, grab, decode: one exposure in, one metric shape out.

        With `reference`, the projector shows `steps` phase shifts of each of the fringe numbers, and all images give
        one shape: the criterion for single shots, for objects that keep still. `infrared` measures with the infrared
        projector and chip. Raises `ConfigError` or ValueError when the projector cannot show single steps.
        """
        if not reference:
            return self.decode(self.grab())
        self._end_stream()
        beam: Beam = "infrared" if infrared else "visible"
        shape = measure_reference(self.projector, self.camera, self.plan, steps, beam)
        return replace(shape, config=self._settings | dict(shape.config))

    def stream(
        self,
        count: int | None = None,
        *,
        keep: Keep = "latest",
        taps: Mapping[str, Tap] | None = None,
        resume: bool = False,
    ) -> LiveStream:
        """Measure continuously: `count` shots, or until the stream is closed.

        Capture, decoding and the caller run at different speeds. With keep="latest" the caller gets the newest shape;
        "all" lets up to 64 shots wait. Both drop the oldest shot when they must, and count it. `taps` get every
        captured shot, each in its thread: a recorder, for example; 64 shots wait for a slow one. With `resume` a camera
        that fails is tried again until the stream is closed; otherwise its `CameraError` ends the stream. A second
        stream ends the first.

        >>> import quadfringe as qf
        >>> camera = qf.Device(width_px=512, height_px=384, focal_px=(1290, 1290), centre_px=(255.5, 191.5))
        >>> with qf.open(qf.SystemConfig(camera=camera)) as scanner, scanner.stream(2, keep="all") as stream:
        ...     depths = [measured.result().depth_mm for measured in stream]
        >>> len(depths)
        2
        """
        self._end_stream()
        self.projector.show(self.config.fringes)
        # The published method leaves cores idle between its rows and the next shot. The joint method keeps all of them
        # busy, so that two shots at once would only come later.
        at_once = 2 if self.config.decode.method == "published" else 1
        self._live = LiveStream(
            self.camera,
            self.decode,
            count,
            keep=keep,
            taps=taps,
            resume=resume,
            at_once=at_once,
            response=lambda: self.response,
        )
        return self._live

    def _end_stream(self) -> None:
        if self._live is not None:
            self._live.close()
            self._live = None

    def _decoder_for(self, shot: AnyShot) -> Decoder:
        with self._planning:
            if self._decoder is None:
                self._decoder = Decoder(shot, self.plan)
        return self._decoder

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
    """Open the system of a TOML file, of a folder with system.toml, or of a config; without any, the virtual bench.

    Raises `ConfigError` when the file has unknown keys or wrong values, or names devices that cannot be combined;
    `InputError` when a file cannot be read, or the camera sends another region of its chip than was calibrated; OSError
    when a device cannot be opened.
    """
    if system is None:
        config = SystemConfig()
    elif isinstance(system, SystemConfig):
        config = system
    elif isinstance(system, (str, Path)):
        config = load_system(system)
    else:
        raise InputError(f"expected a system file (.toml), its folder, or a SystemConfig, got {brief(system)}")
    # All files are read before a device is opened: a device that an error leaves open stays busy.
    calibration = None if config.calibration is None else Calibration.load(config.calibration)
    devices = open_devices(_with_response_read(config))
    try:
        known = calibration or devices.camera.calibration
        check_region(known, devices.offset_px)
        return Scanner(devices.config, devices.projector, devices.camera, known)
    except InputError:
        devices.camera.close()
        devices.projector.close()
        raise


def _with_response_read(config: SystemConfig) -> SystemConfig:
    """Put the response in place of the name of its file, so that recordings and results hold it."""
    if not isinstance(config.decode.response, Path):
        return config
    decode = config.decode.model_copy(update={"response": ResponseCalibration.load(config.decode.response)})
    return config.model_copy(update={"decode": decode})
