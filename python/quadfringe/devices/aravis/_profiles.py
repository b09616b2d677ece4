"""Device layout and feature names of cameras: the JAI AD-080GE family, and GenICam in general."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from quadfringe.config.cameras import AravisConfig, ChipConfig
from quadfringe.devices.aravis._device import Device, Found
from quadfringe.errors import CameraError, CameraNotFoundError

__all__ = [
    "CHIPS",
    "Place",
    "exposure_steps",
    "fix_colours",
    "introduced",
    "matching",
    "period_us",
    "place",
    "places",
    "resolved",
    "set_chip",
    "set_trigger",
    "trigger",
]

CHIPS = ("visible", "infrared")
JAI_MODEL = re.compile(r"(AD-\d+GE)_#([01])$")
JAI_LEAST_US, JAI_STEP_US, JAI_STEPS = 20.0, 42.07, 792  # exposure is 20 us plus a number of steps: manual of JAI
JAI_EXPOSURES = ("JAIExposureTimeRaw", "ExposureTimeRaw")
EXPOSURES = ("ExposureTime", "ExposureTimeAbs")
GAINS = ("Gain", "GainRaw")
OFFSETS = ("OffsetX", "OffsetY")  # of the region of the chip that is sent, by the SFNC
RATES = ("AcquisitionFrameRate", "AcquisitionFrameRateAbs")
# What changes the colours of an ordinary colour camera by itself, or bends them, and its value when it is off.
FIXED: dict[str, str | bool] = {
    "ExposureAuto": "Off",
    "GainAuto": "Off",
    "BalanceWhiteAuto": "Off",
    "GammaEnable": False,
}
SOFTWARE_TRIGGERS = ("SoftwareTrigger0", "TriggerSoftware")
IP = re.compile(r"\d+\.\d+\.\d+\.\d+")


@dataclass(frozen=True)
class Place:
    """The origin of the frames of a chip: a device, its stream channel and its source; and the name of the camera."""

    where: str
    stream: int
    source: str | None
    jai: bool
    name: str


def matching(name: str, devices: Iterable[Found]) -> list[Found]:
    """Return the devices whose vendor, model, serial number or address contains this name."""
    return [device for device in devices if name.casefold() in str(device).casefold()]


def places(config: AravisConfig, look: Callable[[], Sequence[Found]]) -> tuple[Place, Place]:
    """Find the visible and the infrared chip; raises `CameraNotFoundError` listing the devices that answered.

    A JAI camera consists of two devices with one serial number; the suffix of the model is #0 for the visible and #1
    for the infrared chip. A camera with one device has its chips on stream channels 0 and 1.
    """
    chips = (config.visible, config.infrared)
    named = [chip.device or config.device for chip in chips]
    direct = all(IP.fullmatch(name) for name in named) and bool(config.visible.device and config.infrared.device)
    devices = [] if direct else look()
    if config.visible.device and config.infrared.device:
        found = [_one(name, devices) for name in named]
    else:
        found = _both(named[0] if config.visible.device else config.device, config.infrared.device, devices)
    same = found[0].where == found[1].where
    streams = [chip.stream if chip.stream is not None else int(same and n) for n, chip in enumerate(chips)]
    if same and streams[0] == streams[1] and config.visible.source == config.infrared.source:
        raise CameraNotFoundError(
            f"{found[0]}: both chips use stream {streams[0]}; set a different `stream` or `source` for each"
        )
    first, second = (
        Place(device.where, stream, chip.source, config.profile == "jai-ad-080ge", device.name)
        for device, stream, chip in zip(found, streams, chips, strict=True)
    )
    return first, second


def place(config: AravisConfig, chip: str, look: Callable[[], Sequence[Found]]) -> Place:
    """Find one chip; raises `CameraNotFoundError` listing the devices that answered.

    On a JAI camera, the chip is the device with its suffix; on another camera, the stream channel that `places` would
    assign. A chip with a separate `device` is stream channel 0 of that device.
    """
    index = CHIPS.index(chip)
    settings = (config.visible, config.infrared)[index]
    name = settings.device or config.device
    devices = [] if IP.fullmatch(name) and settings.device else look()
    fit = matching(name, devices)
    if settings.device is None and len(fit) == 2 and _twins(*fit):
        found, stream = sorted(fit, key=lambda device: device.model)[index], 0
    else:
        separate = settings.device is not None and config.visible.device != config.infrared.device
        found, stream = _one(name, devices), 0 if separate else index
    if settings.stream is not None:
        stream = settings.stream
    return Place(found.where, stream, settings.source, config.profile == "jai-ad-080ge", found.name)


def introduced(place: Place, device: Device, profile: str | None) -> Place:
    """Complete the place with the name that the opened device reports, and whether it is a JAI camera."""
    vendor, model = (str(device.get(f"Device{part}Name")) for part in ("Vendor", "Model"))
    serial = next((str(device.get(name)) for name in ("DeviceSerialNumber", "DeviceID") if device.has(name)), "")
    jai = JAI_MODEL.search(model) is not None if profile is None else place.jai
    return replace(place, name=Found(place.where, vendor, model, serial).name, jai=jai)


def _one(name: str, devices: Sequence[Found]) -> Found:
    fit = matching(name, devices)
    exact = [device for device in fit if name in (device.where, device.model)]
    if len(exact) == 1:
        return exact[0]
    if len(fit) == 1:
        return fit[0]
    if not fit and IP.fullmatch(name):
        return Found(name, "", "", "")  # no broadcast reaches this address, so it is opened directly
    raise _not_one(name, fit, devices)


def _both(name: str, infrared: str | None, devices: Sequence[Found]) -> list[Found]:
    """Find the devices of both chips by one name, or the infrared one by the name `infrared`."""
    fit = matching(name, devices)
    if IP.fullmatch(name):
        fit = [device for device in fit if device.where == name] or fit
        fit += [twin for twin in devices if fit and twin is not fit[0] and _twins(fit[0], twin)]
    if infrared is not None:
        other = _one(infrared, devices)
        fit = [device for device in fit if device != other]
        if len(fit) != 1:
            raise _not_one(name, fit, devices)
        return [fit[0], other]
    if len(fit) == 2 and _twins(*fit):
        return sorted(fit, key=lambda device: device.model)
    if len(fit) == 1 and JAI_MODEL.search(fit[0].model):
        raise CameraNotFoundError(
            f"{fit[0]} is one of two chips, and the other does not answer; check its cable, and name the camera "
            "without "
            "a chip suffix"
        )
    if len(fit) == 1:
        return [fit[0], fit[0]]
    raise _not_one(name, fit, devices)


def _twins(first: Found, second: Found) -> bool:
    """Return whether two devices are the chips of one JAI camera."""
    models = JAI_MODEL.search(first.model), JAI_MODEL.search(second.model)
    if models[0] is None or models[1] is None or first.serial != second.serial:
        return False
    return models[0][1] == models[1][1] and {models[0][2], models[1][2]} == {"0", "1"}


def _not_one(name: str, fit: Sequence[Found], devices: Sequence[Found]) -> CameraNotFoundError:
    wanted = f"the name {name!r}" if name else "no name"
    listed = "\n".join(f"  {device}" for device in (fit or devices)) or "  none"
    if fit:
        return CameraNotFoundError(f"{wanted} fits several cameras; use a serial number or an address:\n{listed}")
    return CameraNotFoundError(
        f"no camera answers to {wanted}; check power, cable and network, and that the host has an address in the "
        f"camera's subnet. Cameras that answer:\n{listed}"
    )


def exposure_steps(exposure_us: float) -> int:
    """Return the number of exposure steps n of a JAI camera; the exposure is 20 us plus n times 42.07 us.

    >>> exposure_steps(20.0), exposure_steps(10_000.0)
    (0, 237)
    """
    steps = round((exposure_us - JAI_LEAST_US) / JAI_STEP_US)
    if not 0 <= steps <= JAI_STEPS or exposure_us < JAI_LEAST_US:
        most = JAI_LEAST_US + JAI_STEPS * JAI_STEP_US
        raise CameraError(f"exposure_us: expected {JAI_LEAST_US:g} to {most:.0f} us, got {exposure_us:g}")
    return steps


def set_chip(device: Device, place: Place, chip: ChipConfig, exposure_us: float | None) -> dict[str, Any]:
    """Set format, exposure and gain; return the values that the camera accepted, by the names of `ChipConfig`."""
    if place.source is not None:
        device.set("SourceSelector", place.source)
    accepted: dict[str, Any] = {"device": place.where, "stream": place.stream, "source": place.source}
    if chip.pixel_format is not None:
        device.set("PixelFormat", chip.pixel_format)
    accepted |= _region(device, place, chip)
    wanted_us = chip.exposure_us if chip.exposure_us is not None else exposure_us
    raw = _first(device, JAI_EXPOSURES) if place.jai else None
    if raw is not None:
        if wanted_us is not None:
            device.set(raw, exposure_steps(wanted_us))
        accepted["exposure_us"] = JAI_LEAST_US + JAI_STEP_US * int(device.get(raw))
    elif (name := _first(device, EXPOSURES)) is not None:
        if wanted_us is not None:
            device.set(name, JAI_LEAST_US + JAI_STEP_US * exposure_steps(wanted_us) if place.jai else wanted_us)
        accepted["exposure_us"] = float(device.get(name))
    elif wanted_us is not None:
        raise CameraError(
            f"camera at {place.where} has none of {', '.join(EXPOSURES)}; set the exposure under `features`"
        )
    if (name := _first(device, GAINS)) is not None:
        if chip.gain is not None:
            device.set(name, chip.gain)
        accepted["gain"] = float(device.get(name))
    elif chip.gain is not None:
        raise CameraError(f"camera at {place.where} has none of {', '.join(GAINS)}; set the gain under `features`")
    return accepted


def _region(device: Device, place: Place, chip: ChipConfig) -> dict[str, Any]:
    """Set the first column and row of the region that is sent; return what the camera has, if it tells."""
    has = all(device.has(name) for name in OFFSETS)
    if chip.offset_px is not None:
        if not has:
            raise CameraError(f"camera at {place.where} has no {' and '.join(OFFSETS)}; leave offset_px out")
        for name, value in zip(OFFSETS, chip.offset_px, strict=True):
            device.set(name, value)
    return {"offset_px": tuple(int(device.get(name)) for name in OFFSETS)} if has else {}


def fix_colours(device: Device, features: Mapping[str, Any]) -> list[str]:
    """Switch automatic functions and gamma off, except those that `features` states; name those that stay on."""
    stay = []
    for name, off in FIXED.items():
        if name in features or not device.has(name) or device.get(name) == off:
            continue
        with suppress(CameraError):
            device.set(name, off)
        if device.get(name) != off:
            stay.append(name)
    return stay


def set_trigger(device: Device, place: Place, config: AravisConfig) -> None:
    """Set the trigger of exposures, and synchronise both chips of a JAI camera."""
    if place.jai and device.has("SyncMode"):
        device.set("SyncMode", "Sync")
    if device.has("AcquisitionMode"):
        device.set("AcquisitionMode", "Continuous")
    if device.has("TriggerSelector"):
        device.set("TriggerSelector", "FrameStart")
    if device.has("TriggerMode"):
        device.set("TriggerMode", "Off" if config.trigger == "free" else "On")
    elif config.trigger != "free":
        raise CameraError(f'camera at {place.where} has no TriggerMode, so it only runs freely; set trigger = "free"')
    if config.trigger != "free":
        device.set("TriggerSource", "Software" if config.trigger == "software" else config.trigger)
    if config.frame_rate_hz is not None and config.trigger == "free":
        name = _first(device, RATES)
        if name is None:
            raise CameraError(f"camera at {place.where} has none of {', '.join(RATES)}; remove frame_rate_hz")
        if device.has("AcquisitionFrameRateEnable"):
            device.set("AcquisitionFrameRateEnable", True)
        device.set(name, config.frame_rate_hz)


def period_us(device: Device, exposures_us: Iterable[float]) -> float:
    """Return the shortest time between exposures, us, from the frame rate and the exposure times."""
    name = _first(device, RATES)
    rate_hz = float(device.get(name)) if name is not None else 0.0
    return max([1e6 / rate_hz if rate_hz > 0 else 0.0, *exposures_us])


def trigger(device: Device) -> None:
    """Trigger one exposure of both chips."""
    name = _first(device, SOFTWARE_TRIGGERS)
    if name is None:
        raise CameraError(
            f"camera at {device.where} has none of {', '.join(SOFTWARE_TRIGGERS)}; choose another trigger"
        )
    device.set(name, 1)


def _first(device: Device, names: Iterable[str]) -> str | None:
    return next((name for name in names if device.has(name)), None)


def resolved(config: AravisConfig, accepted: Mapping[str, Mapping[str, Any]]) -> AravisConfig:
    """Return the settings with the values that the camera accepted."""
    chips = {chip: ChipConfig.model_validate(dict(values)) for chip, values in accepted.items()}
    return config.model_copy(update={"exposure_us": None, **chips})
