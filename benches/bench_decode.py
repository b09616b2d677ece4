"""Time of a decode against a plain NumPy version of the published chain, in one run.

    python benches/bench_decode.py [--json FILE] [--repeats 15] [--surface face]

All contenders get the same shot of the virtual bench (1024 x 768, 8 bit, 3 % noise) and return absolute phase, order,
quality and X, Y, Z. They take turns, so that other load on the machine affects all of them; the median counts.
Planning, which happens once per bench, is not timed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import numpy_chain, scoring
from quadfringe.evaluation.timing import warm
from quadfringe.files import figures_text

Maps = tuple[NDArray[Any], NDArray[Any]]  # phase_rad, xyz_mm
Contender = Callable[[], Maps]


def geometry_from(calibration: qf.Calibration) -> numpy_chain.Geometry:
    camera, projector = calibration.camera, calibration.projector

    def matrix(device: qf.Device) -> NDArray[np.float64]:
        (fx, fy), (cx, cy) = device.focal_px, device.centre_px
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])

    return numpy_chain.Geometry(
        camera_k=matrix(camera),
        projector_k=matrix(projector),
        rotation=np.array(projector.rotation),
        translation_mm=np.array(projector.translation_mm, dtype=np.float64),
    )


def numpy_contender(shot: qf.Shot, calibration: qf.Calibration, dtype: Any) -> Contender:
    geometry = geometry_from(calibration)

    def run() -> Maps:
        found = numpy_chain.decode(shot.red, shot.green, shot.blue, shot.ir, geometry=geometry, dtype=dtype)
        assert found.xyz_mm is not None
        return found.phase_rad, found.xyz_mm

    return run


def product_contender(
    shot: qf.Shot, config: qf.SystemConfig, calibration: qf.Calibration, **settings: Any
) -> Contender:
    plan = qf.Plan(
        projector_width_px=calibration.projector.width_px,
        fringes=config.fringes,
        calibration=calibration,
        decode=qf.DecodeConfig(**settings),
    )
    decoder = qf.Decoder(shot, plan)

    def run() -> Maps:
        shape = decoder.decode(shot)
        assert shape.xyz_mm is not None
        return shape.phase_rad, shape.xyz_mm

    return run


def timed(contenders: dict[str, Contender], repeats: int) -> dict[str, float]:
    """Give the median milliseconds of each contender over `repeats` rounds, after one round to warm up.

    In each round a contender runs several times before the timed call, so that it finds its data in the cache.
    """
    spent: dict[str, list[float]] = {name: [] for name in contenders}
    for turn in range(repeats + 1):
        for name, run in contenders.items():
            warm(run)
            start = time.perf_counter()
            run()
            if turn > 0:
                spent[name].append(1e3 * (time.perf_counter() - start))
    return {name: float(np.median(values)) for name, values in spent.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--surface", default="peaks", help="a surface of the virtual bench")
    options = parser.parse_args()

    config = qf.SystemConfig(scene=qf.SceneConfig(surface=options.surface, noise=0.03))
    with qf.open(config) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    contenders = {
        "numpy_float32": numpy_contender(shot, calibration, np.float32),
        "numpy_float64": numpy_contender(shot, calibration, np.float64),
    }
    for method in ("published", "joint"):
        for threads in (1, 2):
            contenders[f"{method}_{threads}_threads"] = product_contender(
                shot, config, calibration, method=method, threads=threads
            )
    times = timed(contenders, options.repeats)
    scene = scenes.scene_from(shot, config, calibration.projector.width_px)

    figures: dict[str, float] = {}
    print(f"{options.surface}, {shot.red.shape[1]} x {shot.red.shape[0]}, {shot.red.dtype}")
    print(f"{'':22}{'ms':>8}{'x f32':>8}{'x f64':>8}{'right %':>9}{'phase rad':>11}{'depth mm':>10}")
    for name, ms in times.items():
        score = scoring.score(scene, *contenders[name]())
        ratios = (times["numpy_float32"] / ms, times["numpy_float64"] / ms)
        print(
            f"{name:22}{ms:8.2f}{ratios[0]:8.1f}{ratios[1]:8.1f}{score.right_percent:9.3f}"
            f"{score.right_phase_rms_rad:11.4f}{score.depth_rms_mm:10.4f}"
        )
        figures |= {
            f"{name}_ms": ms,
            f"{name}_times_numpy_float32": ratios[0],
            f"{name}_times_numpy_float64": ratios[1],
            f"{name}_right_percent": score.right_percent,
            f"{name}_phase_rms_rad": score.right_phase_rms_rad,
        }
    if options.json:
        options.json.write_text(figures_text(figures))


if __name__ == "__main__":
    main()
