"""The process of an emulated camera: it reads one order per line from stdin and answers each on stdout."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from quadfringe.devices.emulator import ADDRESSES, MODEL, SERIAL, keep_pace
from quadfringe.devices.emulator._camera import EmulatedCamera
from quadfringe.devices.emulator._control import Identity
from quadfringe.devices.emulator._registers import PIXEL_FORMATS
from quadfringe.devices.emulator.frames import FileFrames, Source, TestPattern

COLOUR = ("BayerRG8", *(name for name in PIXEL_FORMATS if name.startswith(("Bayer", "RGB")) and name != "BayerRG8"))
GREY = tuple(name for name in PIXEL_FORMATS if name.startswith("Mono"))


def _identities(model: str, serial: str, addresses: list[str]) -> list[Identity]:
    if model == "two-streams":
        return [Identity("quadfringe", "TWO-STREAMS", serial, addresses[0], COLOUR + GREY, streams=2)]
    vendor = "JAI Ltd., Japan"
    formats = (COLOUR, GREY)
    return [Identity(vendor, f"{MODEL}_#{n}", serial, addresses[n], formats[n]) for n in (0, 1)]


def main() -> None:
    """Run the camera until stdin ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--model", choices=["jai", "two-streams"], default="jai")
    parser.add_argument("--serial", default=SERIAL)
    parser.add_argument("--addresses", nargs=2, default=list(ADDRESSES))
    parser.add_argument("--size", default="1024x768")
    parser.add_argument("--clock", nargs=2, type=float, default=[0.0, 0.0])
    parser.add_argument("--frames", type=Path)
    options = parser.parse_args()
    width, height = (int(part) for part in options.size.split("x"))
    source: Source = TestPattern((height, width)) if options.frames is None else FileFrames(options.frames)
    devices = _identities(options.model, options.serial, options.addresses)
    keep_pace()
    try:
        camera = EmulatedCamera(devices, source, clocks=tuple(options.clock))
    except OSError as error:
        print(f"error: {error}", flush=True)
        sys.exit(1)
    print("ready", flush=True)
    for line in sys.stdin:
        try:
            print(camera.order(line.split()), flush=True)
        except ValueError as error:
            print(f"error: {error}", flush=True)


main()
