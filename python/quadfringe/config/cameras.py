"""Settings of cameras: the table `[capture]` of a system file, or one word such as "aravis:NAME" or "files:FOLDER".

>>> from quadfringe.config.cameras import capture_config
>>> capture_config("aravis:AD-080GE").device
'AD-080GE'
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from quadfringe.config._base import Model, NotNegative, Positive, checked
from quadfringe.config.devices import Pixels
from quadfringe.config.scene import BayerPattern

__all__ = [
    "AnyCapture",
    "AravisConfig",
    "ChipConfig",
    "FilesConfig",
    "ReplayConfig",
    "UvcConfig",
    "VirtualConfig",
    "capture_config",
]


class VirtualConfig(Model):
    """The camera of the virtual bench."""

    kind: Literal["virtual"] = Field(default="virtual", description="Kind of the camera.")
    frame_rate_hz: Positive | None = Field(
        default=None,
        description="Frame rate in Hz: each shot then shows the scene one frame later, with new noise. "
        "Absent: a shot is made on request, always of the same instant.",
    )


class ReplayConfig(Model):
    """A recording as a camera."""

    kind: Literal["replay"] = Field(default="replay", description="Kind of the camera.")
    file: Path = Field(description="Recording (.h5).")
    speed: Literal["original", "full"] = Field(
        default="original", description='"original" plays at the recorded pace, "full" as fast as shots are taken.'
    )


class FilesConfig(Model):
    """A folder into which another program writes images: red, green and blue, or one colour image, and infrared."""

    kind: Literal["files"] = Field(default="files", description="Kind of the camera.")
    folder: Path = Field(description="Folder that is watched, with the folders in it.")
    start: Literal["new", "all"] = Field(
        default="new",
        description='"new" takes images that arrive from now on, "all" first those that are there already.',
    )
    infrared: bool | None = Field(
        default=None,
        description="Whether every shot has an infrared image. Absent: a shot waits `infrared_wait_s` for one.",
    )
    bayer: BayerPattern | None = Field(
        default=None, description="Filter colours of grey images that are raw mosaics. Absent: none are."
    )
    bits: Annotated[int, Field(ge=8, le=16)] | None = Field(
        default=None, description="Bits in use of 16-bit files, such as 12. Absent: 16."
    )
    settle_s: NotNegative = Field(
        default=0.2, description="Time in s for which a file must be unchanged: until then it is being written."
    )
    infrared_wait_s: NotNegative = Field(
        default=1.0, description="Time in s for which a shot waits for an infrared image, if it need not have one."
    )
    incomplete_s: Positive = Field(
        default=30.0, description="Time in s after which a shot is left out of which images are missing."
    )
    timeout_s: Positive = Field(
        default=60.0, description="Longest time in s to wait for a single shot; a stream waits without a limit."
    )


class UvcConfig(Model):
    """A webcam or another colour camera that OpenCV opens, or a video file in its place.

    Automatic exposure, white balance, focus, backlight compensation and sharpening are switched off. Every setting is
    read back; one that is absent stays as it is in the device.
    """

    kind: Literal["uvc"] = Field(default="uvc", description="Kind of the camera.")
    device: Annotated[str, Field(min_length=1)] = Field(
        default="0", description="Number of the camera, its device file, or a video file."
    )
    pixel_format: Annotated[str, Field(pattern=r"^[ -~]{3,4}$")] | None = Field(
        default=None,
        description="Four letters of the format, such as YUYV. Absent: an uncompressed one if the camera has any.",
    )
    size_px: tuple[Pixels, Pixels] | None = Field(default=None, description="Width and height of the images.")
    frame_rate_hz: Positive | None = Field(default=None, description="Frame rate in Hz.")
    exposure_us: Positive | None = Field(default=None, description="Exposure in us.")
    gain: NotNegative | None = Field(default=None, description="Gain, in the unit of the device.")
    white_balance_k: Positive | None = Field(default=None, description="Colour temperature in K.")
    gamma: Positive | None = Field(
        default=None, description="Gamma, in the unit of the device; many have 100 for linear light."
    )
    bayer: BayerPattern | None = Field(
        default=None, description="Filter colours of a camera that sends raw mosaics. Absent: it sends colours."
    )
    skip_frames: Annotated[int, Field(ge=0, le=100)] = Field(
        default=2, description="Frames after a call that are left out, because their exposure may have begun before it."
    )
    timeout_s: Positive = Field(default=5.0, description="Longest time in s to wait for a shot.")


PixelFormat = Literal[
    "Mono8",
    "Mono10",
    "Mono10Packed",
    "Mono10p",
    "Mono12",
    "Mono12Packed",
    "Mono12p",
    "BayerRG8",
    "BayerRG10",
    "BayerRG10Packed",
    "BayerRG10p",
    "BayerRG12",
    "BayerRG12Packed",
    "BayerRG12p",
    "BayerGR8",
    "BayerGR10",
    "BayerGR10Packed",
    "BayerGR10p",
    "BayerGR12",
    "BayerGR12Packed",
    "BayerGR12p",
    "BayerGB8",
    "BayerGB10",
    "BayerGB10Packed",
    "BayerGB10p",
    "BayerGB12",
    "BayerGB12Packed",
    "BayerGB12p",
    "BayerBG8",
    "BayerBG10",
    "BayerBG10Packed",
    "BayerBG10p",
    "BayerBG12",
    "BayerBG12Packed",
    "BayerBG12p",
    "RGB8",
]


NotNegativeInt = Annotated[int, Field(ge=0)]


class ChipConfig(Model):
    """One chip of the camera. A setting that is absent stays as it is in the device."""

    device: str | None = Field(
        default=None,
        description="Part of the name, serial number or IP address. Absent: as the profile says.",
    )
    stream: Annotated[int, Field(ge=0, le=511)] | None = Field(
        default=None, description="Stream channel that delivers this chip."
    )
    source: str | None = Field(
        default=None, description="Value of the GenICam feature SourceSelector, for devices that have it."
    )
    pixel_format: PixelFormat | None = Field(default=None, description="Pixel format, by its GenICam name.")
    offset_px: tuple[NotNegativeInt, NotNegativeInt] | None = Field(
        default=None,
        description="First column and row of the images on the chip (OffsetX, OffsetY). A calibration holds for one.",
    )
    exposure_us: Positive | None = Field(default=None, description="Exposure of this chip, in us.")
    gain: NotNegative | None = Field(default=None, description="Gain of this chip, in the device's unit.")


class AravisConfig(Model):
    """A GenICam camera through Aravis: with a visible and an infrared chip, or with one colour chip.

    Automatic exposure, gain and white balance, and the gamma of a camera with one chip are switched off.
    """

    kind: Literal["aravis"] = Field(default="aravis", description="Kind of the camera.")
    device: str = Field(
        default="", description="Part of the name, serial number or IP address. Empty: the only camera that answers."
    )
    chips: Literal[1, 2] | None = Field(
        default=None,
        description="Number of chips. Absent: one for a device with one stream channel and no settings of an infrared "
        "chip, otherwise two.",
    )
    profile: Literal["jai-ad-080ge", "generic"] | None = Field(
        default=None, description="How the two chips are distinguished. Absent: by the model name."
    )
    visible: ChipConfig = Field(default=ChipConfig(), description="The visible chip.")
    infrared: ChipConfig = Field(default=ChipConfig(), description="The infrared chip.")
    exposure_us: Positive | None = Field(default=None, description="Exposure of both chips, in us.")
    frame_rate_hz: Positive | None = Field(default=None, description="Frame rate in Hz, when the camera runs free.")
    trigger: Annotated[str, Field(min_length=1)] = Field(
        default="free",
        description='"free": the camera runs by itself; "software": every shot is asked for; or a line of the camera, '
        'such as "Line5".',
    )
    features: dict[str, bool | int | float | str] = Field(
        default_factory=dict,
        description="GenICam features that are set first, in this order, on every device of the camera that has them.",
    )
    packet_size: Annotated[int, Field(ge=576, le=65500)] | None = Field(
        default=None,
        description="Bytes of a GigE Vision packet. Absent: the largest of which test packets arrive; a camera "
        "without test packets keeps its size.",
    )
    packet_delay_ns: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="Pause between packets in ns, for two devices on one network link."
    )
    buffers: Annotated[int, Field(ge=4, le=256)] = Field(
        default=12, description="Frames of each chip that may wait; more survive longer pauses and need memory."
    )
    timeout_s: Positive = Field(default=2.0, description="Longest time in s to wait for a shot.")
    pair_tolerance_us: Positive = Field(
        default=2000.0, description="Largest difference in us between the exposures of the two frames of a shot."
    )

    @model_validator(mode="after")
    def _one_exposure(self) -> AravisConfig:
        if self.exposure_us is not None and (self.visible.exposure_us or self.infrared.exposure_us):
            raise ValueError("give exposure_us once for both chips, or for each chip, not both")
        return self

    @model_validator(mode="after")
    def _no_settings_of_an_absent_chip(self) -> AravisConfig:
        if self.chips == 1 and self.infrared != ChipConfig():
            raise ValueError("infrared: chips = 1 means that there is no infrared chip; leave one of the two out")
        return self


# The setting that the word after the colon gives, by kind; None: no word may follow.
WORDS: dict[str, str | None] = {
    "virtual": None,
    "aravis": "device",
    "replay": "file",
    "files": "folder",
    "uvc": "device",
}


def _from_word(value: Any) -> Any:
    """Turn "kind:rest" into the table it stands for."""
    if isinstance(value, (Mapping, Model)):
        return value
    kind, colon, rest = value.partition(":") if isinstance(value, str) else ("", "", "")
    if kind not in WORDS or not colon:
        raise ValueError('expected "virtual:", "aravis:NAME", "uvc:NUMBER", "files:FOLDER" or "replay:FILE"')
    key = WORDS[kind]
    if kind == "files" and not rest:
        raise ValueError('expected "files:FOLDER" with the name of a folder behind the colon')
    if kind == "uvc" and not rest:
        raise ValueError('expected "uvc:0" with the number of a camera, or the name of a video file')
    if key is None and rest:
        raise ValueError(f'expected "{kind}:" with nothing behind the colon')
    return {"kind": kind} if key is None else {"kind": kind, key: rest}


AnyCapture = Annotated[
    Annotated[VirtualConfig | AravisConfig | UvcConfig | FilesConfig | ReplayConfig, Field(discriminator="kind")],
    BeforeValidator(_from_word),
]


class _Holder(Model):
    capture: AnyCapture


def capture_config(word: str) -> AnyCapture:
    """Give the settings that a word such as "replay:take.h5" stands for; raises `ConfigError`."""
    return checked(_Holder, {"capture": word}, "camera").capture
