"""`quadfringe camera`: the cameras of a bench."""

from __future__ import annotations

from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._output import JsonOption, complain, say, write_record

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from quadfringe.config import SystemConfig
    from quadfringe.devices import Devices
    from quadfringe.devices.aravis import ChipCamera

__all__ = ["app"]

app = typer.Typer(name="camera", help="The cameras of a bench.", no_args_is_help=True)

FAILED = 1
Camera = Annotated[
    str, typer.Argument(metavar="CAMERA", help="aravis:NAME, aravis: for the only one, virtual:, or a system file.")
]


class Chip(StrEnum):
    """One chip of a camera."""

    visible = "visible"
    infrared = "infrared"


OneChip = Annotated[
    Chip | None,
    typer.Option(help="This chip alone, also of a camera that has but one, with aravis: or the system file of one."),
]


def _system(camera: str) -> SystemConfig:
    """Give the system of a word such as aravis:NAME, or of a system file."""
    from quadfringe.config import SystemConfig, load_system
    from quadfringe.config.cameras import capture_config

    if camera.endswith(".toml"):
        return load_system(Path(camera))
    return SystemConfig(capture=capture_config(camera))


def _opened(camera: str) -> Devices:
    from quadfringe.devices import open_devices

    return open_devices(_system(camera))


def _one_chip(camera: str, chip: Chip) -> ChipCamera:
    from quadfringe.config.cameras import AravisConfig
    from quadfringe.devices.aravis import ChipCamera
    from quadfringe.errors import InputError

    capture = _system(camera).capture
    if not isinstance(capture, AravisConfig):
        raise InputError(f"--chip is for cameras through Aravis, and {camera} is of kind {capture.kind}")
    return ChipCamera(capture, chip.value)


@app.command("list")
def list_cameras() -> None:
    """List the devices that answer; a JAI 2CCD camera is two of them, with one serial number."""
    from quadfringe.devices.aravis import found

    devices = found()
    for device in devices:
        say(f"{device.where}  {device.vendor} {device.model}  serial number {device.serial}")
    if not devices:
        complain("no camera answers; check power and cable, and that this host has an address in the camera's subnet")
        raise typer.Exit(FAILED)


@app.command()
def info(
    camera: Camera = "aravis:",
    chip: OneChip = None,
    json: JsonOption = None,
) -> None:
    """Open a camera and tell its settings as the camera took them."""
    if chip is not None:
        with _one_chip(camera, chip) as opened:
            name, taken = opened.name, opened.config
    else:
        devices = _opened(camera)
        with closing(devices.projector), devices.camera as both:
            name, taken = both.name, devices.config.capture  # type: ignore[assignment]
    settings = taken.model_dump(mode="json", exclude_none=True)
    say(name, json)
    for key, value in settings.items():
        say(f"  {key} = {value}", json)
    if json is not None:
        write_record({"name": name, "capture": settings}, json)


@app.command()
def snap(
    camera: Camera = "aravis:",
    out: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Where the images go.")] = Path("shot"),
    chip: OneChip = None,
    timeout_s: Annotated[
        float | None, typer.Option("--timeout", min=0.0, metavar="S", help="How long to wait for the shot.")
    ] = None,
) -> None:
    """Take one shot: raw.png and ir.png of a Bayer chip, else red.png, green.png, blue.png and ir.png.

    Of one chip alone: visible.png or infrared.png, a mosaic as it was read out.
    """
    from quadfringe.data.shot_files import write_shot
    from quadfringe.files import folder_for
    from quadfringe.io.images import write_image

    if chip is not None:
        with _one_chip(camera, chip) as opened:
            image = opened.snap(timeout_s)
        path = folder_for(out) / f"{chip.value}.png"
        write_image(path, image.pixels)
        _say_image(path, image.pixels, image.full_scale, f", {image.pixel_format}")
        return
    devices = _opened(camera)
    with closing(devices.projector), devices.camera as both:
        devices.projector.show(devices.config.fringes)
        shot = both.snap(timeout_s)
    for name, path in write_shot(folder_for(out), shot).items():
        _say_image(path, shot.images[name], shot.full_scale_value)


def _say_image(path: Path, image: NDArray[Any], full_scale: float, more: str = "") -> None:
    height, width = image.shape[:2]
    say(f"{path}: {width} x {height}, {image.dtype}, up to {full_scale:g}{more}")
