"""The demonstration: one shot of each scene on the virtual bench, decoded and compared with the truth."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter

from quadfringe.config import Fringes, SceneConfig, SystemConfig
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding.compare import compare
from quadfringe.decoding.stages import linear_light, wrapped_phases
from quadfringe.scanner import Scanner, open_system
from quadfringe.view.plain import write_plain_report
from quadfringe.view.report import write_report

__all__ = ["SCENES", "SceneResult", "missing_extras", "run_scene"]

SCENES = ("steps", "face")
NOISE = 0.03  # standard deviation of the sensor noise, share of full scale, as in the published evaluation
# What each library adds to the demonstration.
EXTRAS = {"trimesh": ("export", "PLY files"), "matplotlib": ("plot", "full reports")}
REPEATS = 5  # timed decodes, of which the fastest counts: other load only adds time


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
    extras, losses = ",".join(extra for extra, _ in missing), " and ".join(loss for _, loss in missing)
    return f'{losses} are left out; for them: pip install "quadfringe[{extras}]"'


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
    shape.save(out / f"{surface}.{'glb' if find_spec('trimesh') is None else 'ply'}")
    if find_spec("matplotlib") is None:
        write_plain_report(out / f"{surface}.png", surface, shot, shape, found)
    else:
        wrapped = wrapped_phases(linear_light(shot, scanner.calibration), config.fringes.code)
        quadrature = config.fringes.quadrature
        write_report(out / f"{surface}.png", surface, shot, shape, wrapped, found, quadrature=quadrature)
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
