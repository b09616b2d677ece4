"""The report in a real browser: the surface turns without network, and the page reads without programs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadfringe as qf
from quadfringe.data import Calibration
from quadfringe.view.page import write_page

EVIL = '</script><script>window.taken=1</script><img src=x onerror="window.taken=1">'
BUTTON = "button[data-layer='{}']"


@pytest.fixture(scope="module")
def page_file(bench: tuple[qf.Shot, Calibration], tmp_path_factory: pytest.TempPathFactory) -> Path:
    shot, calibration = bench
    shape = qf.decode(shot, qf.Plan(912, calibration=calibration))
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_page(path, replace(shape, config={**shape.config, "warnings": [EVIL], EVIL: EVIL}), EVIL)
    return path


def picture(view: Any) -> np.ndarray[Any, Any]:
    import cv2

    found = cv2.imdecode(np.frombuffer(view.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert found is not None
    return found.astype(np.int32)


def test_the_surface_turns_moves_and_changes_its_colours(browser: Any, page_file: Path) -> None:
    context = browser.new_context(viewport={"width": 1000, "height": 800}, offline=True)
    page = context.new_page()
    told: list[str] = []
    page.on("console", lambda message: told.append(message.text))
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("request", lambda request: told.append(request.url) if request.url[:5] not in ("file:", "data:") else None)
    page.goto(page_file.as_uri())
    view = page.locator("#view")
    view.wait_for(state="visible")
    assert not page.locator("#stage img").is_visible()
    pictures = [picture(view)]
    assert len(np.unique(pictures[0].reshape(-1, 3), axis=0)) > 50
    box = view.bounding_box()
    page.mouse.move(box["x"] + 400, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 500, box["y"] + 240, steps=3)
    page.mouse.up()
    pictures.append(picture(view))
    page.mouse.wheel(0, -400)
    page.wait_for_timeout(100)
    pictures.append(picture(view))
    for act in (lambda: view.press("ArrowLeft"), page.locator(BUTTON.format(2)).click, page.locator("#home").click):
        act()
        pictures.append(picture(view))
    for before, after in pairwise(pictures):
        assert (np.abs(after - before).max(axis=2) > 20).sum() > 1000
    assert page.locator(BUTTON.format(2)).get_attribute("aria-pressed") == "true"
    assert told == []
    assert page.evaluate("window.taken") is None
    context.close()


def test_without_programs_a_still_picture_is_shown(browser: Any, page_file: Path) -> None:
    context = browser.new_context(java_script_enabled=False, offline=True)
    page = context.new_page()
    page.goto(page_file.as_uri())
    assert page.locator("#stage img").is_visible()
    assert not page.locator("#view").is_visible()
    assert not page.locator("#controls").is_visible()
    assert page.locator("#pictures img").count() >= 6
    context.close()
