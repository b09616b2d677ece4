"""`quadfringe camera`: list cameras, show their settings, take single shots."""

from __future__ import annotations

from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from quadfringe.cli._options import JsonOption
from quadfringe.cli._output import complain, say, write_record
from quadfringe.cli._system import system_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from quadfringe.config import SystemConfig
    from quadfringe.devices import Devices
    from quadfringe.devices.aravis import ChipCamera

__all__ = ["app"]

app = typer.Typer(name="camera", help="The cameras of a bench.", no_args_is_help=True)

FAILED = 1
CameraArgument = Annotated[
    str,
    typer.Argument(
        metavar="CAMERA",
        help="aravis:NAME (vendor, model, serial number or address), aravis: for the only camera, uvc:0, files:FOLDER, "
        "virtual:, or a system file .toml.",
    ),
]


class Chip(StrEnum):
    """One chip of a 2CCD camera."""

    visible = "visible"
    infrared = "infrared"


ChipOption = Annotated[
    Chip | None,
    typer.Option(
        help="Use this chip alone, to focus it or while the other is missing; also for a camera with one chip."
    ),
]


def _system(camera: str) -> SystemConfig:
    """Return the system of a word such as aravis:NAME, or of a system file."""
    config = system_of(Path(camera), None) if camera.endswith(".toml") else system_of(None, camera)
    assert config is not None  # one of them was given
    return config


def _opened(camera: str) -> Devices:
    from quadfringe.devices import open_devices

    return open_devices(_system(camera))


def _one_chip(camera: str, chip: Chip) -> ChipCamera:
    from quadfringe.config.cameras import AravisConfig
    from quadfringe.devices.aravis import ChipCamera
    from quadfringe.errors import InputError

    capture = _system(camera).capture
    if not isinstance(capture, AravisConfig):
        raise InputError(f"--chip needs an aravis camera, but {camera} is of kind {capture.kind}; leave --chip out")
    return ChipCamera(capture, chip.value)


@app.command("list")
def list_cameras() -> None:
    """List the devices that answer; a JAI 2CCD camera appears as two devices with one serial number.

    GenICam cameras are found with the extra aravis alone, webcams on Linux alone.
    """
    from quadfringe.devices.aravis import found
    from quadfringe.devices.uvc import found as webcams_found
    from quadfringe.errors import MissingExtraError

    webcams = webcams_found()
    for webcam in webcams:
        say(f"uvc:{webcam.where}  {webcam.name}")
    try:
        devices = found()
    except MissingExtraError:
        if not webcams:
            raise
        devices = []
    for device in devices:
        say(f"{device.where}  {device.vendor} {device.model}  serial number {device.serial}")
    if not devices and not webcams:
        complain("no camera answers; check power and cable, and that this host has an address in the camera's subnet")
        raise typer.Exit(FAILED)


@app.command()
def info(camera: CameraArgument = "aravis:", chip: ChipOption = None, json: JsonOption = None) -> None:
    """Open a camera and print its settings as the camera accepted them."""
    if chip is not None:
        with _one_chip(camera, chip) as opened:
            name, accepted = opened.name, opened.config
    else:
        devices = _opened(camera)
        with closing(devices.projector), devices.camera as both:
            name, accepted = both.name, devices.config.capture  # type: ignore[assignment]
    settings = accepted.model_dump(mode="json", exclude_none=True)
    say(name, json)
    for key, value in settings.items():
        say(f"  {key} = {value}", json)
    write_record({"name": name, "capture": settings}, json)


@app.command()
def snap(
    camera: CameraArgument = "aravis:",
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Folder for the images; created when it is missing.")
    ] = Path("shot"),
    chip: ChipOption = None,
    timeout_s: Annotated[
        float | None,
        typer.Option("--timeout", min=0.0, metavar="S", help="Longest wait for the shot, s; default: of the camera."),
    ] = None,
) -> None:
    """Take one shot: write raw.png and ir.png for a Bayer chip, else red.png, green.png, blue.png and ir.png.

    With --chip, write visible.png or infrared.png, a Bayer mosaic unprocessed.
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
    say(f"{path}: {width} x {height}, {image.dtype}, full scale {full_scale:g}{more}")
