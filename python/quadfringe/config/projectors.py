"""Settings of projectors: the table `[projectors]` of a system file.

>>> from quadfringe.config import HdmiRoute
>>> HdmiRoute(output="HDMI-1").frame_rate_hz
60.0
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from quadfringe.config._base import Model, NotNegative
from quadfringe.config.devices import Pixels
from quadfringe.config.fringes import Fringes

__all__ = ["AnyProjector", "FlashRoute", "HdmiProjectorConfig", "HdmiRoute", "ProjectorConfig", "ProjectorsConfig"]

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

    kind: Literal["lightcrafter"] = Field(default="lightcrafter", description="Kind of the projector.")
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


class HdmiProjectorConfig(Model):
    """Any projector that is a screen of the computer. It takes no commands and needs no synchronisation."""

    kind: Literal["hdmi"] = Field(default="hdmi", description="Kind of the projector.")
    size_px: tuple[Pixels, Pixels] = Field(
        description="Native resolution: columns and rows of its mirrors or liquid crystals, from its data sheet. The "
        "screen must have it, because any other image is scaled."
    )
    output: str | None = Field(
        default=None, description="Name of the screen, as `xrandr` lists it. Absent: the only one of that size."
    )
    frame_rate_hz: Annotated[float, Field(ge=1, le=240)] | None = Field(
        default=None, description="Frame rate in Hz. Absent: that of the screen."
    )
    settle_s: NotNegative = Field(
        default=0.2, description="Time in s after which a new image is on the surface: projectors lag by some frames."
    )
    match_exposure: bool = Field(
        default=False,
        description="Whether exposures of the camera are changed to the nearest whole number of frames of the "
        "projector. Otherwise a warning names it.",
    )


def _kind_of(value: Any) -> str | None:
    kind = value.get("kind", "lightcrafter") if isinstance(value, Mapping) else getattr(value, "kind", None)
    return f"({kind})" if kind in ("lightcrafter", "hdmi") else None


AnyProjector = Annotated[
    Annotated[ProjectorConfig, Tag("(lightcrafter)")] | Annotated[HdmiProjectorConfig, Tag("(hdmi)")],
    Discriminator(
        _kind_of,
        custom_error_type="projector",
        custom_error_message='expected a table whose kind is "lightcrafter", the default, or "hdmi"',
    ),
]


class ProjectorsConfig(Model):
    """The visible and the infrared projector. LightCrafters have equal serial numbers; the ports tell them apart."""

    kind: Literal["lightcrafter"] | None = Field(
        default=None, description="Kind of both, as older files state it; now each projector has a kind."
    )
    visible: AnyProjector = Field(description="The projector of red, green and blue.")
    infrared: AnyProjector | None = Field(
        default=None, description="The projector of infrared light. Absent: there is none, which needs kind hdmi."
    )

    @model_validator(mode="after")
    def _projectors_fit(self) -> ProjectorsConfig:
        visible, infrared = self.visible, self.infrared
        if isinstance(visible, HdmiProjectorConfig):
            if infrared is None:
                return self
            if not isinstance(infrared, HdmiProjectorConfig) or infrared.size_px != visible.size_px:
                raise ValueError(
                    "visible is of kind hdmi: expected infrared of the same kind and size, or none; a LightCrafter in "
                    "video mode is a screen of 912 x 1140, of that kind"
                )
            windows = [visible.output, infrared.output]
        else:
            if not isinstance(infrared, ProjectorConfig):
                raise ValueError(
                    "visible is of kind lightcrafter: expected infrared of the same kind; one projector alone, also a "
                    'LightCrafter in video mode, is of kind "hdmi"'
                )
            if visible.port == infrared.port:
                raise ValueError(f"visible and infrared are both at port {visible.port}")
            windows = [p.hdmi.output for p in (visible, infrared) if p.hdmi is not None]
        if len(windows) == 2 and (windows[0] is None or windows[0] == windows[1]):
            raise ValueError("expected an output for each projector, and two of them")
        return self

    @property
    def lightcrafters(self) -> tuple[ProjectorConfig, ProjectorConfig] | None:
        """The settings of both LightCrafters, visible and infrared; None for projectors of kind hdmi."""
        if isinstance(self.visible, ProjectorConfig) and isinstance(self.infrared, ProjectorConfig):
            return self.visible, self.infrared
        return None
