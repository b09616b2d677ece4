"""Settings of decoding: the table `[decode]` of a system file, and the response of the channels.

>>> from quadfringe.config import DecodeConfig
>>> DecodeConfig(method="published", response="linear")
DecodeConfig(method='published', response='linear')
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from quadfringe import _core
from quadfringe.config._base import SIZE_MAX, Finite, Model, NotNegative, Positive, kernel_takes

__all__ = [
    "ChannelResponse",
    "DecodeConfig",
    "Response",
    "ResponseChoice",
    "ResponseSetting",
    "Row4",
    "instants_of_four",
]

Row4 = tuple[Finite, Finite, Finite, Finite]
SMALLEST = 16, 16  # rows and columns of the smallest image that the kernel decodes
PERIOD_MIN_PX = 3.0  # the least that the kernel takes; the most is the longer side of the image
# Older settings and files call the joint method "best".
Method = Annotated[Literal["published", "joint"], BeforeValidator(lambda v: "joint" if v == "best" else v)]


def instants_of_four(instants: tuple[float, ...]) -> Row4:
    """Give the times of R, G, B and IR; without infrared, the last one has no effect and is that of red."""
    red, green, blue, ir = (*instants, instants[0])[:4]
    return red, green, blue, ir


class ChannelResponse(Model):
    """Inverse response of one channel: linear = max(I / (1 - knee I^20) - offset, 0) ^ exponent.

    I is the captured intensity as a fraction of full scale.
    """

    offset: NotNegative = Field(default=0.0, description="Intensity without light, fraction of full scale.")
    exponent: Positive = Field(default=1.0, description="Exponent that makes the intensity linear; 1 / gamma.")
    knee: NotNegative = Field(default=0.0, description="Compression of highlights, a share of full scale.")


class Response(Model):
    """Inverse responses of the four channels; a channel that is left out is linear."""

    red: ChannelResponse = Field(default=ChannelResponse(), description="Response of the red channel.")
    green: ChannelResponse = Field(default=ChannelResponse(), description="Response of the green channel.")
    blue: ChannelResponse = Field(default=ChannelResponse(), description="Response of the blue channel.")
    ir: ChannelResponse = Field(default=ChannelResponse(), description="Response of the infrared channel.")

    @property
    def rows(self) -> list[tuple[float, float, float]]:
        """Offset, exponent and knee of R, G, B, IR."""
        return [(c.offset, c.exponent, c.knee) for c in (self.red, self.green, self.blue, self.ir)]

    @classmethod
    def from_powers(cls, offsets: Iterable[float], exponents: Iterable[float]) -> Self:
        """Return the responses with these offsets and exponents of R, G, B, IR, without a knee."""
        red, green, blue, ir = (
            ChannelResponse(offset=float(offset), exponent=float(exponent))
            for offset, exponent in zip(offsets, exponents, strict=True)
        )
        return cls(red=red, green=green, blue=blue, ir=ir)


def _kind_of(value: Any) -> str | None:
    if isinstance(value, (Response, Mapping)):
        return "(table)"
    if value in ("auto", "linear"):
        return "(word)"
    return "(file)" if isinstance(value, (str, Path)) and Path(value).suffix == ".json" else None


PeriodPx = Annotated[Finite, Field(ge=PERIOD_MIN_PX, le=SIZE_MAX)]
PeriodSetting = Annotated[
    Annotated[PeriodPx, Tag("(number)")] | Annotated[tuple[PeriodPx, PeriodPx], Tag("(range)")],
    Discriminator(lambda value: "(range)" if isinstance(value, (list, tuple)) else "(number)"),
]
ResponseSetting = Annotated[
    Annotated[Literal["auto", "linear"], Tag("(word)")]
    | Annotated[Path, Tag("(file)")]
    | Annotated[Response, Tag("(table)")],
    Discriminator(
        _kind_of,
        custom_error_type="response",
        custom_error_message='expected "auto", "linear", a response of the channels, or a file that ends in .json',
    ),
]


ResponseChoice = Response | Literal["auto", "linear"]  # a setting whose file has been read


class DecodeConfig(Model):
    """How a shot is decoded. An absent setting takes the kernel's default; `Shape.config` shows the value in use."""

    method: Method | None = Field(
        default=None,
        description='"joint" fits all channels together (default); "published" is the chain of the paper, about ten '
        'times as fast, and less accurate at edges and on textured surfaces. "best" is an older name of "joint".',
    )
    response: ResponseSetting = Field(
        default="auto",
        description='How intensities follow the light. "auto" takes the response of the calibration, or, if the '
        'calibration holds none, estimates it from the first sound shots; "linear" corrects no response; a Response, '
        "or a file of one (.json), replaces the response of the calibration.",
    )
    unwrapping: Literal["coaxial", "pair"] | None = Field(
        default=None,
        description='"coaxial" (default) takes the infrared projector as coaxial with the visible one; "pair" knows '
        "the infrared fringes along every camera ray from the calibration of both projectors, which may stand apart.",
    )
    depth_range_mm: tuple[Finite, Finite] | None = Field(
        default=None,
        description="Nearest and farthest depth in mm, for every method; points outside are no data, and "
        'unwrapping = "pair" with method "published" does not search there. Needs a calibration. Absent: all depths.',
    )
    modulation_min: Finite | None = Field(
        default=None,
        description="Least fringe amplitude of a valid pixel, fraction of full scale. Raise it to drop dark pixels. "
        "Absent: with method joint the noise of each shot decides; with method published 0.02.",
    )
    quality_min: Finite | None = Field(
        default=None,
        description="Least quality of a valid pixel, from 0 to below 1. Raise it for fewer wrong orders and fewer "
        "pixels.",
    )
    period_px: PeriodSetting | None = Field(
        default=None,
        description="Fringe period across the fringes in camera pixels, from 3 to the longer side of the image, good "
        "to a third; or the shortest and the longest one, between which it is estimated. Absent: estimated from every "
        "shot. Give it if the estimate fails, as on an object narrower than two fringes.",
    )
    channel_instants_us: tuple[Finite, ...] | None = Field(
        default=None,
        description="Times in us at which R, G, B and IR are exposed, relative to the instant of the shape; three "
        "without infrared. For moving surfaces and a projector that shows its colours one after another (method "
        "joint).",
    )
    albedo: bool | None = Field(
        default=None,
        description="Whether shapes have the albedo, the light of each channel without fringes. Absent: yes with "
        "method joint; the published method has none.",
    )
    detail: Finite | None = Field(
        default=None,
        description="Detail against noise, from 0.25 to 4, with method joint. Each shot says how finely its surface "
        "varies; 2 keeps relief half as wide, with more noise, and 0.5 smooths relief twice as wide, with less. "
        "Absent: 1.",
    )
    threads: Annotated[int, Field(gt=0, le=_core.THREADS_MAX)] | None = Field(
        default=None, description="Threads of one decoder, at most 1024. Absent: as many as the machine has cores."
    )

    @field_validator("period_px")
    @classmethod
    def _ascending(cls, value: float | tuple[float, float] | None) -> float | tuple[float, float] | None:
        if isinstance(value, tuple) and value[0] > value[1]:
            raise ValueError(f"expected the shortest period before the longest, got {value[0]:g} and {value[1]:g}")
        return value

    @field_validator("modulation_min", "quality_min", "channel_instants_us", "detail")
    @classmethod
    def _decoder_takes(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None and info.field_name is not None:
            settings = {info.field_name: value}
            if info.field_name == "channel_instants_us":
                if len(value) not in (3, 4):
                    raise ValueError("expected four times, of R, G, B and IR, or three without infrared")
                settings = {info.field_name: instants_of_four(value)}
            kernel_takes(info.field_name, lambda: _core.Decoder(SMALLEST, (36, 35, 30), 912, **settings))
        return value

    @field_validator("depth_range_mm")
    @classmethod
    def _depths_grow(cls, depths: tuple[float, float] | None) -> tuple[float, float] | None:
        if depths is not None:
            bench, camera = _core.Bench(), _core.Device(1, 1, (1.0, 1.0), (0.0, 0.0))
            devices = camera, bench.visible, bench.infrared
            kernel_takes("depth_range_mm", lambda: _core.PairTable(*devices, (36, 35, 30), depth_range_mm=depths))
        return depths

    @model_validator(mode="after")
    def _method_has_the_options(self) -> DecodeConfig:
        if self.albedo and self.method == "published":
            raise ValueError(
                'albedo needs method = "joint", and the method is published: change the method, or leave albedo out'
            )
        for name in ("channel_instants_us", "detail"):
            if getattr(self, name) is not None and self.method == "published":
                raise ValueError(
                    f'{name} needs method = "joint", and the method is published: '
                    f"change the method, or leave {name} out"
                )
        return self
