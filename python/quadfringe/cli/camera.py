"""`quadfringe camera`: the cameras of a bench."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli.output import JsonOption, complain, say, write_record

if TYPE_CHECKING:
    from quadfringe.devices import Devices

__all__ = ["app"]

app = typer.Typer(name="camera", help="The cameras of a bench.", no_args_is_help=True)

FAILED = 1
Camera = Annotated[
    str, typer.Argument(metavar="CAMERA", help="aravis:NAME, aravis: for the only one, virtual:, or a system file.")
]


def _opened(camera: str) -> Devices:
    """Open the camera of a word such as aravis:NAME, or that of a system file."""
    from quadfringe.capture import capture_config
    from quadfringe.config import SystemConfig, load_system
    from quadfringe.devices import open_devices

    if camera.endswith(".toml"):
        return open_devices(load_system(Path(camera)))
    return open_devices(SystemConfig(capture=capture_config(camera)))


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
    json: JsonOption = None,
) -> None:
    """Open a camera and tell its settings as the camera took them."""
    devices = _opened(camera)
    with closing(devices.projector), devices.camera as opened:
        settings = devices.config.capture.model_dump(mode="json", exclude_none=True)
        say(opened.name, json)
        for name, value in settings.items():
            say(f"  {name} = {value}", json)
        if json is not None:
            write_record({"name": opened.name, "capture": settings}, json)


@app.command()
def snap(
    camera: Camera = "aravis:",
    out: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Where the images go.")] = Path("shot"),
    timeout_s: Annotated[
        float | None, typer.Option("--timeout", min=0.0, metavar="S", help="How long to wait for the shot.")
    ] = None,
) -> None:
    """Take one shot: raw.png and ir.png of a Bayer chip, else red.png, green.png, blue.png and ir.png."""
    from quadfringe.files import folder_for
    from quadfringe.shots import write_shot

    devices = _opened(camera)
    with closing(devices.projector), devices.camera as opened:
        devices.projector.show(devices.config.fringes)
        shot = opened.snap(timeout_s)
    for name, path in write_shot(folder_for(out), shot).items():
        height, width = shot.images[name].shape
        say(f"{path}: {width} x {height}, {shot.images[name].dtype}, up to {shot.full_scale_value:g}")
