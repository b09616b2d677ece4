"""Draw the pictures of the README from the virtual bench; `make figures` runs this.

    python docs/draw_pictures.py

The picture of the live page needs chromium (`make test-live` installs it) and stays as it is without.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LightSource
from matplotlib.figure import Figure

import quadfringe as qf
from quadfringe.evaluation._page import Page
from quadfringe.evaluation.demo import live_system
from quadfringe.view.viewer import Viewer

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs" / "images"
PAGE_S = 20.0  # until chromium without a graphics card has drawn the page


def main() -> None:
    PICTURES.mkdir(parents=True, exist_ok=True)
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="face", noise=0.03))) as scanner:
        shot = scanner.grab()
        shape = scanner.decode(shot)
    draw_fringes(PICTURES / "fringes.png", shot)
    draw_shape(PICTURES / "shape.png", shape)
    if shutil.which("chromium") is not None:
        draw_page(PICTURES / "live.png")


def draw_fringes(path: Path, shot: qf.Shot) -> None:
    """Draw the visible image and the infrared one, side by side, each cut in half."""
    full = shot.full_scale_value
    colour = np.stack([shot.red, shot.green, shot.blue], axis=2) / full
    infrared = np.repeat(shot.ir[:, :, None], 3, axis=2) / full
    middle = colour.shape[1] // 2
    joined = np.concatenate([colour[:, :middle], infrared[:, middle:]], axis=1)
    figure = Figure(figsize=(5.12, 3.84), dpi=110)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(joined, interpolation="antialiased", aspect="auto")
    axes.axvline(middle, color="white", linewidth=1.5)
    for x, words in ((0.02, "red, green, blue"), (0.52, "infrared")):
        style = {"color": "white", "fontsize": 10, "transform": axes.transAxes}
        axes.text(x, 0.03, words, bbox={"facecolor": "black", "alpha": 0.6, "edgecolor": "none"}, **style)
    axes.set_axis_off()
    figure.savefig(path)


def draw_shape(path: Path, shape: qf.Shape, stride: int = 3) -> None:
    """Draw the points as a lit surface, colour by depth."""
    assert shape.xyz_mm is not None
    x, y, z = np.moveaxis(shape.xyz_mm[::stride, ::stride], 2, 0).astype(float)
    near, far = np.nanquantile(z, (0.001, 0.999))
    height = np.clip(far - z, 0, far - near)
    light = LightSource(azdeg=315, altdeg=40)
    colour = light.shade(np.nan_to_num(height), cmap=colormaps["viridis"], vert_exag=2.0 / stride, blend_mode="soft")
    colour[np.isnan(z)] = 0
    figure = Figure(figsize=(5.12, 3.84), dpi=110)
    axes = figure.add_axes((-0.32, -0.38, 1.64, 1.76), projection="3d")
    axes.plot_surface(x, -y, height, facecolors=colour, rstride=1, cstride=1, antialiased=False, shade=False)
    axes.set_box_aspect((np.ptp(x[np.isfinite(x)]), np.ptp(y[np.isfinite(y)]), 1.6 * (far - near)))
    axes.view_init(elev=62, azim=-80)
    axes.set_axis_off()
    figure.savefig(path)


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
