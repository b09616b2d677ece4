"""Draw the pictures of README and docs from the virtual bench; `make figures` runs this.

    python docs/draw_pictures.py

The picture of the live page needs chromium (`make test-live` installs it) and stays as it is without.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe.data import AnyShot
from quadfringe.evaluation._page import Page
from quadfringe.evaluation.demo import live_system
from quadfringe.view.movie import solid_picture
from quadfringe.view.viewer import Viewer

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs" / "images"
HALF_PX = (560, 420)  # width and height of each half of the picture of the README
CLAY, SLATE = (222, 202, 178), (104, 114, 128)  # of the face and of the wall behind it
WALL_MM = 797.0  # points beyond it belong to the wall
VIEW_DEG = (27.0, -7.0)  # yaw and pitch
FINER = 2
PAGE_S = 20.0  # until chromium without a graphics card has drawn the page


def main() -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="face", noise=0.03))) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    draw_shot_and_shape(PICTURES / "shot_to_shape.jpg", shot, shape)
    if shutil.which("chromium") is not None:
        draw_page(PICTURES / "live.png")


def draw_shot_and_shape(path: Path, shot: AnyShot, shape: qf.Shape) -> None:
    """Draw a shot, half in visible light and half in infrared, beside the surface decoded from it."""
    joined = cv2.cvtColor(np.hstack([fringes(shot), solid(shape)]), cv2.COLOR_RGB2BGR)
    cv2.imwrite(str(path), joined, [cv2.IMWRITE_JPEG_QUALITY, 88])


def fringes(shot: AnyShot) -> NDArray[np.uint8]:
    """Give the visible image left of the middle and the infrared one right of it, with their names."""
    images = {name: cv2.resize(image, HALF_PX, interpolation=cv2.INTER_AREA) for name, image in shot.channels.items()}
    picture = np.stack([images["red"], images["green"], images["blue"]], axis=2)
    middle = HALF_PX[0] // 2
    picture[:, middle:] = images["ir"][:, middle:, None]
    picture[:, middle - 1 : middle + 1] = 255
    for x, words in ((12, "red, green, blue"), (middle + 12, "infrared")):
        picture[HALF_PX[1] - 34 : HALF_PX[1] - 8, x - 6 : x + 9 * len(words) + 6] //= 4
        place = (x, HALF_PX[1] - 15)
        cv2.putText(picture, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.55, (255, 255, 255), 1, cv2.LINE_AA)
    return picture


def solid(shape: qf.Shape) -> NDArray[np.uint8]:
    """Render the surface, turned and lit. Points are interpolated, so that no gaps open where it is turned away."""
    assert shape.xyz_mm is not None
    height, width = shape.phase_rad.shape
    dense = cv2.resize(shape.xyz_mm, (FINER * width, FINER * height))  # no data spreads to the neighbours
    maps = {name: np.zeros(dense.shape[:2], np.float32) for name in ("phase_rad", "column_px", "modulation", "quality")}
    colours = np.where(dense[:, :, 2:] < WALL_MM, CLAY, SLATE).astype(np.uint8)
    size_px = (FINER * HALF_PX[0], FINER * HALF_PX[1])
    picture = solid_picture(qf.Shape(**maps, xyz_mm=dense), colours, turn_deg=VIEW_DEG, size_px=size_px, field_mm=330)
    return cv2.resize(picture, HALF_PX, interpolation=cv2.INTER_AREA)


def draw_page(path: Path) -> None:
    """Take a picture of the page of `quadfringe live`, with the hand on it."""
    with (
        qf.open(live_system()) as scanner,
        scanner.stream(4, keep="all") as stream,
        Viewer(port=8700, stride=1, drawn="surface") as viewer,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        closing(Page(folder)) as page,
    ):
        page.ask("Page.navigate", url=viewer.url)
        viewer.follow(stream, columns=scanner.calibration.projector.width_px)
        time.sleep(PAGE_S)
        page.value("document.querySelectorAll('.mantine-Notification-closeButton').forEach(cross => cross.click()); 0")
        time.sleep(PAGE_S / 4)
        page.picture(path)


if __name__ == "__main__":
    main()
