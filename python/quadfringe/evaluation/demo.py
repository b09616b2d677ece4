"""The demonstration: one shot of each scene on the virtual bench, decoded and compared with the truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from quadfringe.config import Fringes, SceneConfig, SystemConfig
from quadfringe.data import AnyShot, Shape
from quadfringe.decoding.compare import compare
from quadfringe.decoding.stages import linear_light, wrapped_phases
from quadfringe.scanner import Scanner, open_system
from quadfringe.view.report import write_report

__all__ = ["SCENES", "SceneResult", "run_scene"]

SCENES = ("steps", "face")
NOISE = 0.03  # standard deviation of the sensor noise, share of full scale, as in the published evaluation
REPEATS = 5  # timed decodes, of which the fastest counts: other load only adds time


@dataclass(frozen=True)
class SceneResult:
    """Figures of one scene by name with unit, and the shortest time of a decode."""

    figures: dict[str, float]
    decode_ms: float


def run_scene(surface: str, out: Path, fringes: Fringes = Fringes()) -> SceneResult:
    """Measure one scene and write <surface>.ply and <surface>.png to the folder `out`."""
    config = SystemConfig(scene=SceneConfig(surface=surface, noise=NOISE), fringes=fringes)
    with open_system(config) as scanner:
        shot = scanner.grab()
        shape, decode_ms = _timed_decode(scanner, shot)
    assert shot.truth is not None, "the virtual bench knows the truth"
    numbers = config.fringes.code
    found = compare(shape, shot.truth, causes=False)
    shape.save(out / f"{surface}.ply")
    wrapped = wrapped_phases(linear_light(shot, scanner.calibration), numbers)
    write_report(out / f"{surface}.png", surface, shot, shape, wrapped, found)
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
