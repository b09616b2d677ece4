"""The connection to a camera: sets up its devices and streams, and turns frames into shots."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from typing import Any

from quadfringe.config.cameras import AravisConfig, ChipConfig
from quadfringe.data import AnyShot, ChipImage, FrameStamp, Stamp
from quadfringe.data.host_clock import HOST_CLOCK
from quadfringe.devices._shots import shot_of, split_colours
from quadfringe.devices.aravis import _profiles as profiles
from quadfringe.devices.aravis._device import Device, TooLarge, found
from quadfringe.devices.aravis._formats import format_named
from quadfringe.devices.aravis._frame_matching import FrameMatcher, SingleChip, Stamped
from quadfringe.devices.aravis._profiles import CHIPS, Place
from quadfringe.devices.aravis._reader import Agreed, ChipReader, Frame
from quadfringe.errors import CameraBusyError, CameraError, CameraLostError, CameraNotFoundError, CameraWarning

__all__ = ["Link"]

RETRY_S = 0.2  # pause between attempts to connect


class Link:
    """The connection to one or both chips of a camera; raises `CameraError`, and then closes what it opened.

    `patience_s` is how long a busy or missing camera is retried: after a loss, the camera may be booting, or holds the
    previous connection until its heartbeat expires after 3 s. With `shots`, frames become shots, otherwise those of one
    chip become images of it; a camera that turns out to have one chip then has that one in `chips`.
    """

    def __init__(self, config: AravisConfig, chips: Sequence[str], *, patience_s: float, shots: bool = True) -> None:
        self.chips = chips
        self._shots = shots
        self.readers: list[ChipReader] = []
        self._devices: dict[str, Device] = {}
        self._running = False
        with ExitStack() as undo:
            undo.callback(self.forget)
            self.places = _patiently(lambda: self._open_devices(config), patience_s)
            self.config = self._set_up(config)
            both = len(self.chips) == len(CHIPS)
            self.matcher: FrameMatcher[Frame] | SingleChip[Frame] = (
                FrameMatcher(1000 * config.pair_tolerance_us) if both else SingleChip()
            )
            undo.pop_all()
        self._pairing = threading.Lock()

    def _open_devices(self, config: AravisConfig) -> tuple[Place, ...]:
        self.forget()
        if len(self.chips) == len(CHIPS):
            found_at: tuple[Place, ...] = profiles.places(config, found)
        else:
            found_at = tuple(profiles.place(config, chip, found) for chip in self.chips)
        for where in dict.fromkeys(place.where for place in found_at):
            self._devices[where] = Device(where)
            if not self._devices[where].controlled:
                raise CameraBusyError(
                    f"camera at {where} is controlled by another program; close that program (the camera forgets a "
                    "killed "
                    "one after 3 s)"
                )
        if self._has_one_chip(config, found_at):
            self.chips, found_at = CHIPS[:1], found_at[:1]
        return tuple(profiles.introduced(place, self._devices[place.where], config.profile) for place in found_at)

    def _has_one_chip(self, config: AravisConfig, found_at: Sequence[Place]) -> bool:
        """Say whether a camera of which two chips were looked for has one."""
        if len(found_at) != len(CHIPS) or config.chips is not None or config.infrared != ChipConfig():
            return False
        return found_at[0].where == found_at[1].where and self._devices[found_at[0].where].channels() == 1

    def device(self, chip: int) -> Device:
        """Return the device of a chip."""
        return self._devices[self.places[chip].where]

    def _set_up(self, config: AravisConfig) -> AravisConfig:
        """Set features, then packets, then streams: a buffer is sized by the format, and a stream by its packets."""
        for name, value in config.features.items():
            having = [device for device in self._devices.values() if device.has(name)]
            if not having:
                raise CameraError(
                    f"features: no device of the camera has {name}, or it is locked now; leave it out, or check its "
                    "spelling"
                )
            for device in having:
                device.set(name, value)
        accepted, agreed = {}, []
        settings = dict(zip(CHIPS, (config.visible, config.infrared), strict=True))
        for n, (chip, place) in enumerate(zip(self.chips, self.places, strict=True)):
            accepted[chip] = profiles.set_chip(self.device(n), place, settings[chip], config.exposure_us)
            agreed.append(_agreed(self.device(n)))
            accepted[chip]["pixel_format"] = agreed[n].format.name
        if self._shots:
            _check(*agreed)
            self._fix_colours(config)
        for where, device in self._devices.items():
            profiles.set_trigger(device, next(place for place in self.places if place.where == where), config)
        exposures_us = [float(chip.get("exposure_us", 0.0)) for chip in accepted.values()]
        self.period_us = max(profiles.period_us(device, exposures_us) for device in self._devices.values())
        for n, place in enumerate(self.places):
            device = self.device(n)
            if place.stream >= device.channels():
                raise CameraError(
                    f"camera at {place.where} has {device.channels()} stream channel(s), but the {self.chips[n]} chip "
                    f"needs number {place.stream}, counted from 0; for a camera with one colour chip leave "
                    "infrared out, for one chip alone use `ChipCamera` or quadfringe camera snap --chip visible"
                )
            device.set_packets(place.stream, config.packet_size, config.packet_delay_ns)
            stream = device.stream(place.stream, agreed[n].payload, config.buffers, self.period_us)
            self.readers.append(ChipReader(stream, agreed[n]))
        resolved = profiles.resolved(config, accepted)
        return resolved.model_copy(update={"chips": 1}) if self._shots and len(agreed) == 1 else resolved

    def _fix_colours(self, config: AravisConfig) -> None:
        """Switch automatic functions of a camera with one chip off; warn of those that stay on."""
        if len(self.chips) == len(CHIPS):
            return
        for name in profiles.fix_colours(self.device(0), config.features):
            words = (
                f"camera at {self.places[0].where}: {name} stays on, so that colours change or are bent; switch it off"
            )
            warnings.warn(f"{words} with the program of the camera", CameraWarning, stacklevel=2)

    def start(self, deliver: Callable[[Any], None], *, borrow: bool) -> None:
        """Start a run: the readers first, then the chips; the chip that triggers the other starts last."""
        # A waiting frame occupies a receive buffer only when buffers are borrowed.
        pending = {"pending": max(self.config.buffers // 3, 2)} if borrow else {}
        self.matcher.begin(sole=self.config.trigger == "software", **pending)
        self._running = True
        for n, reader in enumerate(self.readers):
            reader.start(lambda frame, n=n: self._match(n, frame, deliver), borrow=borrow)  # type: ignore[misc]
        for device in reversed(self._devices.values()):
            device.set("AcquisitionStart", 1)

    def _match(self, chip: int, frame: Frame, deliver: Callable[[Any], None]) -> None:
        with self._pairing:
            matches = self.matcher.push(chip, frame.stamp, frame)
            offset_ns = self.matcher.host_offset_ns
            for frames in matches:
                deliver(self._made(frames, offset_ns))

    def _made(self, frames: tuple[Stamped[Frame], ...], offset_ns: int) -> AnyShot | ChipImage:
        first = frames[0]
        stamps = {chip: _in_utc(frame.stamp) for chip, frame in zip(self.chips, frames, strict=True)}
        time_us = HOST_CLOCK.utc_ns(first.stamp.device_ns + offset_ns) // 1000
        stamp = Stamp(first.number, time_us, self.name, stamps)
        kind = self.readers[0].agreed.format
        pixels = first.item.pixels
        if not self._shots:
            return ChipImage(pixels, kind.name, kind.full_scale, kind.bayer, stamp)
        images = {"raw": pixels} if kind.bayer is not None else split_colours(pixels)
        if len(frames) == len(CHIPS):
            images["ir"] = frames[1].item.pixels
        return shot_of(images, kind.full_scale, bayer=kind.bayer, stamp=stamp)

    @property
    def name(self) -> str:
        """Name of the camera, for messages."""
        return self.places[0].name

    def trigger(self) -> None:
        """Trigger one exposure."""
        profiles.trigger(self.device(0))

    def stop(self, *, lost: bool = False) -> None:
        """End the run; send no command to a lost camera, because its timeout takes seconds."""
        if not self._running:
            return
        self._running = False
        with suppress(CameraError):
            for device in self._devices.values() if not lost else ():
                device.set("AcquisitionStop", 1)
        for reader in self.readers:
            reader.quit()
        for reader in self.readers:
            reader.stop()
        self.matcher.end()

    def lost(self, silent_s: float) -> CameraLostError | None:
        """Ping the devices of chips silent for `silent_s`; return the error of one that does not answer."""
        now = time.monotonic()
        for n, reader in enumerate(self.readers):
            device = self.device(n)
            if now - reader.heard > silent_s and not (device.answers() and device.controlled):
                return CameraLostError(
                    f"camera at {device.where} ({self.chips[n]} chip) no longer answers: check power, cable and "
                    "network, "
                    "and that no other program took it over; the next call reconnects"
                )
        return None

    def too_large(self, chip: int) -> TooLarge | None:
        """Stop, and return the packet size of a chip unless such packets arrive; the link cannot start again."""
        self.stop()
        with suppress(CameraError):  # the failure of the frames is reported, not that of the search for its cause
            return self.device(chip).too_large(self.places[chip].stream)
        return None

    def forget(self, *, lost: bool = False) -> None:
        """Close streams and devices; a thread closes those of a lost camera, because Aravis waits for seconds."""
        held = [part for device in self._devices.values() for part in device.give_up()]
        held += [part for reader in self.readers for part in reader.give_up()]
        self.readers.clear()
        self._devices.clear()
        if lost:
            threading.Thread(target=held.clear, name="closing a camera").start()
        else:
            held.clear()  # drops the streams, which are last, before the devices that they use


def _in_utc(stamp: FrameStamp) -> FrameStamp:
    return replace(stamp, arrival_ns=HOST_CLOCK.utc_ns(stamp.arrival_ns))


def _patiently(connect: Callable[[], tuple[Place, ...]], patience_s: float) -> tuple[Place, ...]:
    deadline = time.monotonic() + patience_s
    while True:
        try:
            return connect()
        except (CameraBusyError, CameraNotFoundError, CameraLostError):
            if time.monotonic() > deadline:
                raise
            time.sleep(RETRY_S)


def _agreed(device: Device) -> Agreed:
    return Agreed(format_named(device.get("PixelFormat")), int(device.get("Width")), int(device.get("Height")))


def _check(visible: Agreed, infrared: Agreed | None = None) -> None:
    if visible.format.bayer is None and visible.format.colours != 3:
        raise CameraError(
            f"visible chip: expected a colour format, got {visible.format.name}; set a Bayer format or RGB8"
        )
    if infrared is None:
        return
    if infrared.format.bayer is not None or infrared.format.colours != 1:
        raise CameraError(f"infrared chip: expected a monochrome format, got {infrared.format.name}; set a Mono format")
    if visible.format.bits != infrared.format.bits:
        raise CameraError(
            f"visible {visible.format.name} and infrared {infrared.format.name} have different full scales; set "
            "pixel_format of both chips to the same number of bits"
        )
    if (visible.width, visible.height) != (infrared.width, infrared.height):
        raise CameraError(
            f"visible {visible.width} x {visible.height} and infrared {infrared.width} x {infrared.height} pixels; set "
            "Width and Height of both chips to the same region"
        )
