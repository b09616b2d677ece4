"""Any projector that is a screen of the computer: a window of its native size shows the patterns.

>>> from quadfringe.devices import open_projector
>>> with open_projector(config) as projector:  # doctest: +SKIP
...     projector.show(config.fringes)
>>> from quadfringe.config import Fringes, HdmiProjectorConfig, ProjectorsConfig
>>> from quadfringe.devices.hdmi import *
>>> settings = ProjectorsConfig(visible=HdmiProjectorConfig(size_px=(1280, 720)))
>>> with HdmiProjectors(settings) as projector:  # doctest: +SKIP
...     projector.show(Fringes(encoding="rgb"))
>>> len(PICTURE_MODES) > 3  # what to switch off by hand
True
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import Self

import numpy as np
from numpy.typing import NDArray

from quadfringe._core import PatternWindow
from quadfringe.config import Fringes, HdmiProjectorConfig, ProjectorsConfig
from quadfringe.data import Calibration
from quadfringe.devices.light import Light, Step, light_images, predeformation
from quadfringe.errors import ConfigError

__all__ = ["PICTURE_MODES", "HdmiProjectors"]

# What projectors for films and slides do to an image, and the programs of cameras too. No program can read these
# settings, so that commands list them.
PICTURE_MODES = (
    "keystone correction, digital zoom and overscan off: they scale the image, which destroys fine fringes",
    "dynamic contrast, auto iris, eco and automatic lamp power off: they change the brightness with the image",
    "sharpness at its least, noise reduction, motion smoothing and colour enhancement off: they change the fringes",
    "picture mode sRGB, standard or user, not vivid or film; then leave it, because the response belongs to it",
    "screen saver and power saving of the computer off; no scaling of the desktop on this screen",
    "camera: whole frames of the projector, such as 16.7 or 33.3 ms at 60 Hz; gain, white balance and focus fixed",
)


class HdmiProjectors:
    """One projector of three colours, or two with infrared, as one `Projector`; close it, or use it in a `with` block.

    `show` returns when a new image is on the surface (`settle_s`); nothing synchronises camera and projector, because
    the image stands still. Raises ValueError when the screen is absent, of another size, scaled or rotated, and
    OSError without a display.
    """

    def __init__(self, config: ProjectorsConfig, calibration: Calibration | None = None) -> None:
        self._calibration = calibration
        self._shown: Light | None = None
        self._settings: dict[str, HdmiProjectorConfig] = {}
        for beam in ("visible", "infrared"):
            one = getattr(config, beam)
            if isinstance(one, HdmiProjectorConfig):
                self._settings[beam] = one
        if "visible" not in self._settings:
            raise ConfigError('projectors: expected projectors of kind "hdmi", got LightCrafters; use open_projector')
        with ExitStack() as opened:
            self._windows = {
                beam: opened.enter_context(PatternWindow(one.output, one.size_px))
                for beam, one in self._settings.items()
            }
            self._opened = opened.pop_all()

    def __repr__(self) -> str:
        screens = ", ".join(f"{beam} {window.output}" for beam, window in self._windows.items())
        return f"HdmiProjectors({screens})"

    @property
    def size_px(self) -> tuple[int, int]:
        """Columns and rows of each projector."""
        return self._settings["visible"].size_px

    def show(self, light: Light) -> None:
        """Show this light until the next call; return when it is on the surface.

        Raises ValueError for fringe numbers that are ambiguous over the projector, `ConfigError` for a step of an
        infrared projector that there is not, and `InputError` for a pre-deformation without its calibration.
        """
        if isinstance(light, Step) and light.beam not in self._windows:
            raise ConfigError(f"this system has no {light.beam} projector; name it under [projectors.{light.beam}]")
        if light == self._shown:
            return
        deformed = predeformation(light, self._calibration) if isinstance(light, Fringes) else None
        visible, infrared = light_images(light, self.size_px, deformed)
        for beam, image in (("visible", visible), ("infrared", infrared)):
            if beam in self._windows:
                self._windows[beam].show(_as_colour(image))
        self._shown = light
        time.sleep(max(one.settle_s for one in self._settings.values()))

    def close(self) -> None:
        """Close the windows, so that the screens show the desktop again; further calls do nothing."""
        self._opened.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def _as_colour(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    if image.ndim == 2:
        image = np.repeat(image[:, :, np.newaxis], 3, axis=2)
    return np.ascontiguousarray(image)
