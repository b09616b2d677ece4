"""The page of the live view: the shape, the pictures and the figures, and no request that leaves the machine."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.pages import painted, picture, shape_on, still_shape_on, until

import quadfringe as qf
from quadfringe.recording import Recorder, Recording
from quadfringe.view.viewer import Viewer

SMALL_HAND = """
capture = { kind = "virtual", frame_rate_hz = 8 }

[camera]
width_px = 320
height_px = 240
focal_px = [806.0, 806.0]
centre_px = [159.5, 119.5]

[scene]
surface = "hand"
albedo = [0.92, 0.7, 0.58, 0.85]
noise = 0.01

[decode]
method = "published"
"""


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("hand") / "system.toml"
    path.write_text(SMALL_HAND)
    return path


@contextmanager
def live(system: Path, **settings: Any) -> Iterator[tuple[Viewer, Recorder]]:
    """A scanner that measures continuously, its page and its recorder, until the block ends."""
    with qf.open(system) as scanner, Viewer(port=8230, **settings) as viewer:
        recorder = Recorder(system.parent / f"{time.time_ns()}.h5", scanner.config, scanner.calibration)
        with recorder, scanner.stream(taps={"record": recorder.write}) as stream:
            follower = threading.Thread(target=viewer.follow, args=(stream, recorder.statistics))
            follower.start()
            try:
                yield viewer, recorder
            finally:
                stream.close()
                follower.join()


def figures(page: Any) -> dict[str, str]:
    rows = page.locator("table tr").all_inner_texts()
    return dict(row.split("\t", 1) for row in rows if "\t" in row)


def test_the_page_shows_a_moving_shape(browser: Any, system: Path, tmp_path: Path) -> None:
    asked: list[str] = []
    with live(system, stride=2) as (viewer, recorder):
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.on("request", lambda request: asked.append(request.url))
        page.goto(viewer.url)
        until(lambda: float(figures(page).get("decoded", "0 /s").split()[0]) or None, "no rate on the page")
        first = until(lambda: shape_on(page), "no shape")
        shown = painted(first)
        assert shown[150:350, 300:500].mean() > 0.3, "the shape is not in the middle"
        until(lambda: moved if (moved := np.abs(picture(page) - first)[shown].mean()) > 3 else None, "nothing moves")
        assert page.locator("img").count() >= 2
        assert set(figures(page)) >= {"captured", "decoded", "queue decode", "queue view", "queue record", "recorded"}
        assert page.get_by_text("Share").count() == 0
        (Path(os.environ.get("QUADFRINGE_SHOTS", tmp_path)) / "live.png").write_bytes(page.screenshot())
        page.close()
    hosts = {url.split("/")[2].split(":")[0] for url in asked if url.startswith(("http", "ws"))}
    assert hosts == {"127.0.0.1"}
    done = recorder.statistics()
    with Recording(done.files[0]) as take:
        assert len(take) == done.written > 0
        assert done.refused == 0


def test_the_page_shows_a_shaded_surface(browser: Any, tmp_path: Path) -> None:
    camera = qf.Device(width_px=320, height_px=240, focal_px=(806.0, 806.0), centre_px=(159.5, 119.5))
    scene = qf.SceneConfig(surface="face", albedo=(0.92, 0.7, 0.58, 0.85))
    with qf.open(qf.SystemConfig(camera=camera, scene=scene)) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    relief = {}
    for drawn in ("surface", "points"):
        with Viewer(port=8245, stride=1, drawn=drawn) as viewer:  # type: ignore[arg-type]
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(viewer.url)
            until(lambda viewer=viewer: viewer._server.get_clients() or None, "no page")
            for _ in range(2):  # the second takes the place of the first
                viewer.show_shape(shot, shape)
            until(lambda page=page: painted(picture(page)).mean() > 0.2 or None, "no shape")
            time.sleep(2.0)
            image = picture(page)
            (Path(os.environ.get("QUADFRINGE_SHOTS", tmp_path)) / f"live-{drawn}.png").write_bytes(page.screenshot())
            relief[drawn] = brightness_steps(image)
            page.close()
    print(relief)
    assert relief["surface"] > 1.5 * relief["points"], "light and shade show the relief"


def brightness_steps(image: np.ndarray) -> float:
    """How much the brightness of the middle of the shape varies, in grey levels."""
    middle = image[200:400, 300:500]
    return float(middle.mean(axis=2)[painted(image)[200:400, 300:500]].std())


def test_colours_follow_the_choice(browser: Any, system: Path) -> None:
    with qf.open(system) as scanner, scanner.stream(1) as stream:
        measured = next(iter(stream))
    seen = {}
    for colouring in ("texture", "height", "quality", "uncertainty"):
        with Viewer(port=8235, colouring=colouring) as viewer:  # type: ignore[arg-type]
            viewer.show(measured)  # before any page is open
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(viewer.url)
            image = until(lambda page=page: still_shape_on(page), "no shape")
            vivid = np.ptp(image, axis=2)
            seen[colouring] = image[vivid >= np.quantile(vivid[painted(image)], 0.8)].mean(axis=0)
            page.close()
    assert np.abs(seen["texture"] - seen["height"]).max() > 20
    assert np.abs(seen["height"] - seen["quality"]).max() > 20
    assert np.abs(seen["quality"] - seen["uncertainty"]).max() > 20


def test_only_this_machine_is_served_unless_asked() -> None:
    with Viewer(port=8240) as viewer:
        port = int(viewer.url.rsplit(":", 1)[1])
        assert viewer.url.startswith("http://127.0.0.1:")
        listening = [
            line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:] if line.split()[3] == "0A"
        ]
        assert f"0100007F:{port:04X}" in listening
        assert f"00000000:{port:04X}" not in listening
        with socket.create_connection(("127.0.0.1", port), timeout=5) as guest:
            guest.shutdown(socket.SHUT_WR)
            while guest.recv(4096):  # until the server has closed: its event loop ends with the viewer
                pass
    with pytest.raises(OSError, match=r".*"), socket.create_connection(("127.0.0.1", port), timeout=1):
        pass


def test_a_shot_without_a_shape_says_why(system: Path) -> None:
    from quadfringe.errors import DecodeError
    from quadfringe.scanner.streaming import Measured

    with qf.open(system) as scanner, Viewer(port=8250) as viewer:
        viewer.show(Measured(scanner.grab(), None, DecodeError("channel ir is black"), 7.0))
        with scanner.stream(1) as stream:
            list(stream)
            viewer.show_figures(stream.statistics())
        assert "channel ir is black" in viewer._figures.content
        assert "| decoded |" in viewer._figures.content
