"""Decode the real captures in forms that other benches could have made of them, and count refusals and right orders.

    python evaluation/captures.py [--data FOLDER] [--response known|auto|linear] [--offsets even|odd] [--only WORD ...]
                                  [--draw FILE] [--json FILE] [--rings]

Every capture gives shots at 12 offsets of the fringes, each of them with green and infrared at other steps too, and in
the variants of quadfringe.evaluation._variants. The response is estimated from the 12 images of the first frequency
(known), or from the shot. A refused shot has no right pixel. Right order: |phase - truth| < pi. Tune on even offsets,
report odd ones. Of all shots with the known response the figures are held against their bars; the exit status is 1 when
one is missed.
Shots that are turned by 90 degrees are counted apart: the joint method decodes them, the published one must refuse them
with a message that names the turn.
The data mark pixels whose truth is in doubt, at outlines above all. The figures of sure pixels leave them out.
Of right orders the summary gives the RMS phase error of a shot, its mean and its worst, of all and of sure pixels, the
mean of the medians, and the mean share of phase errors within one and three standard deviations, of the stated
uncertainty and of the noise of the truth together.
With --rings a table tells how far from the outline of an object, or from a jump of the true phase, its pixels are lost.
The picture shows the ten shots with the fewest right pixels of the object, then the ten with the fewest right ones of
those returned: green is right, red is wrong, blue is no data on the object; grey is not scored.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe.errors import DecodeError, DecodeWarning
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._ledger import bars
from quadfringe.evaluation._variants import OFFSETS, VARIANTS, stepped, turned
from quadfringe.files import figures_text

CHOSEN = {"all": OFFSETS, "even": OFFSETS[::2], "odd": OFFSETS[1::2]}
WORST = 10
TILE = (480, 360)
COLUMNS = 5
RINGS_PX = (0.0, 1.5, 3.5, 6.5, np.inf)  # distances from an outline: pixels that mix, pixels next to them, the rest
JUMP_RAD = np.pi / 2  # between neighbours
DEVIATIONS = (1, 3)  # number of stated standard deviations within which phase errors are counted
TURNED = "turned images"  # the reason of a refusal that names the turn
HELD = (
    "refused_percent",
    "right_mean_percent",
    "right_worst_percent",
    "right_of_returned_worst_percent",
    "sure_right_mean_percent",
    "sure_right_of_returned_worst_percent",
    "turned_joint_right_worst_percent",
    "turned_published_named_percent",
)


@dataclass(frozen=True)
class Errors:
    """Phase errors of right orders on the object; not a number without any."""

    median_rad: float
    inside_percent: list[float]  # within each of `DEVIATIONS`


@dataclass(frozen=True)
class Judged:
    """A decoded shot: its name, the reason of a refusal, the score, and its picture."""

    label: str
    refused: str  # the message of a refusal
    reason: str  # its cause in a few words
    score: scoring.Score
    sure: scoring.Score  # of the pixels whose truth is sure
    picture: NDArray[np.uint8]
    rings: NDArray[np.float64]  # of each ring, % of the object and % of it without the right order
    errors: Errors


def shots(data: Path, name: str, offsets: range) -> Iterator[tuple[str, scoring.Scene]]:
    for offset in offsets:
        scene = stepped(data, name, offset)
        yield f"{name}, other G and IR, step {offset}", stepped(data, name, offset, other=1)
        for label, variant in VARIANTS.items():
            yield f"{name}, {label}, step {offset}", variant(scene, offset)


def turned_shots(data: Path, name: str, offsets: range) -> Iterator[tuple[str, scoring.Scene]]:
    for offset in offsets:
        yield f"{name}, turned, step {offset}", turned(stepped(data, name, offset), offset)


def judged(label: str, scene: scoring.Scene, **how: Any) -> Judged:
    """Decode and score a shot and print its line; `how` as in `_scenes.plan_of`."""
    refused = reason = ""
    sd_rad = None
    try:
        shape = scenes.shape_of(scene, **how)
        phase_rad, sd_rad = shape.phase_rad, shape.uncertainty_rad
    except DecodeError as error:
        refused, reason, phase_rad = str(error), error.reason, np.full(scene.red.shape, np.nan, np.float32)
    score = scoring.score(scene, phase_rad)
    print(f"{label:42}{score.right_percent:9.2f}{score.right_of_returned_percent:15.3f}  {refused}", flush=True)
    picture, rings = drawn(label, scene, phase_rad), rings_of(scene, phase_rad)
    sure = scoring.score(scene, phase_rad, mask=scene.sure)
    return Judged(label, refused, reason, score, sure, picture, rings, errors_of(scene, phase_rad, sd_rad))


def errors_of(scene: scoring.Scene, phase_rad: scoring.Map, sd_rad: scoring.Map | None) -> Errors:
    """Hold the phase errors of right orders against the stated uncertainty and the noise of the truth together."""
    error_rad = np.abs(phase_rad - scene.phase_rad)
    right = scene.scored & (error_rad < np.pi)
    if sd_rad is None or scene.phase_sd_rad is None or not right.any():
        return Errors(np.nan, [np.nan] * len(DEVIATIONS))
    stated_rad = np.hypot(sd_rad, scene.phase_sd_rad)
    inside = scoring.within_percent(error_rad[right], stated_rad[right], DEVIATIONS)
    return Errors(float(np.median(error_rad[right])), inside)


def rings_of(scene: scoring.Scene, phase_rad: scoring.Map) -> NDArray[np.float64]:
    """Give the size of each ring around outlines, and what is lost in it."""
    inner = scene.scored.copy()
    for axis in (0, 1):
        smooth = np.abs(np.diff(scene.phase_rad, axis=axis)) < JUMP_RAD
        whole = np.ones((*smooth.shape[:axis], 1, *smooth.shape[axis + 1 :]), np.bool_)
        inner &= np.concatenate([smooth, whole], axis) & np.concatenate([whole, smooth], axis)
    distance_px = cv2.distanceTransform(inner.astype(np.uint8), cv2.DIST_L2, 5)
    lost = scene.scored & ~(np.abs(phase_rad - scene.phase_rad) < np.pi)
    edges = np.array(RINGS_PX)
    counts = [np.histogram(distance_px[where], edges)[0] for where in (scene.scored, lost)]
    return 100 * np.stack(counts, axis=1) / scene.scored.sum()


def drawn(label: str, scene: scoring.Scene, phase_rad: scoring.Map) -> NDArray[np.uint8]:
    """Draw what is right, wrong and missing over the red image, in blue, green, red order."""
    picture = np.repeat((scene.red * (120 / max(scene.red.max(), 1)))[:, :, None].astype(np.uint8), 3, axis=2)
    right = np.abs(phase_rad - scene.phase_rad) < np.pi
    returned = np.isfinite(phase_rad)
    picture[scene.scored & right, 1] += 110
    picture[scene.scored & ~returned] = (255, 80, 0)
    picture[scene.scored & returned & ~right] = (0, 0, 255)
    tile = cv2.resize(picture, TILE, interpolation=cv2.INTER_AREA)
    cv2.putText(tile, label, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)
    return np.asarray(tile, np.uint8)


def sheet(found: list[Judged]) -> NDArray[np.uint8]:
    """Arrange the worst shots by right pixels of the object, then by right pixels of those returned."""
    by_object = sorted(found, key=lambda one: one.score.right_percent)[:WORST]
    by_returned = sorted(found, key=lambda one: one.score.right_of_returned_percent)[:WORST]
    tiles = [one.picture for one in by_object + by_returned]
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % COLUMNS)
    return np.vstack([np.hstack(tiles[i : i + COLUMNS]) for i in range(0, len(tiles), COLUMNS)])


def summary(name: str, found: list[Judged]) -> dict[str, float]:
    right = [one.score.right_percent for one in found]
    returned = [one.score.right_of_returned_percent for one in found if one.score.returned_percent > 0]
    figures = {
        "shots": float(len(found)),
        "refused_percent": share_percent([bool(one.refused) for one in found]),
        "right_mean_percent": float(np.mean(right)),
        "right_worst_percent": min(right),
        "right_of_returned_mean_percent": float(np.mean(returned)) if returned else np.nan,
        "right_of_returned_worst_percent": min(returned, default=np.nan),
    }
    sure = [one.sure.right_of_returned_percent for one in found if one.sure.returned_percent > 0]
    figures |= {
        "sure_right_mean_percent": float(np.mean([one.sure.right_percent for one in found])),
        "sure_right_of_returned_worst_percent": min(sure, default=np.nan),
    }
    for pixels, scores in (("", [one.score for one in found]), ("sure_", [one.sure for one in found])):
        if error_rad := [score.right_phase_rms_rad for score in scores if score.returned_percent > 0]:
            figures[f"{pixels}phase_rms_mean_rad"] = float(np.mean(error_rad))
            figures[f"{pixels}phase_rms_worst_rad"] = max(error_rad)
    if returned:
        figures["phase_median_rad"] = float(np.nanmean([one.errors.median_rad for one in found]))
    inside = np.nanmean([one.errors.inside_percent for one in found], axis=0)
    figures |= {f"inside_{limit}_sd_percent": float(share) for limit, share in zip(DEVIATIONS, inside, strict=True)}
    return told(name, figures)


def summary_of_turned(name: str, joint: list[Judged], published: list[Judged]) -> dict[str, float]:
    right = [one.score.right_percent for one in joint]
    figures = {
        "turned_shots": float(len(joint)),
        "turned_joint_refused_percent": share_percent([bool(one.refused) for one in joint]),
        "turned_joint_right_mean_percent": float(np.mean(right)),
        "turned_joint_right_worst_percent": min(right),
        # Refused as it must be: in words that name the turn.
        "turned_published_named_percent": share_percent([one.reason == TURNED for one in published]),
    }
    return told(name, figures)


def share_percent(counted: list[bool]) -> float:
    return 100 * sum(counted) / len(counted)


def told(name: str, figures: dict[str, float]) -> dict[str, float]:
    print(f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in figures.items()))
    return {f"{name}_{key}": value for key, value in figures.items()}


def missed(figures: dict[str, float]) -> list[str]:
    """Compare figures of all shots with the ledger."""
    limits = {f"{name}_{key}": bars()[f"variants.{name}_{key}"] for name in scenes.CAPTURES for key in HELD}
    missing = {key: bar for key, bar in limits.items() if not bar.holds(figures[key])}
    return [f"missed: {key} {figures[key]:.4g}, bar {bar.text}" for key, bar in missing.items()]


def print_rings(name: str, found: list[Judged]) -> None:
    mean = np.mean([one.rings for one in found], axis=0)
    for nearest, farthest, (share, lost) in zip(RINGS_PX, RINGS_PX[1:], mean, strict=False):
        print(f"{name}, {nearest} to {farthest} px: {share:.2f} % of the object, {lost:.2f} % of it lost here")


def options_of() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--data", type=Path, default=scenes.data_folder())
    parser.add_argument("--response", choices=["known", "auto", "linear"], default="known")
    parser.add_argument("--offsets", choices=CHOSEN, default="all", help="offsets of the fringes")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="shots whose name contains one of these words")
    parser.add_argument("--draw", type=Path, metavar="FILE", help="draw the worst shots here")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--rings", action="store_true", help="tell where pixels are lost")
    return parser.parse_args()


def measured(options: argparse.Namespace, name: str) -> tuple[dict[str, float], list[Judged]]:
    """Give the figures of a capture and its shots, without those that are turned."""
    known = options.response == "known"
    response = scenes.response_of(options.data, name) if known else options.response
    offsets = CHOSEN[options.offsets]

    def all_of(made: Iterator[tuple[str, scoring.Scene]], words: str = "", **how: Any) -> list[Judged]:
        chosen = (
            (label + words, scene)
            for label, scene in made
            if not options.only or any(word in label for word in options.only)
        )
        return [judged(label, scene, response=response, **how) for label, scene in chosen]

    found = all_of(shots(options.data, name, offsets))
    joint = all_of(turned_shots(options.data, name, offsets))
    published = all_of(turned_shots(options.data, name, offsets), ", published", method="published")
    figures = summary(name, found) if found else {}
    figures |= summary_of_turned(name, joint, published) if joint else {}
    if options.rings and found:
        print_rings(name, found)
    return figures, found


def main() -> None:
    options = options_of()
    warnings.simplefilter("ignore", DecodeWarning)
    figures: dict[str, float] = {}
    every: list[Judged] = []
    print(f"quadfringe {qf.__version__}\n{'':42}{'right %':>9}{'of returned %':>15}")
    for name in scenes.CAPTURES:
        of_capture, found = measured(options, name)
        figures |= of_capture
        every += found
    if options.draw and every:
        cv2.imwrite(str(options.draw), sheet(every))
    if options.json:
        options.json.write_text(figures_text(figures))
    if options.offsets == "all" and options.response == "known" and not options.only and (words := missed(figures)):
        sys.exit("\n".join(words))


if __name__ == "__main__":
    main()
