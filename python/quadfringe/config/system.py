"""The one place for settings: frozen models with units in their names; a key that is not known is an error.

A system file is TOML. Every table may be left out; an algorithm setting that is left out takes the
kernel's own default, which is written once, in Rust.

>>> from quadfringe.config import SystemConfig
>>> SystemConfig().fringes.numbers
(36.0, 35.0, 30.0)
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from quadfringe.config._base import Finite, Model, NotNegative, Positive, checked
from quadfringe.config.cameras import AnyCapture, ReplayConfig, VirtualConfig
from quadfringe.errors import ConfigError
from quadfringe.files import read_bytes

__all__ = [
    "BayerPattern",
    "ChannelResponse",
    "DecodeConfig",
    "Device",
    "FlashRoute",
    "Fringes",
    "HdmiRoute",
    "HeightMapConfig",
    "Model",
    "ProjectorConfig",
    "ProjectorsConfig",
    "Response",
    "SceneConfig",
    "SystemConfig",
    "checked",
    "load_system",
]

Pixels = Annotated[int, Field(gt=0, le=65536)]
Triple = tuple[Finite, Finite, Finite]
Matrix3 = tuple[Triple, Triple, Triple]
Row4 = tuple[Finite, Finite, Finite, Finite]
Matrix4 = tuple[Row4, Row4, Row4, Row4]
PerChannel = Annotated[Row4, BeforeValidator(lambda v: (v,) * 4 if isinstance(v, (int, float)) else v)]
Affine = tuple[Triple, Triple]
BayerPattern = Literal["rggb", "grbg", "gbrg", "bggr"]
IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Device(Model):
    """A pinhole device, camera or projector: P_device = rotation P_camera + translation_mm, then the lens (S8).

    Distortion is OpenCV's k1, k2, p1, p2, k3; pixel centres are at integers.
    """

    width_px: Pixels
    height_px: Pixels
    focal_px: tuple[Positive, Positive]
    centre_px: tuple[Finite, Finite]
    distortion: tuple[Finite, Finite, Finite, Finite, Finite] = (0.0, 0.0, 0.0, 0.0, 0.0)
    rotation: Matrix3 = IDENTITY
    translation_mm: Triple = (0.0, 0.0, 0.0)


class ChannelResponse(Model):
    """Inverse response of one channel: linear = max(I / (1 - knee I^20) - offset, 0) ^ exponent.

    I is the captured intensity as a fraction of full scale; the knee is the compression of highlights.
    """

    offset: NotNegative = 0.0
    exponent: Positive = 1.0
    knee: NotNegative = 0.0


class Response(Model):
    """Responses of the four channels; a channel that is left out is linear."""

    red: ChannelResponse = ChannelResponse()
    green: ChannelResponse = ChannelResponse()
    blue: ChannelResponse = ChannelResponse()
    ir: ChannelResponse = ChannelResponse()

    def rows(self) -> list[tuple[float, float, float]]:
        """Offset, exponent and knee of R, G, B, IR."""
        return [(c.offset, c.exponent, c.knee) for c in (self.red, self.green, self.blue, self.ir)]


class Fringes(Model):
    """Fringe numbers over the full projector width: red and blue, green, infrared. The kernel checks them.

    With `predeformed_z_mm` the infrared image is pre-deformed, from the calibration of both projectors, so that it lies
    right on the plane at this depth (S11).
    """

    numbers: tuple[float, float, float] = (36.0, 35.0, 30.0)
    layout: Literal["regular", "diamond"] = "regular"
    predeformed_z_mm: Positive | None = None


class HeightMapConfig(Model):
    """A relief of your own: an NPY file of heights in mm over a plane, towards the camera; rows along y."""

    file: Path
    pitch_mm: tuple[Positive, Positive]
    origin_mm: tuple[Finite, Finite]
    z_mm: Positive = 800.0


class SceneConfig(Model):
    """What stands on the virtual bench, and what the bench adds to the light (shares of full scale).

    A setting for each channel (R, G, B, IR) may be one number for all four. What is absent is ideal, or takes
    the kernel's default. With `bayer` the visible chip sees one colour at each pixel and delivers a raw mosaic;
    with `demosaic` too, the camera makes three planes of it, as most cameras do.
    """

    surface: str = "face"
    height_map: HeightMapConfig | None = None
    time_s: Finite | None = None
    albedo: PerChannel | None = None
    patch_mm: Positive | None = None
    ambient: PerChannel | None = None
    shading: bool | None = None
    projector_exponent: PerChannel | None = None
    crosstalk: Matrix4 | None = None
    gain: PerChannel | None = None
    blur_px: NotNegative | None = None
    infrared_from_visible: Affine | None = None
    noise: NotNegative | None = None
    camera_offset: PerChannel | None = None
    camera_exponent: PerChannel | None = None
    bayer: BayerPattern | None = None
    demosaic: Literal["bilinear"] | None = None
    bit_depth: Literal[8, 10, 12, 16] = 8
    seed: Annotated[int, Field(ge=0)] | None = None


Byte = Annotated[int, Field(ge=0, le=255)]
Drive = tuple[Byte, Byte, Byte]
Microseconds = Annotated[int, Field(gt=0, le=200_000_000)]


class HdmiRoute(Model):
    """Patterns by HDMI: the output of the computer (as `xrandr` names it) that feeds the projector, at 912 x 1140.

    Without an output, the only one of that size is taken.
    """

    output: str | None = None
    frame_rate_hz: Annotated[float, Field(ge=1, le=240)] = 60.0


class FlashRoute(Model):
    """Patterns from flash: the number of the image, and the fringes that are in it."""

    image: Byte
    fringes: Fringes
    firmware_tag: str | None = None


class ProjectorConfig(Model):
    """One LightCrafter 4500: where it is plugged in (bus and port path, such as 1-2), and how patterns reach it.

    `leds` light a grey pattern; a colour pattern has a LED for each colour. Drives are red, green, blue from 0 (off)
    to 255; beyond those of TI's light engine after power-on, or with another one (`light = "external"`), the limit must
    be stated, and `led_current_inverted` set to false where 255 in the register is full current. An absent drive stays
    as it is after power-on; an absent exposure is as long as the frame allows, and from flash as short as 8 bit allow.
    """

    port: Annotated[str, Field(pattern=r"^\d{1,3}-\d{1,3}(\.\d{1,3})*$")]
    hdmi: HdmiRoute | None = None
    flash: FlashRoute | None = None
    light: Literal["evm", "external"] = "evm"
    leds: Literal["r", "g", "b", "rg", "rb", "gb", "rgb"] = "rgb"
    led_drive: Drive | None = None
    led_drive_limit: Drive | None = None
    led_current_inverted: bool = True
    exposure_us: Microseconds | None = None
    trigger_invert_byte: Literal[1, 2] = 1
    flip_long_axis: bool = False
    flip_short_axis: bool = False

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
    """The coaxial pair: both projectors have one serial number, so they are told apart by their ports."""

    kind: Literal["lightcrafter"] = "lightcrafter"
    visible: ProjectorConfig
    infrared: ProjectorConfig

    @model_validator(mode="after")
    def _two_projectors(self) -> ProjectorsConfig:
        if self.visible.port == self.infrared.port:
            raise ValueError(f"visible and infrared are both at port {self.visible.port}")
        windows = [p.hdmi for p in (self.visible, self.infrared) if p.hdmi is not None]
        if len(windows) == 2 and (windows[0].output is None or windows[0].output == windows[1].output):
            raise ValueError("expected an output for each projector, and two of them")
        return self


class DecodeConfig(Model):
    """Settings of the decoder; what is absent takes the kernel's default.

    `channel_instants_us` are the instants at which R, G, B and IR are seen, from the one that the shape stands for: a
    projector that shows its colours one after another needs them when the surface moves. Method "joint" alone has it.
    `unwrapping` says what the infrared light is taken for: "coaxial" with the visible (as published, and when absent),
    or where the calibrated "pair" really puts it, so that the order is searched along the camera ray of each pixel,
    at depths within `depth_range_mm` (nearest, farthest) when given.
    """

    method: Literal["published", "joint", "best"] | None = None
    unwrapping: Literal["coaxial", "pair"] | None = None
    depth_range_mm: tuple[NotNegative, Positive] | None = None
    modulation_min: NotNegative | None = None
    quality_min: NotNegative | None = None
    channel_instants_us: Row4 | None = None
    threads: Annotated[int, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _range_is_searched(self) -> DecodeConfig:
        if self.depth_range_mm is not None and self.unwrapping != "pair":
            raise ValueError('depth_range_mm needs unwrapping = "pair", which searches depths')
        return self


class SystemConfig(Model):
    """A whole system: devices, fringes, what is measured, how it is decoded.

    `capture` says which camera takes the shots; without it the virtual bench does. Devices that are absent are those
    of the published bench; `infrared` is coaxial with `projector` when absent. Without `projectors` the virtual bench
    lights its own camera, and every other camera sees what is there.
    """

    schema_version: Literal[1] = 1
    capture: AnyCapture = VirtualConfig()
    camera: Device | None = None
    projector: Device | None = None
    infrared: Device | None = None
    calibration: Path | None = None
    projectors: ProjectorsConfig | None = None
    fringes: Fringes = Fringes()
    scene: SceneConfig = SceneConfig()
    decode: DecodeConfig = DecodeConfig()


def load_system(path: Path) -> SystemConfig:
    """Read a system file; paths inside it are relative to it. Raises `ConfigError` or `InputError`."""
    try:
        values = tomllib.loads(read_bytes(path).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from error
    config = checked(SystemConfig, values, str(path))
    return _with_absolute_paths(config, path.resolve().parent)


def _with_absolute_paths(config: SystemConfig, folder: Path) -> SystemConfig:
    scene = config.scene
    if scene.height_map is not None:
        file = folder / scene.height_map.file
        scene = scene.model_copy(update={"height_map": scene.height_map.model_copy(update={"file": file})})
    calibration = None if config.calibration is None else folder / config.calibration
    capture = config.capture
    if isinstance(capture, ReplayConfig):
        capture = capture.model_copy(update={"file": folder / capture.file})
    return config.model_copy(update={"scene": scene, "calibration": calibration, "capture": capture})
