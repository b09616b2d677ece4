"""Tests in the umockdev testbed: `make test-usb` starts it; plain pytest leaves this folder out."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from usb_bench import Screen

from quadfringe.devices.lightcrafter import outputs
from quadfringe.evaluation._testbed import TESTBED, Order, orders

if TESTBED not in os.environ:
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="session")
def order() -> Iterator[Order]:
    """Send orders to the testbed: a port and an event."""
    with orders() as send:
        yield send


@pytest.fixture(autouse=True)
def power_on(order: Order) -> Iterator[None]:
    """Leave both projectors as after power-on."""
    yield
    for port in ("1-1", "1-2"):
        order(port, "allow")
        order(port, "video on")
        order(port, "plug")


@pytest.fixture(scope="session")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Screen:
    """An X server of 912 x 1140; DISPLAY names it for the rest of this process.

    It ends with its last client, this process: Xlib would end the process if the server went first.
    """
    folder = tmp_path_factory.mktemp("xvfb")
    (folder / "number").touch()
    plain = {name: value for name, value in os.environ.items() if name not in ("LD_PRELOAD", "UMOCKDEV_DIR")}
    server = f"Xvfb -displayfd 3 -terminate -screen 0 912x1140x24 -fbdir {folder} 3>{folder}/number &"
    subprocess.run(["sh", "-c", server], check=True, env=plain, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 20
    while not (display := (folder / "number").read_text()).endswith("\n"):
        assert time.monotonic() < deadline, "Xvfb did not start: apt-get install xvfb"
        time.sleep(0.02)
    os.environ["DISPLAY"] = f":{display.strip()}"
    os.environ.pop("WAYLAND_DISPLAY", None)
    assert len(outputs()) == 1
    return Screen(folder / "Xvfb_screen0")


SYSTEM = """
[projectors.visible]
port = "1-1"
hdmi = {}

[projectors.infrared]
port = "1-2"
leds = "r"
light = "external"
led_drive = [40, 0, 0]
led_drive_limit = [50, 0, 0]
flash = { image = 2, fringes = {} }
"""


HDMI = """
[projectors.visible]
kind = "hdmi"
size_px = [912, 1140]
settle_s = 0.0
"""


@pytest.fixture
def hdmi_system(tmp_path: Path) -> Path:
    """A system file: one projector that is a screen, without commands."""
    file = tmp_path / "hdmi.toml"
    file.write_text(HDMI)
    return file


@pytest.fixture
def system(tmp_path: Path) -> Path:
    """A system file: the visible projector by HDMI, the infrared one from flash."""
    file = tmp_path / "system.toml"
    file.write_text(SYSTEM)
    return file


@pytest.fixture
def flash_system(tmp_path: Path) -> Path:
    """A system file with both projectors from flash."""
    file = tmp_path / "flash.toml"
    file.write_text(SYSTEM.replace("hdmi = {}", "flash = { image = 0, fringes = {} }"))
    return file
