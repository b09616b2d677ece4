"""The projectors of a real bench: LightCrafter 4500 projectors, with patterns from HDMI or flash memory.

`LightCrafter` is one projector with all its commands; `PatternProjector` shows fringes on one projector by either
route; `ProjectorPair` is the `Projector` of a scanner. All are context managers. Bad arguments raise ValueError; device
faults raise OSError (PermissionError, TimeoutError, ConnectionError, FileNotFoundError).

>>> from quadfringe.config import Fringes, HdmiRoute, ProjectorConfig
>>> from quadfringe.devices.lightcrafter import *
>>> file, rule = udev_rule()  # for a projector that is not yours to open
>>> SIZE_PX, "0451" in rule
((912, 1140), True)
>>> files, places = pack_flash([(np.zeros((1140, 912), np.uint8), 8)])  # BMP files for TI's program
>>> len(files), len(places)
(1, 1)
>>> pattern = Pattern(0, 8, "rgb", trigger="rising")
>>> sequence = PatternSequence([pattern], [(8333, 8333)], trigger_mode="video-sync", frame_rate_hz=60.0)
>>> config = ProjectorConfig(port="1-1", hdmi=HdmiRoute())
>>> [one.port for one in lightcrafters()], [one.name for one in outputs(SIZE_PX)]  # doctest: +SKIP
(['1-1', '1-2'], ['HDMI-1'])
>>> with LightCrafter("1-1") as device:  # doctest: +SKIP
...     device.status()
>>> device = open_device(config)  # doctest: +SKIP
>>> with PatternProjector(config, colour=True) as projector:  # doctest: +SKIP
...     projector.show(Fringes(), image)
>>> with PatternWindow("HDMI-1", SIZE_PX) as window:  # doctest: +SKIP
...     window.show(image)
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Self

import numpy as np
from numpy.typing import NDArray

from quadfringe._core import (
    LightCrafter,
    Pattern,
    PatternSequence,
    PatternWindow,
    exposure_in_frame_us,
    lightcrafters,
    outputs,
    pack_flash,
    udev_rule,
)
from quadfringe.config import Fringes, HdmiRoute, ProjectorConfig, ProjectorsConfig
from quadfringe.data import Calibration
from quadfringe.devices.light import Light, light_images, predeformation
from quadfringe.errors import ConfigError

__all__ = [
    "SIZE_PX",
    "LightCrafter",
    "Pattern",
    "PatternProjector",
    "PatternSequence",
    "PatternWindow",
    "ProjectorPair",
    "lightcrafters",
    "open_device",
    "outputs",
    "pack_flash",
    "udev_rule",
]

# Facts of the LightCrafter 4500.
SIZE_PX = (912, 1140)  # columns and rows of the mirror array
FLASH_DEPTH = 8  # bits of a pattern in flash memory
FLASH_EXPOSURE_US = 8333  # shortest exposure of an 8-bit pattern
COLOURS = ("g", "r", "b")  # LED of each group of bit planes of a 24-bit image, in their order


class PatternProjector:
    """One LightCrafter 4500 that shows patterns from HDMI or flash; close it, or use it in a `with` block."""

    def __init__(self, config: ProjectorConfig, *, colour: bool) -> None:
        self.config = config
        self._colour = colour
        self._window: PatternWindow | None = None
        self._playing = False
        with ExitStack() as opened:
            self.device = opened.enter_context(open_device(config))
            _set_up(self.device, config)
            if config.hdmi is not None:
                # The window must exist first: HDMI data would switch a projector in pattern mode back to video mode.
                self._window = opened.enter_context(PatternWindow(config.hdmi.output))
            self._opened = opened.pop_all()

    def show(self, light: Light, image: NDArray[np.uint8]) -> None:
        """Show this light until the next call; `image` is its image, (1140, 912) or (1140, 912, 3) uint8.

        Raises ValueError when the patterns come from flash memory and it holds other fringes.
        """
        if self._window is not None:
            self._window.show(_as_colour(image))
        else:
            self._check_flash(light)
        if not self._playing:
            self.device.play(self._sequence())
            self._playing = True

    def _check_flash(self, light: Light) -> None:
        flash = self.config.flash
        assert flash is not None  # settings have either an HDMI or a flash route
        if flash.fringes != light:
            raise ValueError(
                f"projector at {self.device.port}: flash image {flash.image} holds fringes {_named(flash.fringes)}, "
                "not "
                f"{_named(light)}; write these to flash, or use hdmi"
            )
        self.device.check_flash(flash.image + 1, flash.firmware_tag)

    def _sequence(self) -> PatternSequence:
        config = self.config
        if config.hdmi is not None:
            depth, longest_us = _depth_and_exposure(3 if self._colour else 1, config.hdmi)
            return PatternSequence.from_video(
                self._patterns(depth), config.hdmi.frame_rate_hz, config.exposure_us or longest_us
            )
        assert config.flash is not None
        # The grey pattern lasts as long as the three colours of the other projector together.
        default_us = FLASH_EXPOSURE_US if self._colour else len(COLOURS) * FLASH_EXPOSURE_US
        return PatternSequence.from_flash(
            config.flash.image, self._patterns(FLASH_DEPTH), config.exposure_us or default_us
        )

    def _patterns(self, depth: int) -> list[Pattern]:
        if not self._colour:
            return [Pattern(0, depth, self.config.leds)]
        return [Pattern(number, depth, led) for number, led in enumerate(COLOURS)]

    def start(self) -> None:
        """Resume after a pause or a stop; after an error, `show` loads the patterns again."""
        playing, self._playing = self._playing, False
        self.device.start()
        self._playing = playing

    def pause(self) -> None:
        """Freeze the current pattern."""
        self.device.pause()

    def stop(self) -> None:
        """Show nothing."""
        self.device.stop()

    def release(self) -> None:
        """Release the projector without stopping it: it keeps showing the patterns in flash memory."""
        self._playing = False
        self.close()

    def close(self) -> None:
        """Stop showing and release projector and window; further calls do nothing."""
        with self._opened:
            if self._playing:
                self._playing = False
                self.device.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


class ProjectorPair:
    """The visible and the infrared projector as one `Projector`: shows the four fringe images of a shot.

    Pre-deformed fringes need the calibration of both projectors.

    >>> from quadfringe.devices.lightcrafter import ProjectorPair
    >>> with ProjectorPair(config.projectors) as pair:  # doctest: +SKIP
    ...     pair.show(config.fringes)
    """

    def __init__(self, config: ProjectorsConfig, calibration: Calibration | None = None) -> None:
        self._calibration = calibration
        both = config.lightcrafters
        if both is None:
            raise ConfigError("projectors: expected two LightCrafters, got the kind hdmi; open it with open_projector")
        with ExitStack() as opened:
            self.visible = opened.enter_context(PatternProjector(both[0], colour=True))
            self.infrared = opened.enter_context(PatternProjector(both[1], colour=False))
            self._opened = opened.pop_all()

    def __repr__(self) -> str:
        return f"ProjectorPair({self.visible.config.port}, {self.infrared.config.port})"

    def show(self, light: Light) -> None:
        """Show this light until the next call.

        Raises ValueError for fringe numbers that are ambiguous over the projector, for light that is not in flash
        memory (the light of a calibration needs HDMI), and for a pre-deformation without a calibration of both
        projectors.
        """
        deformed = predeformation(light, self._calibration) if isinstance(light, Fringes) else None
        visible, infrared = light_images(light, SIZE_PX, deformed)
        self.visible.show(light, visible)
        self.infrared.show(light, infrared)

    def start(self) -> None:
        """Resume after a pause or a stop."""
        self.visible.start()
        self.infrared.start()

    def pause(self) -> None:
        """Freeze the current patterns."""
        self.visible.pause()
        self.infrared.pause()

    def stop(self) -> None:
        """Show nothing; stops the second projector even when the first one fails."""
        with ExitStack() as other:
            other.callback(self.infrared.stop)
            self.visible.stop()

    def release(self) -> None:
        """Release both without stopping them: they keep showing the patterns in flash memory."""
        self.visible.release()
        self.infrared.release()

    def close(self) -> None:
        """Stop and release both, also when one fails; further calls do nothing."""
        self._opened.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def open_device(config: ProjectorConfig) -> LightCrafter:
    """Open the projector of these settings with its light engine; send it nothing."""
    return LightCrafter(
        config.port,
        light=config.light,
        drive_limit=config.led_drive_limit,
        current_inverted=config.led_current_inverted,
        trigger_invert_byte=config.trigger_invert_byte,
    )


def _set_up(device: LightCrafter, config: ProjectorConfig) -> None:
    device.wake()
    device.set_flips(config.flip_long_axis, config.flip_short_axis)
    if config.led_drive is not None:
        device.set_led_drive(config.led_drive)


def _depth_and_exposure(count: int, route: HdmiRoute) -> tuple[int, int]:
    """Return the depth, 8 or 7 bit, at which `count` patterns fit a frame, and the longest exposure of each, us."""
    try:
        return 8, exposure_in_frame_us(count, 8, route.frame_rate_hz)
    except ValueError:
        return 7, exposure_in_frame_us(count, 7, route.frame_rate_hz)


def _as_colour(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    if image.ndim == 2:
        image = np.repeat(image[:, :, np.newaxis], 3, axis=2)
    return np.ascontiguousarray(image)


def _named(fringes: Light) -> str:
    if not isinstance(fringes, Fringes):
        return "the light of a calibration"
    plane = "" if fringes.predeformed_z_mm is None else f", pre-deformed for {fringes.predeformed_z_mm:g} mm"
    return " ".join(f"{number:g}" for number in fringes.numbers) + f" ({fringes.layout}{plane})"
