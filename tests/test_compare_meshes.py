"""A shape against a mesh: exact distances, signs, alignment, and the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from support.bars import hold
from trimesh.triangles import closest_point
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.decoding.compare import MeshComparison
from quadfringe.decoding.compare.alignment import align
from quadfringe.decoding.compare.surface import Surface, surface_from


@pytest.fixture(scope="module")
def bumps() -> trimesh.Trimesh:
    """A surface without symmetry, 60 x 50 mm, 800 mm away."""
    y, x = np.mgrid[-25:25:51j, -30:30:61j]
    z = 800 - 8 * np.exp(-((x - 10) ** 2 + y**2) / 80) - 5 * np.exp(-((x + 12) ** 2 + (y - 9) ** 2) / 40) + 0.05 * x
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    faces = np.concatenate([np.stack((a, c, b), 1), np.stack((b, c, d), 1)])
    return trimesh.Trimesh(np.stack([x.ravel(), y.ravel(), z.ravel()], 1), faces, process=False)


def shape_of(points_mm: np.ndarray) -> qf.Shape:
    """Give a shape that holds these points, (H, W, 3)."""
    rows, columns = points_mm.shape[:2]
    column_px = np.tile(np.linspace(300, 600, columns, dtype=np.float32), (rows, 1))
    phase = np.float32(2 * np.pi * 36 / 912) * column_px
    even = np.full((rows, columns), 0.4, np.float32)
    return qf.Shape(phase, column_px, even, even, xyz_mm=points_mm.astype(np.float32), uncertainty_mm=0.1 * even)


@pytest.fixture(scope="module")
def seen(bumps: trimesh.Trimesh) -> np.ndarray:
    """Points on the surface, (40, 50, 3) mm."""
    y, x = np.mgrid[-20:20:40j, -25:25:50j]
    rays = np.stack([x.ravel(), y.ravel(), np.full(x.size, 790.0)], 1)
    z = 800 - 8 * np.exp(-((x - 10) ** 2 + y**2) / 80) - 5 * np.exp(-((x + 12) ** 2 + (y - 9) ** 2) / 40) + 0.05 * x
    rays[:, 2] = z.ravel()
    return Surface(np.asarray(bumps.triangles)).closest(rays).points_mm.reshape(40, 50, 3)


def test_distances_are_exact() -> None:
    mesh = trimesh.creation.box((10, 20, 70))
    points = np.random.default_rng(0).normal(size=(200, 3)) * (8, 12, 30)
    found = surface_from(mesh).closest(points).distances_mm
    each = [np.linalg.norm(closest_point(np.repeat(t[None], 200, 0), points) - points, axis=1) for t in mesh.triangles]
    np.testing.assert_allclose(found, np.min(each, axis=0), atol=1e-9)


@pytest.mark.parametrize("turned", [False, True])
def test_positive_is_towards_the_camera(bumps: trimesh.Trimesh, seen: np.ndarray, turned: bool) -> None:
    mesh = bumps.copy()
    if turned:
        mesh.invert()
    nearer = qf.compare(shape_of(seen - np.array((0, 0, 0.2))), mesh)
    assert isinstance(nearer, MeshComparison)
    assert nearer.overall.bias > 0
    assert nearer.matched_percent == 100
    assert np.array_equal(nearer.transform, np.eye(4))


def test_a_moved_part_is_aligned(bumps: trimesh.Trimesh, seen: np.ndarray) -> None:
    motion = Rotation.from_euler("xyz", (4, -6, 10), degrees=True).as_matrix()
    middle = seen.reshape(-1, 3).mean(axis=0)
    moved = (seen - middle) @ motion.T + middle + (5, -3, 12)
    random = np.random.default_rng(0)
    found = qf.compare(shape_of(moved + 0.02 * random.standard_normal(seen.shape)), bumps, align=True)
    assert isinstance(found, MeshComparison)
    back = moved.reshape(-1, 3) @ found.transform[:3, :3].T + found.transform[:3, 3]
    hold("compare.aligned_mm", np.linalg.norm(back - seen.reshape(-1, 3), axis=1).max())


def test_clutter_does_not_pull(bumps: trimesh.Trimesh, seen: np.ndarray) -> None:
    points = seen.copy()
    points[:, :15] += (0, 0, 40)  # three tenths belong to something else
    surface = Surface(np.asarray(bumps.triangles))
    shift = np.array((1.0, 0.5, 0.5))
    found = align(points.reshape(-1, 3) + shift, surface)
    part = seen[:, 15:].reshape(-1, 3)
    back = (part + shift) @ found.transform[:3, :3].T + found.transform[:3, 3]
    hold("compare.aligned_mm", np.linalg.norm(back - part, axis=1).max())


def test_what_cannot_be_compared_is_refused(seen: np.ndarray, tmp_path: Path) -> None:
    shape = shape_of(seen)
    far = trimesh.creation.box((10, 10, 10))
    with pytest.raises(qf.InputError, match="within 5 mm"):
        qf.compare(shape, far)
    with pytest.raises(qf.InputError, match="phase only"):
        qf.compare(replace(shape, xyz_mm=None, uncertainty_mm=None), far)
    with pytest.raises(qf.InputError, match="no such file"):
        qf.compare(shape, tmp_path / "none.stl")
    (tmp_path / "text.stl").write_text("not a mesh")
    with pytest.raises(qf.InputError, match="mesh"):
        qf.compare(shape, tmp_path / "text.stl")
    trimesh.PointCloud(np.zeros((3, 3))).export(tmp_path / "cloud.ply")
    with pytest.raises(qf.InputError, match="triangles"):
        qf.compare(shape, tmp_path / "cloud.ply")
    with pytest.raises(qf.InputError, match="at least 50 points"):
        qf.compare(shape_of(seen[:2, :4]), far, align=True)


# The command


def test_the_command_writes_figures_and_pictures(bumps: trimesh.Trimesh, seen: np.ndarray, tmp_path: Path) -> None:
    shape_of(seen).save(tmp_path / "a.npz")
    bumps.export(tmp_path / "b.stl")
    arguments = ["compare", "a.npz", "b.stl", "--align", "--json", "f.json", "--out", "out"]
    done = CliRunner().invoke(app, [str(tmp_path / a) if "." in a or a == "out" else a for a in arguments])
    assert done.exit_code == 0, done.output
    record = json.loads((tmp_path / "f.json").read_text())
    assert {"rms_mm", "bias_mm", "matched_percent"} <= record["figures"].keys()
    assert len(record["transform"]) == 4
    assert (tmp_path / "out" / "comparison.png").read_bytes()[:4] == b"\x89PNG"
    with np.load(tmp_path / "out" / "difference.npz") as maps:
        assert maps["difference_mm"].shape == (40, 50)


def test_the_command_compares_two_shapes(seen: np.ndarray, tmp_path: Path) -> None:
    shape_of(seen).save(tmp_path / "a.npz")
    shape_of(seen + np.array((0, 0, 0.3))).save(tmp_path / "b.npz")
    done = CliRunner().invoke(app, ["compare", str(tmp_path / "a.npz"), str(tmp_path / "b.npz"), "--json", "-"])
    assert done.exit_code == 0, done.output
    record = json.loads(done.stdout)
    assert record["figures"]["bias_mm"] == pytest.approx(-0.3, abs=1e-4)
    assert record["causes"] == []
    wrong = CliRunner().invoke(app, ["compare", str(tmp_path / "a.npz"), str(tmp_path / "none.npz")])
    assert wrong.exit_code == 2
    assert "Traceback" not in wrong.output
