"""`quadfringe projector`: control the LightCrafter 4500 projectors of a bench, and show fringes on any projector."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quadfringe.cli._output import complain, say
from quadfringe.cli._screens import say_outputs, say_picture_modes
from quadfringe.errors import InputError

if TYPE_CHECKING:
    from quadfringe.config import ProjectorConfig, SystemConfig
    from quadfringe.devices.lightcrafter import LightCrafter

__all__ = ["app"]

app = typer.Typer(
    name="projector",
    help="The projectors of a bench: LightCrafter 4500, and screens of kind hdmi.",
    no_args_is_help=True,
)

FAILED = 1
PortOption = Annotated[
    str | None,
    typer.Option("--port", metavar="BUS-PORT", help="USB port of the projector, such as 1-2; default: the only one."),
]
SystemOption = Annotated[
    Path | None,
    typer.Option(
        "--system", metavar="FILE", help="System file with a [projectors] table, .toml: acts on both projectors."
    ),
]


@contextmanager
def _devices() -> Iterator[None]:
    """Exit with status 1 for a device error; bad input exits with 2, as in every command."""
    try:
        yield
    except OSError as error:
        complain(str(error))
        raise typer.Exit(FAILED) from error


def _system(file: Path) -> SystemConfig:
    from quadfringe.config import load_system

    config = load_system(file)
    if config.projectors is None:
        raise InputError(
            f"{file}: no [projectors] table, so its fringes belong to the virtual bench (quadfringe simulate); add a "
            'table for each projector, such as [projectors.visible] with port = "1-1"'
        )
    return config


def _lightcrafters(config: SystemConfig, file: Path) -> tuple[ProjectorConfig, ProjectorConfig]:
    assert config.projectors is not None
    both = config.projectors.lightcrafters
    if both is None:
        raise InputError(
            f"{file}: its projector is of kind hdmi, which takes no commands; its light is shown by "
            f"quadfringe projector show --system {file}, which stays open"
        )
    return both


def _chosen(which: ProjectorConfig | str | None) -> LightCrafter:
    from quadfringe.devices.lightcrafter import LightCrafter, open_device

    return LightCrafter(which) if which is None or isinstance(which, str) else open_device(which)


def _selected(port: str | None, system: Path | None) -> Sequence[ProjectorConfig | str | None]:
    """Return the selected projectors: the one at a port, the only one, or both of a system."""
    if system is None:
        return [port]
    if port is not None:
        raise InputError("--port selects one projector and --system both; give one of them")
    return _lightcrafters(_system(system), system)


def _each(port: str | None, system: Path | None, act: Callable[[LightCrafter], object]) -> None:
    """Call `act` with every selected projector, also after one of them failed."""
    failed = False
    for one in _selected(port, system):
        try:
            with _chosen(one) as device:
                act(device)
        except OSError as error:
            complain(str(error))
            failed = True
    if failed:
        raise typer.Exit(FAILED)


@app.command("list")
def list_projectors() -> None:
    """List the projectors by USB port, because all of them may have the same serial number."""
    from quadfringe.devices.lightcrafter import lightcrafters

    with _devices():
        found = lightcrafters()
    for port, address, serial in found:
        name = "no permission: run quadfringe projector doctor" if serial is None else f"serial number {serial}"
        say(f"port {port}  address {address}  {name}")
    if not found:
        complain("no LightCrafter 4500 is connected; check the power and the USB cable")
        raise typer.Exit(FAILED)


@app.command()
def screens() -> None:
    """List the screens of the computer, and the projectors whose patterns they can carry."""
    if not say_outputs():
        raise typer.Exit(FAILED)


@app.command()
def status(port: PortOption = None, system: SystemOption = None) -> None:
    """Print the state of the projectors and their faults."""
    _each(port, system, _report)


def _report(device: LightCrafter) -> list[str]:
    state = device.status()
    firmware = device.versions()["application"]
    say(f"port {device.port}: {state['run']}, mode {state['mode']}, power {state['power']}, input {state['input']}")
    say(f"  firmware {firmware} ({device.firmware_tag()}), {device.flash_image_count()} images in flash")
    video = state["video"] if state["mode"] == "video" else "not monitored in pattern mode"
    say(f"  video: {video}; LED drive (red, green, blue) {' '.join(map(str, device.led_drive()))}")
    for fault in state["faults"]:
        say(f"  fault: {fault}")
    return state["faults"]


@app.command()
def show(
    system: SystemOption = None,
    port: PortOption = None,
    flash_image: Annotated[
        int | None,
        typer.Option(
            "--flash-image", metavar="N", help="Show this image of the flash memory, counted from 0, and return."
        ),
    ] = None,
    test_pattern: Annotated[
        str | None,
        typer.Option(
            "--test-pattern", metavar="NAME", help="Show this built-in test pattern, such as checkerboard, and return."
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=0.0, help="Show the fringes for this time, s; default: until Ctrl-C."),
    ] = None,
) -> None:
    """Show the fringes of a system on both of its projectors, or a still image on one projector."""
    if sum(choice is not None for choice in (system, flash_image, test_pattern)) != 1:
        raise InputError("give one of --system, --flash-image and --test-pattern")
    if system is not None and port is not None:
        raise InputError(
            "--port is for --flash-image and --test-pattern; --system names both ports, so leave --port out"
        )
    if system is None and seconds is not None:
        raise InputError("--seconds is for --system; a still image stays, so leave --seconds out")
    with _devices():
        if system is not None:
            _show_fringes(_system(system), seconds)
        else:
            _show_still(port, flash_image, test_pattern)


def _show_fringes(config: SystemConfig, seconds: float | None) -> None:
    from quadfringe.devices import open_projector

    projector = open_projector(config)
    try:
        say_picture_modes(projector)
        projector.show(config.fringes)
        say("showing; stop with Ctrl-C" if seconds is None else f"showing for {seconds:g} s")
        _rest(seconds)
    finally:
        projector.close()


def _rest(seconds: float | None) -> None:
    if seconds is not None:
        time.sleep(seconds)
        return
    try:
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        say("stopped")


def _show_still(port: str | None, flash_image: int | None, test_pattern: str | None) -> None:
    with _chosen(port) as device:
        if flash_image is not None:
            device.show_flash_image(flash_image)
        elif test_pattern is not None:
            device.show_test_pattern(test_pattern)
        say(f"port {device.port}: shown")


@app.command()
def start(port: PortOption = None, system: SystemOption = None) -> None:
    """Resume after a pause; with --system, start the patterns in flash memory and leave them running."""
    if system is None:
        with _devices(), _chosen(port) as device:
            device.start()
            say(f"port {device.port}: running")
        return
    if port is not None:
        raise InputError("--port selects one projector and --system both; give one of them")
    with _devices():
        _start_from_flash(_system(system), system)


def _start_from_flash(config: SystemConfig, file: Path) -> None:
    from quadfringe.devices.lightcrafter import ProjectorPair

    if any(one.hdmi is not None for one in _lightcrafters(config, file)):
        raise InputError(f"{file}: HDMI needs a window that stays open; use quadfringe projector show --system {file}")
    assert config.projectors is not None
    pair = ProjectorPair(config.projectors)
    try:
        pair.show(config.fringes)
    except BaseException:
        pair.close()
        raise
    pair.release()
    say("running on both projectors")


@app.command()
def pause(port: PortOption = None, system: SystemOption = None) -> None:
    """Freeze the current pattern."""
    _each(port, system, _pause)


def _pause(device: LightCrafter) -> None:
    device.pause()
    say(f"port {device.port}: paused")


@app.command()
def stop(port: PortOption = None, system: SystemOption = None) -> None:
    """Stop the patterns."""
    _each(port, system, _stop)


def _stop(device: LightCrafter) -> None:
    device.stop()
    say(f"port {device.port}: stopped")


@app.command()
def doctor() -> None:
    """Open every projector and examine every video output; say what is wrong and how to fix it."""
    from quadfringe.devices.lightcrafter import lightcrafters

    with _devices():
        found = lightcrafters()
    problems = 0 if found else 1
    if not found:
        complain("no LightCrafter 4500 is connected; check the power and the USB cable")
    for port, _, _ in found:
        problems += _examine(port)
    say_outputs()
    if problems:
        raise typer.Exit(FAILED)
    say("all projectors answer")


def _examine(port: str) -> int:
    """Print the problems of one projector, each with its fix, and return their number."""
    from quadfringe.devices.lightcrafter import udev_rule

    try:
        with _chosen(port) as device:
            return len(_report(device))
    except PermissionError as error:
        complain(str(error))
        file, rule = udev_rule()
        say(f"# {file}\n{rule}")
    except OSError as error:
        complain(str(error))
    return 1
