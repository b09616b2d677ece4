"""Settings of a camera through OpenCV: made manual, set, and read back, because drivers ignore what they like."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import cv2

from quadfringe.config.cameras import UvcConfig
from quadfringe.errors import CameraError, ConfigError

__all__ = ["VALUES", "Capture", "Controls", "Outcome", "compression", "fourcc_of"]

ABSENT = (-1.0, 0.0)  # what OpenCV reads from a control that there is not, by backend; 0 may also be a value
UNCOMPRESSED = ("YUYV", "UYVY", "YUY2", "NV12", "BGR3", "RGB3", "I420", "YV12")
LOSSLESS = (*UNCOMPRESSED, "GREY", "Y800", "Y16", "BA81", "GBRG", "GRBG", "RGGB", "RGB", "BGR", "FFV1", "HFYU", "PNG")
SAME = {"YUY2": "YUYV"}  # two names of one format
ASKED = UNCOMPRESSED[:4]  # formats that are tried in this order if none is stated
# The values of "manual" and "automatic" exposure differ between the backends.
MANUAL = {"V4L2": 1.0, "DSHOW": 0.0, "MSMF": 0.0}
EXPOSURE_UNIT_US = 100.0  # of V4L2
# How far a value may be from the wanted one: drivers round to their steps.
TOLERANCE = 0.05


class Capture(Protocol):
    """What is used of `cv2.VideoCapture`."""

    def get(self, propId: int) -> float: ...  # noqa: N803 - the name is that of OpenCV
    def set(self, propId: int, value: float) -> bool: ...  # noqa: N803
    def getBackendName(self) -> str: ...  # noqa: N802
    def isOpened(self) -> bool: ...  # noqa: N802
    def grab(self) -> bool: ...
    def retrieve(self) -> tuple[bool, Any]: ...
    def release(self) -> None: ...


@dataclass(frozen=True)
class Value:
    """A setting that a camera may have: its property in OpenCV, and its unit."""

    prop: int
    unit: str = ""


VALUES = {
    "exposure_us": Value(cv2.CAP_PROP_EXPOSURE, " us"),
    "gain": Value(cv2.CAP_PROP_GAIN),
    "white_balance_k": Value(cv2.CAP_PROP_WB_TEMPERATURE, " K"),
    "gamma": Value(cv2.CAP_PROP_GAMMA),
}
# What changes the image by itself or its fringes, and is switched off where a camera has it.
DISTURBING = {
    "automatic white balance": cv2.CAP_PROP_AUTO_WB,
    "automatic focus": cv2.CAP_PROP_AUTOFOCUS,
    "backlight compensation": cv2.CAP_PROP_BACKLIGHT,
    "sharpening": cv2.CAP_PROP_SHARPNESS,
}


@dataclass(frozen=True)
class Outcome:
    """The settings that a camera took, by the names of `UvcConfig`, and what is wrong with it, in words."""

    accepted: Mapping[str, Any]
    doubts: tuple[str, ...]


class Controls:
    """The settings of one opened camera; `name` is for messages."""

    def __init__(self, capture: Capture, name: str) -> None:
        self._capture, self._name = capture, name
        self._backend = capture.getBackendName()
        self._fixed: dict[str, float] = {}

    def apply(self, config: UvcConfig) -> Outcome:
        """Set format, then size and rate, then the exposure and colours; read everything back.

        Raises `CameraError` for a value that the camera has not or does not take, `ConfigError` for an exposure time
        that the backend of OpenCV cannot set.
        """
        accepted = self._set_format(config)
        doubts = [*compression(accepted["pixel_format"]), *self._switch_off()]
        for name, value in VALUES.items():
            wanted = getattr(config, name)
            if wanted is not None:
                self._set(name, value, wanted)
            if (now := self.read(name)) is not None:
                accepted[name] = self._fixed[name] = now
        return Outcome(accepted, tuple(doubts))

    def _set_format(self, config: UvcConfig) -> dict[str, Any]:
        self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # older frames would be delivered first
        self._choose_format(config)
        sizes = {} if config.size_px is None else dict(zip(("WIDTH", "HEIGHT"), config.size_px, strict=True))
        for side, wanted in sizes.items():
            self._capture.set(getattr(cv2, f"CAP_PROP_FRAME_{side}"), wanted)
        got = tuple(int(self._capture.get(getattr(cv2, f"CAP_PROP_FRAME_{side}"))) for side in ("WIDTH", "HEIGHT"))
        if config.size_px is not None and got != config.size_px:
            raise CameraError(
                f"{self._name}: size_px: asked for {config.size_px[0]} x {config.size_px[1]}, the camera sends "
                f"{got[0]} x {got[1]}; choose a size that it has in the format {self._format()}"
            )
        if config.frame_rate_hz is not None:
            self._capture.set(cv2.CAP_PROP_FPS, config.frame_rate_hz)
            self._check("frame_rate_hz", " Hz", config.frame_rate_hz, self._capture.get(cv2.CAP_PROP_FPS))
        if config.bayer is not None:
            self._capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        return {"pixel_format": self._format(), "size_px": got, "frame_rate_hz": self._rate()}

    def _choose_format(self, config: UvcConfig) -> None:
        """Set the stated format, or without one an uncompressed one if the camera has any."""
        if config.pixel_format is not None:
            names: tuple[str, ...] = (config.pixel_format,)
        else:
            names = () if config.bayer is not None or self._format() in UNCOMPRESSED else ASKED
        for name in names:
            self._capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*name.ljust(4)))
            if _same(self._format(), name):
                return
        if config.pixel_format is not None:
            raise CameraError(
                f"{self._name}: pixel_format: asked for {config.pixel_format}, the camera sends {self._format()}; "
                "choose a format that it has (v4l2-ctl --list-formats-ext lists them on Linux)"
            )

    def _format(self) -> str:
        return fourcc_of(self._capture)

    def _rate(self) -> float | None:
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        return rate_hz if math.isfinite(rate_hz) and rate_hz > 0 else None

    def _switch_off(self) -> Iterator[str]:
        """Make the exposure manual, and switch off what changes images; say what stayed on."""
        manual = MANUAL.get(self._backend)
        if manual is not None and self._capture.get(cv2.CAP_PROP_AUTO_EXPOSURE) != ABSENT[0]:
            self._capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, manual)
            if self._capture.get(cv2.CAP_PROP_AUTO_EXPOSURE) != manual:
                yield "the automatic exposure cannot be switched off, so that brightness changes from shot to shot"
        for name, prop in DISTURBING.items():
            if self._capture.get(prop) in ABSENT:
                continue  # the camera has it not, or it is off
            self._capture.set(prop, 0)
            if self._capture.get(prop) not in ABSENT:
                yield f"the {name} cannot be switched off"

    def _set(self, name: str, value: Value, wanted: float) -> None:
        raw = self._raw_exposure(wanted) if name == "exposure_us" else wanted
        before = self._capture.get(value.prop)
        done = self._capture.set(value.prop, raw)
        if not done or before == ABSENT[0]:
            raise CameraError(f"{self._name}: {name}: this camera does not let it be set; leave it out")
        self._check(name, value.unit, wanted, self.read(name))

    def _check(self, name: str, unit: str, wanted: float, got: float | None) -> None:
        if got is None or not abs(got - wanted) <= TOLERANCE * abs(wanted):
            took = "nothing" if got is None else f"{got:g}{unit}"
            raise CameraError(
                f"{self._name}: {name}: asked for {wanted:g}{unit}, the camera took {took}; choose a value that it "
                "has, or leave it out"
            )

    def _raw_exposure(self, wanted_us: float) -> float:
        """Convert an exposure time to the unit of the backend: 100 us, or the binary logarithm of seconds."""
        if self._backend == "V4L2":
            return max(1.0, round(wanted_us / EXPOSURE_UNIT_US))
        if self._backend in MANUAL:
            return float(round(math.log2(wanted_us * 1e-6)))
        raise ConfigError(
            f"exposure_us: the unit of the exposure is not known for the backend {self._backend} of OpenCV; set it "
            "with the program of the camera, and leave it out here"
        )

    def read(self, name: str) -> float | None:
        """Read a setting in our unit; None if the camera has it not."""
        value = self._capture.get(VALUES[name].prop)
        if not math.isfinite(value) or (value == ABSENT[0] and self._backend == "V4L2"):
            return None
        if name != "exposure_us":
            return value if value > 0 or (name == "gain" and value == 0) else None
        if self._backend == "V4L2":
            return value * EXPOSURE_UNIT_US if value > 0 else None
        return 1e6 * 2.0**value if self._backend in MANUAL and value < 0 else None

    def changed(self) -> list[str]:
        """Say which settings are no longer those that the camera took."""
        now = {name: self.read(name) for name in self._fixed}
        return [
            f"{name} is now {now[name]:g}{VALUES[name].unit}, it was {was:g}{VALUES[name].unit}"
            for name, was in self._fixed.items()
            if now[name] is not None and now[name] != was
        ]


def compression(name: str) -> tuple[str, ...]:
    """Say that a pixel format or codec changes the fringes; nothing for one that does not, or that is not known."""
    if not name or name in LOSSLESS:
        return ()
    return (
        f"the format is {name}, whose compression changes the fringes; take an uncompressed one, such as YUYV, which a "
        "smaller size_px or frame_rate_hz may allow, or a lossless codec, such as FFV1",
    )


def _same(one: str, other: str) -> bool:
    return SAME.get(one.strip(), one.strip()) == SAME.get(other.strip(), other.strip())


def fourcc_of(capture: Capture) -> str:
    """Give the name of the pixel format or of the codec; "" if the backend does not say."""
    code = int(capture.get(cv2.CAP_PROP_FOURCC))
    return "" if code <= 0 else code.to_bytes(4, "little", signed=False).decode("latin-1").strip("\0 ").upper()
