"""The projector and the camera of the virtual bench, which share one simulated world."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count as numbers
from typing import Self

from quadfringe.config import Fringes, SystemConfig
from quadfringe.config.cameras import VirtualConfig
from quadfringe.data import AnyShot, Calibration, Stamp
from quadfringe.data.host_clock import HOST_CLOCK
from quadfringe.devices import CameraStatistics, Devices, Keep
from quadfringe.devices.light import Levels, Light, Step
from quadfringe.devices.virtual._bench import VirtualBench
from quadfringe.errors import ConfigError

__all__ = ["VirtualCamera", "VirtualProjector", "open_devices"]


class VirtualProjector:
    """The projectors of the virtual bench."""

    def __init__(self, bench: VirtualBench, calibration: Calibration | None = None) -> None:
        self._bench = bench
        self._calibration = calibration

    def __repr__(self) -> str:
        width, height = self._bench.projector_size_px
        return f"VirtualProjector({width} x {height})"

    def show(self, light: Light) -> None:
        """Project this light; raises ValueError for fringe numbers that are ambiguous over the projector width."""
        if isinstance(light, Fringes):
            self._bench.project(light, self._calibration)
        elif isinstance(light, Levels):
            self._bench.project_levels(light.levels)
        else:
            self._bench.project_step(light)

    def close(self) -> None:
        """Switch the light off."""
        self._bench.projected = None


class VirtualCamera:
    """The camera of the virtual bench; its shots carry the truth.

    With a frame rate, the scene advances by one frame period from shot to shot and each shot has new noise; each step
    of an N-step capture has new noise too. A shot is rendered when it is requested, so none is ever dropped.
    """

    name = "virtual bench"
    paced = False

    def __init__(self, bench: VirtualBench, settings: VirtualConfig | None = None) -> None:
        self._bench = bench
        self._rate_hz = (settings or VirtualConfig()).frame_rate_hz
        self._exposures = 0
        self._closed = self._interrupted = False

    def __repr__(self) -> str:
        width, height = self._bench.camera_size_px
        return f"VirtualCamera({width} x {height})"

    @property
    def bench(self) -> VirtualBench:
        """The simulated world in front of this camera."""
        return self._bench

    @property
    def calibration(self) -> Calibration:
        """The exact calibration of the bench."""
        return self._bench.calibration()

    def snap(self, timeout_s: float | None = None) -> AnyShot:  # noqa: ARG002 - rendering always ends
        """Render one shot of the bench."""
        with HOST_CLOCK.held():
            return self._expose()

    def stream(self, count: int | None = None, *, keep: Keep = "latest") -> Iterator[AnyShot]:  # noqa: ARG002
        """Render one shot after the other."""
        self._check_open()
        self._interrupted = False
        with HOST_CLOCK.held():
            for _ in numbers() if count is None else range(count):
                if self._interrupted:
                    return
                yield self._expose()

    def interrupt(self) -> None:
        """End a stream before its next shot."""
        self._interrupted = True

    def _expose(self) -> AnyShot:
        self._check_open()
        exposure = self._exposures if self._rate_hz else 0
        # Steps are combined to one measurement, in which equal noise would cancel.
        seed = self._bench.seed(self._exposures if isinstance(self._bench.projected, Step) else exposure)
        shot = self._bench.expose(exposure / self._rate_hz if self._rate_hz else 0.0, seed=seed)
        self._exposures += 1
        return replace(shot, stamp=Stamp(self._exposures, HOST_CLOCK.now_ns() // 1000, self.name))

    def _check_open(self) -> None:
        if self._closed:
            raise ValueError(f"the camera of the {self.name} is closed")

    def statistics(self) -> CameraStatistics:
        """Return the number of shots; none is ever lost."""
        return CameraStatistics(shots=self._exposures)

    def close(self) -> None:
        """Take no more shots."""
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def open_devices(config: SystemConfig) -> Devices:
    """Build a virtual bench from these settings; raises `ConfigError` when they name real projectors."""
    if config.projectors is not None:
        raise ConfigError(
            "projectors: the virtual camera cannot see real projectors; name a real camera, such as "
            'capture = "aravis:AD-080GE", or only show the fringes: quadfringe projector show --system FILE'
        )
    bench = VirtualBench(config)
    settings = config.capture if isinstance(config.capture, VirtualConfig) else None
    known = None if config.calibration is None else Calibration.load(config.calibration)
    return Devices(VirtualCamera(bench, settings), VirtualProjector(bench, known), bench.resolved(config))
