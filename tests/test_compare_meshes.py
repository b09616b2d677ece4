"""A shape against a mesh: exact distances, signs, alignment, and the command."""

from __future__ import annotations

import json
import os
import struct
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


@pytest.mark.parametrize("name", ["b.stl", "b.obj", "b.glb", "b.ply"])
def test_a_shape_agrees_with_its_own_mesh(seen: np.ndarray, tmp_path: Path, name: str) -> None:
    """Each file has the units and axes of its format; those of .glb are metres with y up."""
    shape = shape_of(seen)
    shape.mesh().save(tmp_path / name)
    found = qf.compare(shape, tmp_path / name)
    assert isinstance(found, MeshComparison)
    assert found.matched_percent == 100
    hold("compare.own_mesh_mm", np.abs(found.distance_mm).max())


def test_triangles_beyond_the_reach_are_not_searched(bumps: trimesh.Trimesh) -> None:
    """A mesh in metres lies far from all points, all triangles about equally near: a search among all takes minutes."""
    surface = Surface(np.asarray(bumps.triangles))
    points = np.add(bumps.triangles_center, (0, 0, 0.5))
    points[::2, 2] += 500
    found = surface.closest(points, 5.0)
    np.testing.assert_array_equal(found.distances_mm[1::2], surface.closest(points[1::2]).distances_mm)
    assert np.isinf(found.distances_mm[::2]).all()
    for group in surface._groups:
        assert np.isinf(group.nearest(points[::2], 6, 5.0 + group.radius_mm)[0]).all()


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


def glb(document: str) -> bytes:
    text = document.encode() + b" " * (-len(document) % 4)
    return b"glTF" + struct.pack("<II", 2, 20 + len(text)) + struct.pack("<I4s", len(text), b"JSON") + text


WITHOUT_DATA = (
    '{"asset": {"version": "2.0"}, "accessors": [{"componentType": 5126, "count": 300000000, "type": "VEC3"}], '
    '"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}], '
    '"scenes": [{"nodes": [0]}]}'
)
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("m.glb", glb("[" * 100_000), "cannot be read as a mesh: "),
        ("m.glb", glb(WITHOUT_DATA), "cannot be read as a mesh: "),
        ("m.obj", (CORNERS + "f 1 2 99999999\n").encode(), "cannot be read as a mesh: index 99999998 is out of bounds"),
        (
            "m.obj",
            CORNERS.replace("1", "1e308").encode() + b"f 1 2 3\n",
            r"expected a mesh in mm within a kilometre, got .* 1e\+308 mm",
        ),
        ("m.stl", bytes(80) + b"\xff" * 4 + bytes(50), "expected a mesh with triangles"),
        (
            "m.ply",
            b"ply\nformat ascii 1.0\nelement vertex -5\nproperty zzz x\nend_header\n",
            "cannot be read as a mesh",
        ),
        ("m.dae", b"<COLLADA/>", r"expected a name that ends in \.stl, \.ply, \.obj, \.glb"),
        ("m.zip", b"PK\5\6" + bytes(18), r"expected a name that ends in \.stl, \.ply, \.obj, \.glb"),
    ],
)
def test_hostile_meshes_are_refused_with_one_line(name: str, content: bytes, reason: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(qf.InputError, match=rf"{name}: {reason}") as found:
        surface_from(tmp_path / name)
    assert "\n" not in str(found.value)


def test_a_mesh_that_takes_too_long_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadfringe.io.mesh_files.TIME_S", 0.001)
    (tmp_path / "m.obj").write_text(CORNERS + "f 1 2 3\n")
    with pytest.raises(qf.InputError, match=r"m\.obj: cannot be read as a mesh: it does not end within"):
        surface_from(tmp_path / "m.obj")


def test_a_mesh_makes_the_program_read_no_other_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "m.mtl")  # who opens it waits
    (tmp_path / "m.obj").write_text("mtllib m.mtl\nusemtl a\n" + CORNERS + "f 1 2 3\n")
    assert len(surface_from(tmp_path / "m.obj").triangles_mm) == 1
