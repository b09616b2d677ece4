"""Every projector keeps the protocol; the pair of a system file shows its fringes by HDMI and from flash."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result
from usb_bench import Screen

from quadfringe.cli import app
from quadfringe.config import Fringes, SystemConfig, load_system
from quadfringe.devices import Projector, open_projector
from quadfringe.devices.light import projector_images
from quadfringe.devices.lightcrafter import LightCrafter, ProjectorPair, outputs, udev_rule
from quadfringe.evaluation._testbed import Order


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["projector", *(str(a) for a in arguments)])


@pytest.fixture(params=["virtual", "system", "flash_system", "hdmi_system"])
def projector(request: pytest.FixtureRequest) -> Iterator[Projector]:
    """Every implementation of the protocol: virtual, HDMI with flash, flash alone, a screen without commands."""
    virtual = request.param == "virtual"
    config = SystemConfig() if virtual else load_system(request.getfixturevalue(request.param))
    opened = open_projector(config)
    yield opened
    opened.close()


@pytest.mark.usefixtures("screen")
def test_every_projector_keeps_the_contract(projector: Projector) -> None:
    fringes = Fringes()
    projector.show(fringes)
    projector.show(fringes)
    with pytest.raises(ValueError, match="fringe"):
        projector.show(Fringes(numbers=(16, 8, 4)))
    projector.show(fringes)
    projector.close()
    projector.close()


def test_any_projector_is_pixel_exact(screen: Screen, hdmi_system: Path) -> None:
    config = load_system(hdmi_system)
    projector = open_projector(config)
    projector.show(config.fringes)
    np.testing.assert_array_equal(screen.rgb(), projector_images(config.fringes.numbers, (912, 1140), "regular")[0])
    projector.close()
    hdmi_system.write_text(hdmi_system.read_text().replace("912, 1140", "1280, 720"))
    with pytest.raises(ValueError, match="no active output is 1280 x 720 and unscaled"):
        open_projector(load_system(hdmi_system))
    done = run("screens")
    assert done.exit_code == 0
    assert re.search(r"912 x 1140.*, fit for patterns; fit for kind = .hdmi. with size_px = \[912, 1140\]", done.stdout)
    done = run("show", "--system", hdmi_system)
    assert done.exit_code == 2
    assert "outputs: screen (912 x 1140 pixels)" in done.stderr


def test_the_pair_shows_its_fringes(screen: Screen, system: Path) -> None:
    config = load_system(system)
    assert config.projectors is not None
    with ProjectorPair(config.projectors) as pair:
        for fringes in (config.fringes, Fringes(layout="regular")):
            pair.show(fringes)
        np.testing.assert_array_equal(screen.rgb(), projector_images(config.fringes.numbers, (912, 1140), "regular")[0])
        for one in (pair.visible, pair.infrared):
            assert one.device.status()["running"]
        assert pair.infrared.device.led_drive() == (40, 0, 0)
        with pytest.raises(ValueError, match=r"flash image 2 holds fringes 36 35 30 .*not 49 48 42"):
            pair.show(Fringes(numbers=(49, 48, 42)))
        pair.pause()
        pair.start()
        pair.stop()
        pair.start()
    for port in ("1-1", "1-2"):
        with LightCrafter(port) as device:
            assert device.status()["run"] == "stopped"


def test_a_pair_is_whole_or_not_at_all(order: Order, flash_system: Path) -> None:
    config = load_system(flash_system)
    order("1-2", "unplug")
    with pytest.raises(FileNotFoundError, match="port 1-2"):
        open_projector(config)
    with LightCrafter("1-1") as free:
        free.versions()
    order("1-2", "plug")
    pair = open_projector(config)
    pair.show(config.fringes)
    order("1-1", "unplug")
    with pytest.raises(ConnectionError):
        pair.close()
    with LightCrafter("1-2") as other:
        assert other.status()["run"] == "stopped", "the other one is released too"


def test_list_status_start_pause_stop(flash_system: Path) -> None:
    result = run("list")
    assert result.exit_code == 0, result.output
    assert "port 1-1" in result.stdout
    assert "port 1-2" in result.stdout
    started = run("start", "--system", flash_system)
    assert started.exit_code == 0, started.output
    result = run("status", "--system", flash_system)
    assert result.stdout.count("running, mode patterns") == 2, result.output
    assert run("pause", "--port", "1-1").exit_code == 0
    assert "port 1-1: paused" in run("status", "--port", "1-1").stdout
    assert run("start", "--port", "1-1").exit_code == 0
    assert run("stop", "--system", flash_system).exit_code == 0
    assert "port 1-1: stopped" in run("status", "--port", "1-1").stdout
    refused = run("start", "--port", "1-1")
    assert refused.exit_code == 2
    assert "load()" in refused.stderr


@pytest.mark.usefixtures("screen")
def test_show(system: Path) -> None:
    shown = run("show", "--system", system, "--seconds", "0.1")
    assert shown.exit_code == 0, shown.output
    assert run("show", "--port", "1-2", "--flash-image", "1").exit_code == 0
    assert run("show", "--port", "1-2", "--test-pattern", "grid").exit_code == 0
    for arguments, reason in [
        ([], "one of"),
        (["--system", system, "--port", "1-1"], "--port is for"),
        (["--port", "1-1", "--flash-image", "9"], "below 3"),
        (["--port", "1-1", "--test-pattern", "kittens"], "checkerboard"),
        (["--port", "1-1", "--flash-image", "1", "--seconds", "1"], "--seconds is for"),
    ]:
        refused = run("show", *arguments)
        assert refused.exit_code == 2, refused.output
        assert reason in refused.stderr
    started = run("start", "--system", system)
    assert started.exit_code == 2
    assert "HDMI needs a window" in started.stderr


@pytest.mark.usefixtures("screen")
def test_doctor_prints_the_rule(order: Order) -> None:
    result = run("doctor")
    assert result.exit_code == 0, result.output
    assert "fit for patterns" in result.stdout
    assert "all projectors answer" in result.stdout
    order("1-2", "deny")
    result = run("doctor")
    assert result.exit_code == 1
    assert udev_rule()[1] in result.stdout
    assert udev_rule()[0] in result.stdout
    assert "port 1-1" in result.stdout
    assert "no permission" in run("list").stdout
    for port in ("1-1", "1-2"):
        order(port, "unplug")
    for command in ("doctor", "list"):
        result = run(command)
        assert result.exit_code == 1
        assert "no LightCrafter 4500 is connected" in result.stderr


@pytest.mark.usefixtures("screen")
def test_the_page_on_these_projectors_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "howto" / "lightcrafter_usb.md").read_text()
    (system,) = (text for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[projectors" in text)
    ((output, *_),) = outputs()
    monkeypatch.chdir(tmp_path)
    Path("system.toml").write_text(system.replace("HDMI-1", output))
    blocks = re.findall(r"```console\n(.*?)```", page, re.DOTALL)
    (commands,) = (text for text in blocks if "quadfringe projector" in text)
    for line in commands.splitlines():
        words = line.partition("#")[0].split()
        assert words[:2] == ["quadfringe", "projector"]
        extra = ["--seconds", "0"] if words[2] == "show" else []
        result = run(*words[2:], *extra)
        assert result.exit_code == 0, (line, result.output)


def test_the_other_projector_is_stopped_when_one_is_gone(order: Order, flash_system: Path) -> None:
    for stop in ("by command", "as a pair"):
        config = load_system(flash_system)
        pair = open_projector(config)
        assert isinstance(pair, ProjectorPair)
        pair.show(config.fringes)
        if stop == "by command":
            pair.release()
        order("1-1", "unplug")
        if stop == "by command":
            result = run("stop", "--system", flash_system)
            assert result.exit_code == 1
            assert "no LightCrafter 4500 at port 1-1" in result.stderr
        else:
            with pytest.raises(ConnectionError):
                pair.stop()
            pair.release()
        assert "port 1-2: stopped" in run("status", "--port", "1-2").stdout
        order("1-1", "plug")


def test_a_projector_that_went_to_video_is_shown_again(order: Order, flash_system: Path) -> None:
    config = load_system(flash_system)
    assert config.projectors is not None
    with ProjectorPair(config.projectors) as pair:
        pair.show(config.fringes)
        pair.pause()
        order("1-1", "video appears")
        with pytest.raises(OSError, match="HDMI signal appears"):
            pair.start()
        pair.show(config.fringes)
        assert pair.visible.device.status()["running"]


def test_a_device_error_is_a_failed_run(order: Order) -> None:
    order("1-1", "fault silence 2")
    result = run("status", "--port", "1-1")
    assert result.exit_code == 1
    assert "did not answer" in result.stderr
    assert run("status").exit_code == 2, "ambiguous: the caller has to choose"
    code = "from quadfringe.devices.lightcrafter import lightcrafters; import json; print(json.dumps(lightcrafters()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert [port for port, _, _ in json.loads(done.stdout)] == ["1-1", "1-2"]
