"""The scenes by name. Each draws a shot of the virtual bench and its truth from a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe import _core
from quadfringe.data import Shot
from quadfringe.evaluation._scenes import noisy_8bit
from quadfringe.evaluation.world import albedo, relief

TUNE, REPORT = (1, 3), (2, 4)
WIDTH_PX = 912  # of the projector of the bench
NOISE = 0.03  # standard deviation, share of full scale
FRINGES = (36.0, 35.0, 30.0)
EDGE_PX = 2.0  # nearer pixels mix two sides of an edge
# Blur of a translucent material in the channels R, G, B, IR, sigma in px: red and infrared light reach farther.
TRANSLUCENT_PX = (3.0, 1.5, 1.0, 4.0)
# Fringe numbers (N, N - 1, N - sqrt N), about 78, 50, 20 and 9 px a fringe.
OTHER_FRINGES = {
    "78px": (16.0, 15.0, 12.0),
    "50px": (25.0, 24.0, 20.0),
    "20px": (64.0, 63.0, 56.0),
    "9px": (144.0, 143.0, 132.0),
}

Mask = NDArray[np.bool_]
Map = NDArray[np.float64]


@dataclass(frozen=True)
class Take:
    """A shot and its truth, maps (H, W): phase in rad, depth in mm, NaN where nothing is seen."""

    shot: Shot
    fringe_numbers: tuple[float, ...]
    phase_rad: Map
    depth_mm: Map
    lit: Mask
    edge_distance_px: Map  # from the nearest edge of depth, light or surface

    @property
    def counted(self) -> Mask:
        """Lit pixels that do not mix two sides of an edge."""
        return np.asarray(self.lit & (self.edge_distance_px >= EDGE_PX))


@dataclass(frozen=True)
class World:
    """A scene before the exposure: what the camera sees, its albedo, and how the material spreads light.

    `contrast` (H, W) is that of the fringes; light without fringes lowers it, such as that of the folds of a cloth on
    each other.
    """

    cast: _core.Cast
    albedo: NDArray[np.float32] | None = None
    fringe_numbers: tuple[float, ...] = FRINGES
    options: dict[str, Any] | None = None
    spread_px: tuple[float, float, float, float] | None = None
    contrast: NDArray[np.float32] | None = None


def _with_contrast(bench: _core.Bench, world: World, seed: int, noise: float) -> list[NDArray[np.uint8]]:
    """Add light without fringes until their contrast is that of the world, and expose the brightest to 95 %."""
    assert world.albedo is not None
    assert world.contrast is not None
    images = bench.render(world.cast, world.fringe_numbers, noise=0.0, bit_depth=16, albedo=world.albedo)
    # Offset and contrast of the light of the bench; its folds light each other in the colour of the cloth.
    offset, contrast = 0.4995, 0.901
    added = offset * world.albedo * (contrast / world.contrast - 1)[..., None]
    lights = [images[name] / 65535.0 + added[..., c] for c, name in enumerate(("red", "green", "blue", "ir"))]
    exposure = 0.95 / max(float(np.nanpercentile(light, 99.9)) for light in lights)
    full = [(np.clip(exposure * np.nan_to_num(light), 0, 1) * 65535).astype(np.uint16) for light in lights]
    return [noisy_8bit(image, noise, 10 * seed + c) for c, image in enumerate(full)]


Draw = Callable[[_core.Bench, np.random.Generator], World]


def take(name: str, seed: int, noise: float = NOISE, numbers: tuple[float, ...] | None = None) -> Take:
    """Draw the scene with this name from a seed and expose it, 1024 x 768, 8 bit.

    `numbers` replace the fringe numbers of the scene, as `Fringes.code` gives them; with three there is infrared.
    """
    bench = _core.Bench()
    world = SCENES[name](bench, np.random.default_rng([seed, 77]))
    return expose(bench, world if numbers is None else replace(world, fringe_numbers=numbers), seed, noise)


def expose(bench: _core.Bench, world: World, seed: int, noise: float = NOISE) -> Take:
    """Take a shot of a scene; light spreads in the material before the sensor adds noise."""
    options: dict[str, Any] = {} if world.albedo is None else {"albedo": world.albedo}
    options |= world.options or {}
    if world.contrast is not None:
        channels = _with_contrast(bench, world, seed, noise)
    elif world.spread_px is None:
        images = bench.render(world.cast, world.fringe_numbers, noise=noise, seed=seed, **options)
        channels = [images[name] for name in ("red", "green", "blue", "ir")]
    else:
        images = bench.render(world.cast, world.fringe_numbers, noise=0.0, bit_depth=16, **options)
        spread = zip(images.values(), world.spread_px, strict=True)
        channels = [
            noisy_8bit(cv2.GaussianBlur(image, (0, 0), sigma), noise, 10 * seed + c)
            for c, (image, sigma) in enumerate(spread)
        ]
    red, green, blue, ir = channels
    infrared = ir if len(world.fringe_numbers) == 3 else None
    column_px = world.cast.column_px().astype(np.float64)
    return Take(
        shot=Shot(red, green, blue, infrared),
        fringe_numbers=world.fringe_numbers,
        phase_rad=2 * np.pi * world.fringe_numbers[0] / bench.visible.width * column_px,
        depth_mm=world.cast.xyz_mm()[..., 2].astype(np.float64),
        lit=np.isfinite(column_px) & ~world.cast.shadow(),
        edge_distance_px=world.cast.edge_distance_px().astype(np.float64),
    )


def _plain(surface: str, **options: Any) -> Draw:
    return lambda bench, _random: World(bench.cast(surface), options=options)


def _painted(bench: _core.Bench, random: np.random.Generator) -> World:
    cast = bench.cast("face")
    return World(cast, albedo.painted_face(cast.xyz_mm(), random))


def _photographs(surface: str) -> Draw:
    def draw(bench: _core.Bench, random: np.random.Generator) -> World:
        cast = bench.cast(surface)
        return World(cast, albedo.photographs(cast.shadow().shape, random))

    return draw


def _glossy(surface: str) -> Draw:
    def draw(bench: _core.Bench, random: np.random.Generator) -> World:
        cast = bench.cast(surface)
        return World(cast, albedo.glossy(cast.xyz_mm(), random))

    return draw


def _translucent(bench: _core.Bench, random: np.random.Generator) -> World:
    scale = random.uniform(0.7, 1.3)
    red, green, blue, ir = (scale * sigma for sigma in TRANSLUCENT_PX)
    return World(bench.cast("face"), spread_px=(red, green, blue, ir))


def _cloth(bench: _core.Bench, random: np.random.Generator) -> World:
    drape = relief.cloth(random)
    cast = drape.cast(bench)
    points_mm = cast.xyz_mm()
    folds = np.clip(drape.folds_at(points_mm), -1, 1)
    # A woven colour, darker in the folds and where hair lies on it.
    bright = (0.475 + 0.125 * folds) * np.where(drape.parts_at(points_mm) == 1, 0.6, 1.0)
    bright = bright * (1 + 0.06 * random.standard_normal(bright.shape))
    colour = bright[..., None] * np.array((1.0, 0.8, 0.6, 0.9))
    return World(cast, colour.astype(np.float32), contrast=(0.45 + 0.15 * folds).astype(np.float32))


def _relief(made: Callable[[np.random.Generator], relief.Relief], *, coloured: bool) -> Draw:
    def draw(bench: _core.Bench, random: np.random.Generator) -> World:
        shape = made(random)
        cast = shape.cast(bench)
        points_mm = cast.xyz_mm()
        shades = albedo.random_shades(points_mm, shape.parts_at(points_mm), random) if coloured else None
        return World(cast, shades)

    return draw


def _fringes(numbers: tuple[float, float, float]) -> Draw:
    return lambda bench, _random: World(bench.cast("peaks"), fringe_numbers=numbers)


SCENES: dict[str, Draw] = {
    "plane": _plain("plane"),
    "peaks": _plain("peaks"),
    "steps": _plain("steps"),
    "sphere": _plain("sphere"),
    "face": _plain("face"),
    "face_patches_20": _plain("face", patch_mm=20.0),
    "face_patches_12": _plain("face", patch_mm=12.0),
    "peaks_patches_20": _plain("peaks", patch_mm=20.0),
    "painted_face": _painted,
    "photographs_peaks": _photographs("peaks"),
    "photographs_face": _photographs("face"),
    "photographs_steps": _photographs("steps"),
    "glossy_sphere": _glossy("sphere"),
    "glossy_face": _glossy("face"),
    "translucent_face": _translucent,
    "coin": _relief(relief.coin, coloured=False),
    "cloth": _cloth,
    "rods": _relief(relief.rods, coloured=True),
    "clutter": _relief(relief.clutter, coloured=True),
    **{f"fringes_{name}": _fringes(numbers) for name, numbers in OTHER_FRINGES.items()},
}
