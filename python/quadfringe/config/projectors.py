"""Settings of projectors: the table `[projectors]` of a system file.

>>> from quadfringe.config import HdmiRoute
>>> HdmiRoute(output="HDMI-1").frame_rate_hz
60.0
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from quadfringe.config._base import Model
from quadfringe.config.fringes import Fringes

__all__ = ["FlashRoute", "HdmiRoute", "ProjectorConfig", "ProjectorsConfig"]

Byte = Annotated[int, Field(ge=0, le=255)]
Drive = tuple[Byte, Byte, Byte]
Microseconds = Annotated[int, Field(gt=0, le=200_000_000)]


class HdmiRoute(Model):
    """Patterns by HDMI, from an output of the computer with 912 x 1140 pixels."""

    output: str | None = Field(
        default=None, description="Name of the output, as `xrandr` lists it. Absent: the only one of that size."
    )
    frame_rate_hz: Annotated[float, Field(ge=1, le=240)] = Field(default=60.0, description="Frame rate in Hz.")


class FlashRoute(Model):
    """Patterns from the flash memory of the projector."""

    image: Byte = Field(description="Number of the image in flash.")
    fringes: Fringes = Field(description="Fringes of that image.")
    firmware_tag: str | None = Field(default=None, description="Tag that the firmware must have. Absent: any.")


class ProjectorConfig(Model):
    """One LightCrafter 4500: where it is plugged in, and how patterns reach it (`hdmi` or `flash`)."""

    port: Annotated[str, Field(pattern=r"^\d{1,3}-\d{1,3}(\.\d{1,3})*$")] = Field(
        description="USB bus and port path, such as 1-2 (`quadfringe projector list`)."
    )
    hdmi: HdmiRoute | None = Field(default=None, description="Patterns by HDMI.")
    flash: FlashRoute | None = Field(default=None, description="Patterns from flash.")
    light: Literal["evm", "external"] = Field(
        default="evm", description='"evm" is the light engine of TI; "external" is another, with other limits.'
    )
    leds: Literal["r", "g", "b", "rg", "rb", "gb", "rgb"] = Field(
        default="rgb", description="LEDs that light a grey pattern; a colour pattern has one LED for each colour."
    )
    led_drive: Drive | None = Field(
        default=None, description="Current of red, green, blue, 0 (off) to 255. Absent: as after power-on."
    )
    led_drive_limit: Drive | None = Field(
        default=None, description="Largest safe drive; needed beyond power-on values and for external light."
    )
    led_current_inverted: bool = Field(
        default=True, description="False if 255 in the register is full current, which depends on the light engine."
    )
    exposure_us: Microseconds | None = Field(
        default=None,
        description="Exposure in us. Absent: as long as the frame allows; from flash, the shortest for 8 bit.",
    )
    trigger_invert_byte: Literal[1, 2] = Field(
        default=1, description="Byte of the trigger message that inverts the output; firmware versions differ."
    )
    flip_long_axis: bool = Field(default=False, description="Mirror the image along its long axis.")
    flip_short_axis: bool = Field(default=False, description="Mirror the image along its short axis.")

    @model_validator(mode="after")
    def _one_route(self) -> ProjectorConfig:
        if (self.hdmi is None) == (self.flash is None):
            raise ValueError("expected hdmi or flash, and one of them")
        return self

    @model_validator(mode="after")
    def _drive_within_a_limit(self) -> ProjectorConfig:
        if self.light == "external" and self.led_drive is not None and self.led_drive_limit is None:
            raise ValueError("led_drive needs led_drive_limit: the safe currents of an external light are not known")
        return self


class ProjectorsConfig(Model):
    """The visible and the infrared projector. Their serial numbers are equal, so the ports tell them apart."""

    kind: Literal["lightcrafter"] = Field(default="lightcrafter", description="Kind of the projectors.")
    visible: ProjectorConfig = Field(description="The projector of red, green and blue.")
    infrared: ProjectorConfig = Field(description="The projector of infrared light.")

    @model_validator(mode="after")
    def _two_projectors(self) -> ProjectorsConfig:
        if self.visible.port == self.infrared.port:
            raise ValueError(f"visible and infrared are both at port {self.visible.port}")
        windows = [p.hdmi for p in (self.visible, self.infrared) if p.hdmi is not None]
        if len(windows) == 2 and (windows[0].output is None or windows[0].output == windows[1].output):
            raise ValueError("expected an output for each projector, and two of them")
        return self
