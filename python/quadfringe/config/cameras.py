"""Settings of cameras: the table `[capture]` of a system file, or one word such as "aravis:AD-080GE".

>>> from quadfringe.config.cameras import capture_config
>>> capture_config("aravis:AD-080GE").device
'AD-080GE'
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from quadfringe.config._base import Model, NotNegative, Positive, checked

__all__ = ["AnyCapture", "AravisConfig", "ChipConfig", "ReplayConfig", "VirtualConfig", "capture_config"]


class VirtualConfig(Model):
    """The camera of the virtual bench. With a frame rate the scene's time, and its noise, go on from shot to shot."""

    kind: Literal["virtual"] = "virtual"
    frame_rate_hz: Positive | None = None


class ReplayConfig(Model):
    """A recording as a camera, at the speed at which it was taken or as fast as it can be read."""

    kind: Literal["replay"] = "replay"
    file: Path
    speed: Literal["original", "full"] = "original"


PixelFormat = Literal[
    "Mono8",
    "Mono10",
    "Mono10Packed",
    "Mono12",
    "Mono12Packed",
    "BayerRG8",
    "BayerRG10",
    "BayerRG10Packed",
    "BayerRG12",
    "BayerRG12Packed",
    "RGB8",
]


class ChipConfig(Model):
    """One chip of the camera: which device and stream channel deliver it, and how it is set.

    `device` is part of the name, the serial number or the IP address; without it the profile of the camera knows.
    `source` is the value of the GenICam feature SourceSelector, where a device has one. What is absent stays as it is.
    """

    device: str | None = None
    stream: Annotated[int, Field(ge=0, le=511)] | None = None
    source: str | None = None
    pixel_format: PixelFormat | None = None
    exposure_us: Positive | None = None
    gain: NotNegative | None = None


class AravisConfig(Model):
    """A GenICam camera with a visible and an infrared chip.

    `device` is part of its name, its serial number or an IP address; empty takes the only one. `trigger` is "free"
    (the camera runs by itself), "software" (every shot is asked for), or a line of the camera such as "Line5".
    `features` are GenICam features that are set first, in this order, on every device of the camera that has them.
    """

    kind: Literal["aravis"] = "aravis"
    device: str = ""
    profile: Literal["jai-ad-080ge", "generic"] | None = None
    visible: ChipConfig = ChipConfig()
    infrared: ChipConfig = ChipConfig()
    exposure_us: Positive | None = None
    frame_rate_hz: Positive | None = None
    trigger: Annotated[str, Field(min_length=1)] = "free"
    features: dict[str, bool | int | float | str] = Field(default_factory=dict)
    packet_size: Annotated[int, Field(ge=576, le=65500)] | None = None
    packet_delay_ns: Annotated[int, Field(ge=0)] | None = None
    buffers: Annotated[int, Field(ge=4, le=256)] = 12
    timeout_s: Positive = 2.0
    pair_tolerance_us: Positive = 2000.0

    @model_validator(mode="after")
    def _one_exposure(self) -> AravisConfig:
        if self.exposure_us is not None and (self.visible.exposure_us or self.infrared.exposure_us):
            raise ValueError("give exposure_us once for both chips, or for each chip, not both")
        return self


# What the word behind the colon is, by kind; None: there is none.
WORDS: dict[str, str | None] = {"virtual": None, "aravis": "device", "replay": "file"}


def _from_word(value: Any) -> Any:
    """Turn "kind:rest" into the table it stands for."""
    if not isinstance(value, str):
        return value
    kind, colon, rest = value.partition(":")
    if kind not in WORDS or not colon:
        raise ValueError('expected "virtual:", "aravis:NAME" or "replay:FILE"')
    key = WORDS[kind]
    if key is None and rest:
        raise ValueError(f'expected "{kind}:" with nothing behind the colon')
    return {"kind": kind} if key is None else {"kind": kind, key: rest}


AnyCapture = Annotated[
    Annotated[VirtualConfig | AravisConfig | ReplayConfig, Field(discriminator="kind")], BeforeValidator(_from_word)
]


class _Holder(Model):
    capture: AnyCapture


def capture_config(word: str) -> AnyCapture:
    """Give the settings that a word such as "replay:take.h5" stands for; raises `ConfigError`."""
    return checked(_Holder, {"capture": word}, "camera").capture
