"""Meshes of scenes of the virtual bench against the truth.

    python evaluation/mesh.py [--json FILE] [--scenes NAME ...]

1024 x 768 px, 8 bit, 3 % noise, fixed seed. For each scene: triangles that cross a true step in depth, share of
returned pixels in the mesh, and error of the normals more than 20 px from edges, as root mean square over what is
stated. With `--limits`, for other angles and numbers of standard deviations, computed in NumPy: the share of neighbours
on one surface that are cut apart, and the number of neighbours that are joined across a step.
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt

import quadfringe as qf
from quadfringe import _core
from quadfringe.data import Shape
from quadfringe.evaluation import mesh_truth
from quadfringe.evaluation.mesh_truth import Map, Steps
from quadfringe.evaluation.world import scenes
from quadfringe.files import figures_text
from quadfringe.scanner import open_system

SCENES = ("steps", "face", "sphere", "glossy_face", "coin", "rods", "clutter")
SEED = 1
FAR_PX = 20.0
CORRECT_MM = 1.0  # a pixel with a smaller error lies on its surface
COTANGENTS, DEVIATIONS = (2.0, 3.0, 4.0, 5.67), (0.0, 3.0, 6.0)


def decoded(take: scenes.Take) -> Shape:
    """Decode a shot with the calibration of the bench."""
    with open_system() as scanner:
        calibration = scanner.calibration
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qf.DecodeWarning)
        return qf.decode(take.shot, qf.Plan(912, qf.Fringes(numbers=take.fringe_numbers), calibration))


def figures_of(name: str) -> tuple[dict[str, float], str]:
    """Give the figures of one scene by name with unit, and the lines for other limits."""
    take = scenes.take(name, SEED)
    world = scenes.SCENES[name]
    random = lambda: np.random.default_rng([SEED, 77])  # noqa: E731 - the same scene for each camera
    steps = Steps.of(lambda bench: world(bench, random()).cast)
    truth = world(_core.Bench(), random()).cast.xyz_mm()
    shape = decoded(take)
    mesh = shape.mesh()
    found, true = shape.normals(), _core.normals_from_points(truth)["normals"]
    errors = mesh_truth.normal_errors_rad(found.directions, true)
    far = np.isfinite(errors) & (distance_transform_edt(take.edge_distance_px > 0) > FAR_PX)
    figures = {
        "crossing_triangles": float(mesh_truth.crossing_triangles(mesh, steps)),
        "in_mesh_percent": 100 * len(mesh.vertices_mm) / int(shape.returned.sum()),
        "normal_error_median_deg": float(np.degrees(np.median(errors[far]))),
        "normal_error_over_stated": float(np.sqrt(np.mean((errors[far] / found.uncertainty_rad[far]) ** 2))),
    }
    return figures, limits(shape, take.depth_mm, steps)


def limits(shape: Shape, depth_mm: Map, steps: Steps) -> str:
    """Describe what other limits would cut apart and join."""
    assert shape.depth_mm is not None
    assert shape.uncertainty_mm is not None
    z, sigma = shape.depth_mm.astype(np.float64), shape.uncertainty_mm.astype(np.float64)
    correct = np.abs(z - depth_mm) < CORRECT_MM
    near = steps.nearby()
    lines = []
    for cotangent in COTANGENTS:
        for deviations in DEVIATIONS:
            cut = crossing = smooth = 0
            for a, b in (np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:]):
                pixel_mm = np.minimum(z[a], z[b]) / min(_core.Bench().camera.focal_px)
                apart = np.abs(z[b] - z[a])
                joined = apart <= cotangent * pixel_mm + deviations * np.hypot(sigma[a], sigma[b])
                step = np.maximum(near[a], near[b])
                on_one = correct[a] & correct[b] & (step == 0)
                smooth += int(on_one.sum())
                cut += int((on_one & ~joined).sum())
                crossing += int((joined & (step > 0) & (apart > step / 2)).sum())
            degrees = np.degrees(np.arctan(1 / cotangent))
            share = 100 * cut / max(1, smooth)
            lines.append(f"  {degrees:.0f} degrees, {deviations:.0f} deviations: cut {share:.3f} %, joined {crossing}")
    return "\n".join(lines)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    arguments.add_argument("--json", type=Path)
    arguments.add_argument("--scenes", nargs="+", default=SCENES, choices=sorted(scenes.SCENES))
    arguments.add_argument("--limits", action="store_true", help="also compare other limits")
    given = arguments.parse_args()
    every: dict[str, float] = {}
    for name in given.scenes:
        figures, lines = figures_of(name)
        print(name, ", ".join(f"{key} {value:.4g}" for key, value in figures.items()), flush=True)
        if given.limits:
            print(lines, flush=True)
        every |= {f"{name}_{key}": value for key, value in figures.items()}
    if given.json:
        given.json.write_text(figures_text(every))


if __name__ == "__main__":
    main()
