"""Objects on a black ground: a part of a surface of the virtual bench, cut out by an outline drawn from a seed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.evaluation._scenes import noisy_8bit
from quadfringe.evaluation.scoring import Scene
from quadfringe.evaluation.world.albedo import photographs

__all__ = ["FRINGES", "isolated", "patches", "printed", "repeated", "tinted"]

# Fringe numbers that show the camera this many px a fringe, about.
FRINGES = {
    9: (144.0, 143.0, 132.0),
    20: (64.0, 63.0, 56.0),
    33: (38.0, 37.0, 32.0),
    50: (25.0, 24.0, 20.0),
    74: (17.0, 16.0, 13.0),
    110: (12.0, 11.0, 9.0),
}
PATCH_PX, PRINTED_CONTRAST = 30, 0.8
EDGE_PX = 2.0  # nearer pixels mix two sides of an edge


def isolated(
    period_px: int,
    fill: float,
    seed: int,
    *,
    surface: str = "face",
    contrast: float = 0.3,
    noise: float = 0.01,
    albedo: NDArray[np.float32] | None = None,
) -> Scene:
    """Expose an object that fills a share of the frame; `noise` is a share of full scale, `albedo` (H, W, 4)."""
    bench, numbers = _core.Bench(), FRINGES[period_px]
    cast = bench.cast(surface)
    ambient = (1 / contrast - 1) / 2
    light: dict[str, Any] = {"ambient": (ambient,) * 4, "gain": (0.9 / (1 + ambient),) * 4}
    surface_light: dict[str, Any] = {} if albedo is None else {"albedo": albedo}
    images = bench.render(cast, numbers, noise=0.0, bit_depth=16, **light, **surface_light)
    column_px = cast.column_px().astype(np.float64)
    inside = outline(column_px.shape, fill, seed)
    red, green, blue, ir = (
        noisy_8bit(images[name] * inside.astype(np.uint16), noise, 10 * seed + i)
        for i, name in enumerate(("red", "green", "blue", "ir"))
    )
    return Scene(
        name=surface,
        red=red,
        green=green,
        blue=blue,
        ir=ir,
        fringe_numbers=numbers,
        projector_width=bench.visible.width,
        phase_rad=2 * np.pi * numbers[0] * column_px / bench.visible.width,
        scored=inside & np.isfinite(column_px) & ~cast.shadow() & (cast.edge_distance_px() >= EDGE_PX),
    )


def printed(period_px: int, fill: float, seed: int, *, surface: str = "face", texture: str = "photographs") -> Scene:
    """Expose an object with strong colours, photographs or patches, which move the fringes of each channel."""
    random = np.random.default_rng([seed, 3])
    albedo = photographs((768, 1024), random) if texture == "photographs" else patches(PATCH_PX, seed)
    return isolated(period_px, fill, seed, surface=surface, contrast=PRINTED_CONTRAST, albedo=albedo)


def outline(shape: tuple[int, ...], fill: float, seed: int) -> NDArray[np.bool_]:
    """Draw a wavy ellipse that fills a share of the frame."""
    rows, columns = shape
    random = np.random.default_rng([seed, 5])
    y, x = np.mgrid[:rows, :columns]
    radius, longer = np.sqrt(fill * rows * columns / np.pi), random.uniform(0.9, 1.1)
    across, down = radius * longer, radius / longer
    y, x = (y - random.uniform(0.4, 0.6) * rows) / down, (x - random.uniform(0.35, 0.65) * columns) / across
    angle, phases = np.arctan2(y, x), random.uniform(0, 6, 2)
    waves = 0.12 * np.sin(3 * angle + phases[0]) + 0.06 * np.sin(7 * angle + phases[1])
    return np.asarray(np.hypot(x, y) < 1 + waves)


def patches(side_px: int, seed: int, shape: tuple[int, int] = (768, 1024)) -> NDArray[np.float32]:
    """Draw an albedo (H, W, 4) of squares, each with a random albedo from 0.15 to 1 in every channel."""
    rows, columns = (size // side_px + 1 for size in shape)
    squares = np.random.default_rng([seed, 9]).uniform(0.15, 1.0, (rows, columns, 4))
    return repeated(squares, side_px, shape)


def tinted(side_px: int, seed: int, tint: float, shape: tuple[int, int] = (768, 1024)) -> NDArray[np.float32]:
    """Draw an albedo (H, W, 4) of squares from 0.2 to 1; the channels differ by the share `tint` at most."""
    random = np.random.default_rng([seed, 9])
    rows, columns = (size // side_px + 1 for size in shape)
    squares = random.uniform(0.2, 1.0, (rows, columns, 1)) * (1 + tint * random.uniform(-1, 1, (rows, columns, 4)))
    return repeated(np.clip(squares, 0.05, 1.0), side_px, shape)


def repeated(cells: NDArray[Any], side_px: int, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Draw an albedo (H, W, 4) of squares with the albedo of `cells`, (rows, columns, 4)."""
    whole: Any = cells.repeat(side_px, 0).repeat(side_px, 1)[: shape[0], : shape[1]]
    return np.ascontiguousarray(whole, np.float32)
