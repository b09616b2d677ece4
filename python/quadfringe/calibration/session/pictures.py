"""Pictures of a guided calibration: level errors before and after, coverage and residuals, heights, acceptance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from quadfringe.calibration.acceptance import write_acceptance
from quadfringe.calibration.levels import CHANNELS
from quadfringe.calibration.session.flow import Guided
from quadfringe.calibration.session.outcome import Outcome
from quadfringe.errors import require
from quadfringe.files import atomic, folder_for

__all__ = ["write_pictures"]

COLOURS = ("tab:red", "tab:green", "tab:blue", "tab:gray")
ARROW = 0.1  # largest length of a residual arrow, share of the image width


def write_pictures(folder: Path, guided: Guided) -> list[Path]:
    """Write one PNG for each step that has a picture; return the paths. Needs matplotlib (extra `plot`)."""
    require("matplotlib", "plot")
    folder_for(folder)
    drawers: dict[str, Callable[[Any, Outcome], None]] = {
        "levels": _levels,
        "flat": _flat,
        "registration": _registration,
        "poses": _poses,
        "planes": _planes,
    }
    written = []
    for outcome in guided.outcomes:
        path = folder / f"{outcome.step.name}.png"
        if outcome.step.name in drawers:
            _draw(path, outcome, drawers[outcome.step.name])
            written.append(path)
        elif outcome.step.name == "acceptance":
            write_acceptance(path, outcome.details["acceptance"])
            written.append(path)
    return written


def _draw(path: Path, outcome: Outcome, drawer: Callable[[Any, Outcome], None]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.6), layout="constrained")
    word = "good" if outcome.step.good else "not good"
    figure.suptitle(f"{outcome.step.name}: {word}", fontsize=13)
    drawer(figure, outcome)
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=90)


def _levels(figure: Any, outcome: Outcome) -> None:
    found, plan = outcome.details["channels"], outcome.details["level_plan"]
    left, right = figure.subplots(1, 2)
    for axes, error, title in ((left, found.level_before, "before"), (right, found.level_after, "after")):
        for channel, (name, colour) in enumerate(zip(CHANNELS, COLOURS, strict=True)):
            if channel >= plan.channels:
                continue
            axes.plot(100 * plan.levels[:, channel], 100 * error[:, channel], "o", color=colour, label=name, ms=4)
        axes.axhline(0, color="k", lw=0.5)
        axes.set(xlabel="projected level, %", ylabel="error of the level, % of full scale", title=title)
        axes.legend(fontsize=8)


def _flat(figure: Any, outcome: Outcome) -> None:
    found = outcome.details["flat"]
    for axes, name, gain in zip(figure.subplots(1, len(found.gain)), CHANNELS, found.gain, strict=False):
        drawn = axes.imshow(gain, cmap="viridis", vmin=np.nanquantile(gain, 0.01), vmax=np.nanquantile(gain, 0.99))
        axes.set_title(f"gain of {name}", fontsize=10)
        figure.colorbar(drawn, ax=axes, shrink=0.6)


def _registration(figure: Any, outcome: Outcome) -> None:
    found = outcome.details["registration"]
    left, right = figure.subplots(1, 2)
    away = np.linalg.norm(found.residuals_px, axis=1)
    left.hist(away, bins=40, color="tab:purple")
    left.set(xlabel="distance after registration, px", ylabel="points")
    right.plot(*found.residuals_px.T, ".", ms=2, color="tab:purple")
    right.set(xlabel="x, px", ylabel="y, px", title="residuals", aspect="equal")


def _poses(figure: Any, outcome: Outcome) -> None:
    rig, observed, covered = (outcome.details[name] for name in ("rig", "observed", "covered"))
    left, middle, right = figure.subplots(1, 3)
    width, height = observed[0].view.size_px
    left.imshow(covered, cmap="Greens", extent=(-0.5, width - 0.5, height - 0.5, -0.5), vmin=0)
    for i, pose in enumerate(observed, 1):
        left.plot(*pose.view.points_px.T, ".", ms=2)
        left.text(*pose.view.points_px.mean(axis=0), str(i), fontsize=9)
    left.set(title="where the board was seen", xlabel="x, px", ylabel="y, px", xlim=(0, width), ylim=(height, 0))
    longest = max(float(np.nanmax(np.abs(missed))) for missed in rig.camera.residuals_px)
    times = 10.0 ** np.floor(np.log10(ARROW * width / max(longest, 1e-9)))
    for pose, missed in zip(observed, rig.camera.residuals_px, strict=True):
        middle.quiver(*pose.view.points_px.T, *missed.T, angles="xy", scale_units="xy", scale=1 / times, width=0.003)
    middle.set(title=f"camera residuals, {times:g} times", xlim=(0, width), ylim=(height, 0), xlabel="x, px")
    middle.set_aspect("equal")
    fits = [("camera", rig.camera), ("projector", rig.visible), ("infrared", rig.infrared)]
    shown = [(name, fit) for name, fit in fits if fit is not None]
    for i, (name, fit) in enumerate(shown):
        means = [float(np.nanmean(np.linalg.norm(missed, axis=1))) for missed in fit.residuals_px]
        right.bar(np.arange(1, len(means) + 1) + 0.27 * (i - 1), means, width=0.25, label=name)
    right.set(title="mean reprojection error of each pose", xlabel="pose", ylabel="px")
    right.legend(fontsize=8)


def _planes(figure: Any, outcome: Outcome) -> None:
    found, polynomial, triangulated = (outcome.details[n] for n in ("heights", "polynomial", "triangulated"))
    left, right = figure.subplots(1, 2)
    for height, p, t in zip(found.heights_mm, polynomial, triangulated, strict=True):
        left.errorbar(height, np.nanmean(p - t), np.nanstd(p - t), fmt="o", color="tab:blue", capsize=3)
    left.axhline(0, color="k", lw=0.5)
    left.set(xlabel="height of the plane, mm", ylabel="polynomial minus triangulation, mm")
    worst = int(np.argmax(np.abs(found.heights_mm)))
    drawn = right.imshow(polynomial[worst] - triangulated[worst], cmap="coolwarm", vmin=-0.1, vmax=0.1)
    right.set_title(f"difference at {found.heights_mm[worst]:g} mm", fontsize=10)
    figure.colorbar(drawn, ax=right, shrink=0.8, label="mm")
