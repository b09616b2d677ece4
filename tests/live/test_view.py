"""The page of saved shapes in a browser: shaded, coloured, measured by clicks; no request leaves the machine."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.pages import painted, still_shape_on, until

import quadfringe as qf
from quadfringe.data import Shape
from quadfringe.view.saved import SavedViewer

CAMERA = qf.Device(width_px=320, height_px=240, focal_px=(806.0, 806.0), centre_px=(159.5, 119.5))


@pytest.fixture(scope="module")
def face() -> Shape:
    """A face with coloured squares on it."""
    with qf.open(qf.SystemConfig(camera=CAMERA, scene=qf.SceneConfig(surface="face", patch_mm=20))) as scanner:
        return scanner.measure()


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of screenshots."""
    return Path(os.environ.get("QUADFRINGE_SHOTS", tmp_path_factory.mktemp("shots")))


def opened(browser: Any, viewer: SavedViewer) -> Any:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(viewer.url)
    return page


@pytest.mark.parametrize("name", ["face.glb", "face.npz", "face.ply"])
def test_a_saved_face_is_seen(browser: Any, face: Shape, tmp_path: Path, shots: Path, name: str) -> None:
    face.save(tmp_path / name)
    asked: list[str] = []
    with SavedViewer([tmp_path / name], port=8560) as viewer:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.on("request", lambda request: asked.append(request.url))
        page.goto(viewer.url)
        image = until(lambda: still_shape_on(page), "no shape")
        page.get_by_text(name).wait_for()
        (shots / f"view-{name}.png").write_bytes(page.screenshot())
        page.close()
    shown = image.min(axis=2) < 240  # the page is white, and the squares are light
    assert shown[150:350, 300:500].mean() > 0.7, "the shape is not in the middle"
    assert np.ptp(image[shown], axis=1).mean() > 15, "the squares have no colours"
    hosts = {url.split("/")[2].split(":")[0] for url in asked if url.startswith(("http", "ws"))}
    assert hosts == {"127.0.0.1"}


def test_clicks_measure_and_draw_a_section(browser: Any, face: Shape, tmp_path: Path, shots: Path) -> None:
    face.save(tmp_path / "face.npz")
    with SavedViewer([tmp_path / "face.npz"], port=8565) as viewer:
        page = opened(browser, viewer)
        until(lambda: still_shape_on(page), "no shape")
        for x, y in ((420, 430), (590, 400)):
            page.mouse.click(x, y)
            time.sleep(1.0)
        page.get_by_text("distance").last.wait_for(timeout=60_000)
        page.locator(".uplot canvas").wait_for(timeout=60_000)
        time.sleep(1.0)
        (shots / "view-section.png").write_bytes(page.screenshot())
        plot = page.locator(".uplot canvas").screenshot()
        (first, second) = viewer._panel._spots
        text = page.locator("table").first.inner_text()
        page.get_by_role("button", name="Forget the points").click()
        page.get_by_text("Click the shape").wait_for(timeout=60_000)
        assert page.locator(".uplot").count() == 0
        page.close()
    assert len(plot) > 1000
    for spot in (first, second):
        assert spot.pixel is not None
        assert f"{spot.pixel[0]}, {spot.pixel[1]}" in text
    # Left and right on the page, in metres of the scene.
    assert second.place_mm[0] > first.place_mm[0]


def test_another_file_takes_the_place(browser: Any, face: Shape, tmp_path: Path) -> None:
    """A dropdown that a person uses: the page draws the other file, and the old one is gone."""
    with qf.open(qf.SystemConfig(camera=CAMERA, scene=qf.SceneConfig(surface="steps"))) as scanner:
        scanner.measure().save(tmp_path / "steps.npz")
    face.save(tmp_path / "face.npz")
    with SavedViewer([tmp_path / "face.npz", tmp_path / "steps.npz"], port=8570, colouring="height") as viewer:
        page = opened(browser, viewer)
        first = until(lambda: still_shape_on(page), "no shape")
        page.locator(f'input[role="combobox"][id="{viewer._file._impl.uuid}"]').click()
        page.get_by_role("option", name="2: steps.npz").click()
        page.get_by_text("steps.npz · 320 x 240 pixels").wait_for(timeout=60_000)
        time.sleep(2.0)
        second = until(lambda: still_shape_on(page), "no shape")
        page.close()
    assert np.abs(second - first)[painted(first)].mean() > 10
