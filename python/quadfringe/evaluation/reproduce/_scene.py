"""One shot of a scene, from its fringes to its shape: what the experiments `mask` and `steps` share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from quadfringe.config import DecodeConfig, Device, SceneConfig, SystemConfig
from quadfringe.config.scene import Surface
from quadfringe.data import AnyShot, Shape, xyz_mm_of
from quadfringe.decoding.compare import ShapeComparison, compare
from quadfringe.decoding.stages import linear_light, wrapped_phases
from quadfringe.evaluation.reproduction import Figure
from quadfringe.scanner import open_system
from quadfringe.view.colours import coloured, limits_of
from quadfringe.view.movie import solid_picture
from quadfringe.view.report import Graph, Panel, draw_panels, fringe_panels
from quadfringe.view.style import DIVERGING, symmetric

__all__ = ["METHODS", "SceneShot", "draw", "figures_of", "measured", "wrong_words"]

NOISE, SEED = 0.03, 1  # standard deviation, share of full scale, as in the published evaluation
GREY = 165  # level of the shaded surface
METHODS = {"published": "published method", "joint": "joint method"}


@dataclass(frozen=True)
class SceneShot:
    """A shot; its shape and comparison with the truth by method, and the wrapped phases of three channels, rad."""

    shot: AnyShot
    shapes: dict[str, Shape]
    found: dict[str, ShapeComparison]
    wrapped: tuple[NDArray[np.float32], ...]


def measured(surface: Surface, camera: Device | None = None) -> SceneShot:
    """Measure a scene of the virtual bench under 3 % noise, 8 bit, by the published and by the joint method."""
    shapes, found = {}, {}
    config = SystemConfig(scene=SceneConfig(surface=surface, noise=NOISE, seed=SEED), camera=camera)
    with open_system(config) as scanner:
        shot = scanner.grab()
        wrapped = wrapped_phases(linear_light(shot, scanner.calibration), config.fringes.code)
    assert shot.truth is not None, "the virtual bench knows the truth"
    for method in METHODS:
        decode = DecodeConfig.model_validate({"method": method})
        with open_system(config.model_copy(update={"decode": decode})) as scanner:
            shapes[method] = scanner.decode(shot)
        found[method] = compare(shapes[method], shot.truth, causes=False)
    return SceneShot(shot, shapes, found, wrapped)


def figures_of(name: str, seen: SceneShot) -> list[Figure]:
    """Name the errors of both methods against the truth."""
    figures = []
    for method, words in METHODS.items():
        found = seen.found[method]
        figures += [
            Figure(f"{name}_{method}_depth_rms_mm", f"{words}: depth, right orders", found.right.rms, "mm RMS"),
            Figure(f"{name}_{method}_wrong_order_percent", f"{words}: wrong orders", found.wrong_order_percent, "%"),
            Figure(f"{name}_{method}_returned_percent", f"{words}: lit pixels returned", found.returned_percent, "%"),
        ]
    return figures


def wrong_words(seen: SceneShot) -> str:
    """Say how many of the pixels that the published method returns have a wrong order."""
    return f"{seen.found['published'].wrong_order_percent:.2g} % of the returned pixels have a wrong order"


def draw(path: Path, title: str, seen: SceneShot, last: Graph, *, painted: bool = False) -> None:
    """Draw the four channels, the wrapped and the unwrapped phase, depth, shaded surface and error; and one graph more.

    Shapes are those of the joint method; the wrapped phases are those of the published stages. The surface is `painted`
    by depth, else it is grey.
    """
    shape, found = seen.shapes["joint"], seen.found["joint"]
    turn = (-np.pi, np.pi)
    names = ("red and blue, two-step", "green, Fourier", "infrared, Fourier")
    depth_mm = xyz_mm_of(shape)[:, :, 2]
    grey = np.full((*depth_mm.shape, 3), GREY, np.uint8)
    paint = coloured(-depth_mm, limits_of(-depth_mm), cv2.COLORMAP_VIRIDIS) if painted else grey
    solid = solid_picture(shape, paint, turn_deg=(24.0, -16.0))
    rows: list[list[Panel | Graph]] = [
        list(fringe_panels(seen.shot)),
        [
            *(Panel(f"wrapped: {n}", w, "rad", "twilight", turn) for n, w in zip(names, seen.wrapped, strict=True)),
            Panel("unwrapped phase", shape.phase_rad, "rad", "turbo"),
        ],
        [
            Panel("depth", depth_mm, "mm", "viridis_r"),
            Panel("shaded surface, turned", solid, bare=True),
            Panel(
                f"depth error: {found.right.rms:.3f} mm RMS",
                found.difference,
                "mm",
                DIVERGING,
                symmetric(np.where(found.wrong_order, np.nan, found.difference)),
            ),
            last,
        ],
    ]
    draw_panels(path, title, rows)
