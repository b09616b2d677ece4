"""Pictures of a guided calibration: level errors before and after, coverage and residuals, heights, acceptance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadfringe.calibration.acceptance import write_acceptance
from quadfringe.calibration.levels import CHANNELS
from quadfringe.calibration.session.flow import Guided
from quadfringe.calibration.session.outcome import Outcome
from quadfringe.decoding.compare import rms
from quadfringe.files import folder_for
from quadfringe.view import style
from quadfringe.view.report import Drawable, Graph, Panel, draw_panels

__all__ = ["write_picture", "write_pictures"]

Array = NDArray[np.float64]
ARROW = 0.1  # largest length of a residual arrow, share of the image width
BINS = 40
MAP_INCHES = (4.6, 3.7)  # width and height of a drawing over the image


def write_pictures(folder: Path, guided: Guided) -> list[Path]:
    """Write one PNG for each step that has a picture; return the paths. Needs matplotlib (extra `plot`)."""
    written = [write_picture(folder, outcome) for outcome in guided.outcomes]
    return [path for path in written if path is not None]


def write_picture(folder: Path, outcome: Outcome) -> Path | None:
    """Write the PNG of one step; return its path, None for a step without a picture. Needs matplotlib."""
    path = folder_for(folder) / f"{outcome.step.name}.png"
    if outcome.step.name == "acceptance":
        write_acceptance(path, outcome.details["acceptance"])
        return path
    drawer = DRAWERS.get(outcome.step.name)
    if drawer is None:
        return None
    word = "good" if outcome.step.good else "NOT good"
    draw_panels(path, f"{outcome.step.name}: {word}", drawer(outcome))
    return path


def _levels(outcome: Outcome) -> list[list[Drawable]]:
    found, plan = outcome.details["channels"], outcome.details["level_plan"]
    colours = dict(zip(CHANNELS, style.CHANNELS, strict=True))
    panels: list[Drawable] = []
    for words, error in (("before", found.level_before), ("after, finer scale", found.level_after)):
        points = {
            name: (100 * plan.levels[:, i], 100 * error[:, i]) for i, name in enumerate(CHANNELS[: plan.channels])
        }
        title = f"{words}: {100 * rms(error):.3g} % RMS"
        limit = ("no error", 0.0)
        axes = ("projected level, %", "error of the level, % of full scale")
        panels.append(Graph(title, *axes, points, limit, points=True, colours=colours))
    return [panels]


def _flat(outcome: Outcome) -> list[list[Drawable]]:
    gains = outcome.details["flat"].gain
    low, high = (float(np.nanquantile(np.stack(gains), share)) for share in (0.01, 0.99))
    return [
        [
            Panel(f"gain of {name}", gain, "share of the mean", "viridis", (low, high))
            for name, gain in zip(CHANNELS, gains, strict=False)
        ]
    ]


def _registration(outcome: Outcome) -> list[list[Drawable]]:
    found = outcome.details["registration"]
    away = np.linalg.norm(found.residuals_px, axis=1)
    counts, edges = np.histogram(away, BINS)
    middles = (edges[1:] + edges[:-1]) / 2
    words = f"{found.before_rms_px:.3g} px RMS before, {found.after_rms_px:.3g} px after"
    return [
        [
            Graph(words, "distance after registration, px", "points", {"": (middles, counts)}),
            Graph("residuals", "x, px", "y, px", {"": tuple(found.residuals_px.T)}, points=True),
        ]
    ]


@dataclass(frozen=True)
class _Seen:
    """Where the board was seen: the outlines of all poses over the whole image, borders and all."""

    title: str
    image: NDArray[np.bool_]
    points: Sequence[Array]
    inches: tuple[float, float] = MAP_INCHES

    def draw(self, _figure: Any, axes: Any, title: str | None = None) -> None:
        """Draw the covered pixels, and the points of each pose with its number."""
        _over_the_image(axes, self.image.shape, self.title if title is None else title)
        axes.imshow(self.image, cmap="Greens", vmin=0.0, vmax=3.0, interpolation="nearest")
        for i, points in enumerate(self.points, 1):
            axes.plot(*points.T, ".", ms=1.5)
            axes.text(*points[0], str(i), fontsize=9, ha="right", va="bottom")


@dataclass(frozen=True)
class _Arrows:
    """Residuals as arrows from the points, enlarged."""

    title: str
    shape: tuple[int, int]
    points: Sequence[Array]
    missed: Sequence[Array]
    times: float
    inches: tuple[float, float] = MAP_INCHES

    def draw(self, _figure: Any, axes: Any, title: str | None = None) -> None:
        """Draw the arrows of all poses."""
        _over_the_image(axes, self.shape, self.title if title is None else title)
        for points, missed in zip(self.points, self.missed, strict=True):
            axes.quiver(*points.T, *missed.T, angles="xy", scale_units="xy", scale=1 / self.times, width=0.003)


def _over_the_image(axes: Any, shape: tuple[int, ...], title: str) -> None:
    height, width = shape
    axes.set(xlabel="column, px", ylabel="row, px", xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    axes.set_title(title, loc="left", parse_math=False)
    axes.set_aspect("equal")
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)


def _poses(outcome: Outcome) -> list[list[Drawable]]:
    rig, observed, seen = (outcome.details[name] for name in ("rig", "observed", "seen"))
    points = [pose.view.points_px for pose in observed]
    longest = max(float(np.nanmax(np.abs(missed))) for missed in rig.camera.residuals_px)
    times = float(10.0 ** np.floor(np.log10(ARROW * seen.shape[1] / max(longest, 1e-9))))
    fits = {"camera": rig.camera, "projector": rig.visible, "infrared": rig.infrared}
    means = {
        f"{name}: {fit.mean_px:.3f} px": (np.arange(1, 1 + len(fit.residuals_px)), _means(fit.residuals_px))
        for name, fit in fits.items()
        if fit is not None
    }
    arrows = f"camera residuals, {times:g} times as long"
    return [
        [
            _Seen(f"board seen in {100 * seen.mean():.0f} % of the image", seen, points),
            _Arrows(arrows, seen.shape, points, rig.camera.residuals_px, times),
            Graph("mean reprojection error of each pose", "pose", "px", means, dots=tuple(means)),
        ]
    ]


def _means(residuals_px: Sequence[Array]) -> Array:
    return np.array([float(np.nanmean(np.linalg.norm(missed, axis=1))) for missed in residuals_px])


def _planes(outcome: Outcome) -> list[list[Drawable]]:
    found, polynomial, triangulated = (outcome.details[n] for n in ("heights", "polynomial", "triangulated"))
    apart = [p - t for p, t in zip(polynomial, triangulated, strict=True)]
    name = "mean and standard deviation"
    line = (np.array(found.heights_mm), np.array([float(np.nanmean(one)) for one in apart]))
    spread = {name: np.array([float(np.nanstd(one)) for one in apart])}
    worst = int(np.argmax(np.abs(found.heights_mm)))
    words = f"difference at {found.heights_mm[worst]:g} mm: {rms(apart[worst]):.3g} mm RMS"
    axes = ("height of the plane, mm", "polynomial less triangulation, mm")
    return [
        [
            Graph("all planes", *axes, {name: line}, ("no difference", 0.0), spread=spread),
            Panel(words, apart[worst], "mm", style.DIVERGING, style.symmetric(apart[worst])),
        ]
    ]


DRAWERS: dict[str, Callable[[Outcome], list[list[Drawable]]]] = {
    "levels": _levels,
    "flat": _flat,
    "registration": _registration,
    "poses": _poses,
    "planes": _planes,
}
