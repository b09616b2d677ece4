"""One call from light to shape: project, grab, decode.

>>> import quadfringe as qf
>>> with qf.open() as scanner:          # no system file: the virtual bench
...     shape = scanner.measure()
>>> shape.xyz_mm.shape
(768, 1024, 3)
"""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

from quadfringe.config import SystemConfig, load_system
from quadfringe.data import AnyShot, Calibration, Shape
from quadfringe.decoding import Plan, ShotDecoder
from quadfringe.devices import Camera, Projector
from quadfringe.devices.virtual import VirtualBench, VirtualCamera, VirtualProjector
from quadfringe.errors import ConfigError

__all__ = ["Scanner", "open_system"]


class Scanner:
    """A projector, a camera and a decoder that belong together; close it, or use it in a `with` block."""

    def __init__(self, config: SystemConfig, projector: Projector, camera: Camera, calibration: Calibration) -> None:
        self.config = config
        self.calibration = calibration
        self._projector = projector
        self._camera = camera
        self._decoder: ShotDecoder | None = None

    def grab(self) -> AnyShot:
        """Project the fringes and take one shot of them."""
        self._projector.show(self.config.fringes)
        return self._camera.grab()

    def decode(self, shot: AnyShot) -> Shape:
        """Give the shape of a shot of this system; raises `DecodeError` when none can be trusted."""
        if self._decoder is None:
            self._decoder = ShotDecoder(shot, self._plan())
        shape = self._decoder.decode(shot)
        resolved = self.config.model_dump(mode="json", exclude_none=True) | {"decode": shape.config["decode"]}
        return shape.with_settings(resolved, self.calibration)

    def measure(self) -> Shape:
        """Project, grab, decode: one exposure in, one metric shape out."""
        return self.decode(self.grab())

    def _plan(self) -> Plan:
        return Plan(
            projector_width_px=self.calibration.projector.width_px,
            fringes=self.config.fringes,
            calibration=self.calibration,
            settings=self.config.decode,
        )

    def close(self) -> None:
        """Release the devices."""
        self._camera.close()
        self._projector.close()

    def __enter__(self) -> Scanner:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def open_system(system: Path | str | SystemConfig | None = None) -> Scanner:
    """Open the system of a TOML file, of a config, or the virtual bench as it comes.

    Raises `ConfigError` when the file has unknown keys or wrong values, or names projectors of a real bench.
    """
    if system is None:
        config = SystemConfig()
    elif isinstance(system, SystemConfig):
        config = system
    else:
        config = load_system(Path(system))
    if config.projectors is not None:
        raise ConfigError(
            "projectors: the only camera is that of the virtual bench, which cannot see them; show the fringes with "
            "quadfringe.devices.open_projector or `quadfringe projector show --system FILE`, and decode the images"
        )
    bench = VirtualBench(config)
    calibration = bench.calibration() if config.calibration is None else Calibration.load(config.calibration)
    return Scanner(bench.resolved(config), VirtualProjector(bench, calibration), VirtualCamera(bench), calibration)
