"""The demonstration: one shot of each scene on the virtual bench, decoded and compared with the truth."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from time import perf_counter
from typing import Any

from quadfringe.config import DecodeConfig, Device, Fringes, SceneConfig, SystemConfig
from quadfringe.config.cameras import VirtualConfig
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding.compare import compare
from quadfringe.scanner import Scanner, open_system
from quadfringe.view.overview import write_overview
from quadfringe.view.plain import write_plain_report

__all__ = ["SCENES", "SceneResult", "live_system", "missing_extras", "next_steps", "run_scene"]

SCENES = ("steps", "face")
NOISE = 0.03  # standard deviation of the sensor noise, share of full scale, as in the published evaluation
# What each library adds to the demonstration.
EXTRAS = {
    "trimesh": ("export", "PLY files"),
    "matplotlib": ("plot", "full reports"),
    "viser": ("view", "pages in the browser"),
}
REPEATS = 5  # timed decodes, of which the fastest counts: other load only adds time
# The camera of the live demonstration has half the columns and rows of the usual one, so that two cores measure more
# than 10 shots a second (python benches/live.py --bench).
LIVE_CAMERA = Device(width_px=512, height_px=384, focal_px=(1290.3, 1290.3), centre_px=(255.5, 191.5))
LIVE_HZ = 10.0  # shots for each second of the hand's time
# Narrow fringes resolve fingers by the published method, which alone is fast enough for the rate. Shadows, doubtful
# pixels and impossible depths are left out.
LIVE_FRINGES = Fringes(numbers=(100, 99, 90))
LIVE_DECODE: dict[str, Any] = {"modulation_min": 0.08, "quality_min": 0.5, "depth_range_mm": (650.0, 815.0)}


@dataclass(frozen=True)
class SceneResult:
    """Figures of one scene by name with unit, and the shortest time of a decode."""

    figures: dict[str, float]
    decode_ms: float


def missing_extras() -> str | None:
    """Name, in one line, what the demo leaves out without the missing extras; None if all are installed."""
    missing = [words for module, words in EXTRAS.items() if find_spec(module) is None]
    if not missing:
        return None
    extras, losses = ",".join(extra for extra, _ in missing), ", ".join(loss for _, loss in missing)
    return f'left out: {losses}; for all of it: pip install "quadfringe[{extras}]"'


def next_steps(out: Path) -> list[str]:
    """Say in at most three lines what to look at and what to try after the demonstration."""
    program = "quadfringe" if which("quadfringe") else sys.argv[0]
    if program.endswith(".py"):
        program = "python -m quadfringe"
    lines = [f"look at the report: {out / 'face.png'}"]
    if find_spec("viser") is not None:
        lines += [f"turn the surface:   {program} view {_surface(out, 'face')}"]
        lines += [f"watch a hand move:  {program} live"]
    else:
        lines += [f"see all commands:   {program} --help"]
    return lines


def _surface(out: Path, scene: str) -> Path:
    return out / f"{scene}.{'glb' if find_spec('trimesh') is None else 'ply'}"


def live_system(fringes: Fringes = LIVE_FRINGES) -> SystemConfig:
    """Give the system of the live demonstration: the virtual bench, where a hand moves, and the published method."""
    scene = SceneConfig(surface="hand", albedo=(0.92, 0.70, 0.58, 0.85), shading=True, noise=0.01, seed=1)
    return SystemConfig(
        capture=VirtualConfig(frame_rate_hz=LIVE_HZ),
        camera=LIVE_CAMERA,
        scene=scene,
        fringes=fringes,
        decode=DecodeConfig(method="published", **LIVE_DECODE),
    )


def run_scene(surface: str, out: Path, fringes: Fringes = Fringes()) -> SceneResult:
    """Measure one scene and write <surface>.ply and <surface>.png to the folder `out`.

    Without trimesh the surface is written as <surface>.glb, without matplotlib the picture has four panels.
    """
    config = SystemConfig(scene=SceneConfig(surface=surface, noise=NOISE), fringes=fringes)
    with open_system(config) as scanner:
        shot = scanner.grab()
        shape, decode_ms = _timed_decode(scanner, shot)
    assert shot.truth is not None, "the virtual bench knows the truth"
    found = compare(shape, shot.truth, causes=False)
    shape.save(_surface(out, surface))
    title = f"{surface.capitalize()}: one exposure of {len(shot.channels)} channels, decoded in {decode_ms:.0f} ms"
    if find_spec("matplotlib") is None:
        write_plain_report(out / f"{surface}.png", surface, shot, shape, found)
    else:
        write_overview(out / f"{surface}.png", title, shot, shape, found)
    figures = {
        f"{surface}_depth_rms_mm": found.overall.rms,
        f"{surface}_wrong_order_percent": found.wrong_order_percent,
        f"{surface}_returned_percent": found.returned_percent,
    }
    return SceneResult(figures, decode_ms)


def _timed_decode(scanner: Scanner, shot: AnyShot) -> tuple[Shape, float]:
    times_ms = []
    for _ in range(REPEATS):
        start = perf_counter()
        shape = scanner.decode(shot)
        times_ms.append(1e3 * (perf_counter() - start))
    return shape, min(times_ms)
