"""The identity of the virtual bench: a camera in the place of the projector captures exactly what is projected."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.config import Fringes
from quadfringe.evaluation.reproduction import Figure, Reproduction
from quadfringe.view.report import Graph, Panel, draw_panels
from quadfringe.view.style import DIVERGING

__all__ = ["IdentityShot", "identity", "identity_shot"]

Map = NDArray[np.float64]
WIDTH_PX, HEIGHT_PX = 1024, 768
FOCAL_PX = 12.0 / 4.65e-3  # the camera of the published bench: 12 mm lens, 4.65 um pixels
FULL = 65535  # of 16 bit
CHANNELS = {"red": "R", "green": "G", "blue": "B", "ir": "IR"}
WORDS = {"red": "red", "green": "green", "blue": "blue", "ir": "infrared"}
SHOWN_PX = 90  # columns of the profile


class IdentityShot(NamedTuple):
    """The projected and the captured images (H, W) by channel, share of full scale."""

    projected: dict[str, Map]
    captured: dict[str, Map]


def identity(out: Path) -> Reproduction:
    """Capture a plane at 800 mm by a camera that is the projector, and compare with the projected images.

    Camera and projector have 1024 x 768 pixels of 4.65 um behind a lens of 12 mm, in one place. The paper demands that
    the 36 fringes come back exactly; the camera rounds to 16 bit, so half a step, 7.6e-6 of full scale, is allowed.
    Writes `out`/identity.png. The figure is the greatest difference, share of full scale.
    """
    seen = identity_shot()
    apart = {name: seen.captured[name] - seen.projected[name] for name in CHANNELS}
    worst = max(float(np.abs(one).max()) for one in apart.values())
    record = Figure(
        "identity_max_difference", "captured less projected image, greatest", worst, "share", 0.0, 0.5 / FULL
    )
    path = out / "identity.png"
    _draw(path, seen, apart)
    exact = worst <= 0.51 / FULL
    verdict = "what is captured is what was projected, but for the rounding of the camera"
    return Reproduction((record,), (path,), verdict if exact else "the captured images differ from the projected ones")


def identity_shot() -> IdentityShot:
    """Return the projected and the captured images of the identity."""
    centre_px = ((WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2)
    device = _core.Device(WIDTH_PX, HEIGHT_PX, (FOCAL_PX, FOCAL_PX), centre_px)
    bench = _core.Bench(camera=device, visible=device, infrared=device)
    numbers = Fringes().numbers
    images = bench.render(bench.cast("plane"), numbers, bit_depth=16, albedo=(1.0,) * 4, ambient=(0.0,) * 4)
    captured = {name: images[name] / FULL for name in CHANNELS}
    projected = {name: _core.pattern(key, numbers, WIDTH_PX, HEIGHT_PX) for name, key in CHANNELS.items()}
    return IdentityShot({name: image.astype(np.float64) for name, image in projected.items()}, captured)


def _draw(path: Path, seen: IdentityShot, apart: dict[str, Map]) -> None:
    projected, captured = seen
    limits = (0.0, 1.0)
    x = np.arange(SHOWN_PX)
    row = HEIGHT_PX // 2
    lines = {f"{WORDS[name]}, projected": (x, projected[name][row, :SHOWN_PX]) for name in ("red", "green")}
    dots = {f"{WORDS[name]}, captured": (x[::3], captured[name][row, :SHOWN_PX:3]) for name in ("red", "green")}
    profile = Graph(
        f"row {row}", "column, px", "share of full scale", lines | dots, y_limits=(-0.05, 1.05), dots=tuple(dots)
    )
    rows: list[list[Panel | Graph]] = [
        [
            Panel("projected, red: 36 fringes", projected["red"], "share of full scale", "gray", limits),
            Panel("captured, red", captured["red"], "share of full scale", "gray", limits),
            profile,
        ],
        [
            Panel(
                f"{WORDS[name]}: captured less projected", FULL * apart[name], "steps of 16 bit", DIVERGING, (-1.0, 1.0)
            )
            for name in ("red", "green", "ir")
        ],
    ]
    draw_panels(path, "a camera in the place of the projector", rows)
