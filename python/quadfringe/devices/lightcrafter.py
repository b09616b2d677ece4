"""The projectors of a real bench: LightCrafter 4500s, by HDMI or from flash, and the coaxial pair as one projector.

`LightCrafter` is one projector with all its commands; `PatternProjector` shows fringes on one, whichever way they reach
it; `CoaxialPair` is what a scanner asks for fringes. All of them are context managers. What the caller chose wrongly is
a ValueError; what a device did is an OSError (PermissionError, TimeoutError, ConnectionError, FileNotFoundError).
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

__all__ = [
    "SIZE_PX",
    "CoaxialPair",
    "LightCrafter",
    "Pattern",
    "PatternProjector",
    "PatternSequence",
    "PatternWindow",
    "lightcrafters",
    "open_device",
    "outputs",
    "pack_flash",
    "udev_rule",
]

SIZE_PX = (912, 1140)  # columns and rows of the mirror array
FLASH_DEPTH = 8
FLASH_EXPOSURE_US = 8333  # the shortest of 8 bit
COLOURS = ("g", "r", "b")  # in the order of the bit planes


class PatternProjector:
    """One LightCrafter 4500 that shows fringes by the route of its settings; close it, or use it in a `with` block."""

    def __init__(self, config: ProjectorConfig, *, colour: bool) -> None:
        self.config = config
        self._colour = colour
        self._window: PatternWindow | None = None
        self._playing = False
        with ExitStack() as opened:
            self.device = opened.enter_context(open_device(config))
            _set_up(self.device, config)
            if config.hdmi is not None:
                # HDMI data would take a projector that shows patterns back to video: the window comes first.
                self._window = opened.enter_context(PatternWindow(config.hdmi.output))
            self._opened = opened.pop_all()

    def show(self, light: Light, image: NDArray[np.uint8]) -> None:
        """Show this light, whose image is (1140, 912) or (1140, 912, 3) uint8, until told otherwise.

        From flash it must be the fringes that are in it: ValueError otherwise.
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
        assert flash is not None  # one of the two routes is there
        if flash.fringes != light:
            raise ValueError(
                f"projector at {self.device.port}: flash image {flash.image} has fringes "
                f"{_named(flash.fringes)}, asked for {_named(light)}; write them to flash, or use hdmi"
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
        # A grey pattern is shown for as long as the three colours of its neighbour.
        default_us = FLASH_EXPOSURE_US if self._colour else len(COLOURS) * FLASH_EXPOSURE_US
        return PatternSequence.from_flash(
            config.flash.image, self._patterns(FLASH_DEPTH), config.exposure_us or default_us
        )

    def _patterns(self, depth: int) -> list[Pattern]:
        if not self._colour:
            return [Pattern(0, depth, self.config.leds)]
        return [Pattern(number, depth, led) for number, led in enumerate(COLOURS)]

    def start(self) -> None:
        """Go on after a pause or a stop; after an error, `show` loads the patterns again."""
        playing, self._playing = self._playing, False
        self.device.start()
        self._playing = playing

    def pause(self) -> None:
        """Hold the current pattern."""
        self.device.pause()

    def stop(self) -> None:
        """Show nothing."""
        self.device.stop()

    def release(self) -> None:
        """Release the projector, which goes on showing what is in flash."""
        self._playing = False
        self.close()

    def close(self) -> None:
        """Stop showing and release projector and window; closing twice is allowed."""
        with self._opened:
            if self._playing:
                self._playing = False
                self.device.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


class CoaxialPair:
    """The visible and the infrared projector as one: shows the four fringe images of a shot.

    Pre-deformed fringes need the calibration of both.

    >>> from quadfringe.devices.lightcrafter import CoaxialPair
    >>> with CoaxialPair(config.projectors) as pair:  # doctest: +SKIP
    ...     pair.show(config.fringes)
    """

    def __init__(self, config: ProjectorsConfig, calibration: Calibration | None = None) -> None:
        self._calibration = calibration
        with ExitStack() as opened:
            self.visible = opened.enter_context(PatternProjector(config.visible, colour=True))
            self.infrared = opened.enter_context(PatternProjector(config.infrared, colour=False))
            self._opened = opened.pop_all()

    def show(self, light: Light) -> None:
        """Show this light until told otherwise.

        ValueError for fringes that cannot number the field, are not in flash, or are pre-deformed while the calibration
        does not know both projectors. The light of a calibration needs HDMI.
        """
        deformed = predeformation(light, self._calibration) if isinstance(light, Fringes) else None
        visible, infrared = light_images(light, SIZE_PX, deformed)
        self.visible.show(light, visible)
        self.infrared.show(light, infrared)

    def start(self) -> None:
        """Go on after a pause or a stop."""
        self.visible.start()
        self.infrared.start()

    def pause(self) -> None:
        """Hold the current patterns."""
        self.visible.pause()
        self.infrared.pause()

    def stop(self) -> None:
        """Show nothing, also on the other one when one fails."""
        with ExitStack() as other:
            other.callback(self.infrared.stop)
            self.visible.stop()

    def release(self) -> None:
        """Release both, which go on showing what is in flash."""
        self.visible.release()
        self.infrared.release()

    def close(self) -> None:
        """Stop and release both, also when one fails; closing twice is allowed."""
        self._opened.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.close()


def open_device(config: ProjectorConfig) -> LightCrafter:
    """Open the projector of these settings, with its light engine; nothing is sent."""
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
    """Give the most bits that `count` patterns in a frame may have, 8 or 7, and the exposure of each in us."""
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
