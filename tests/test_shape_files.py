"""Files and objects for other programs: meshes, organised clouds, Open3D, xarray, and `quadfringe convert`."""

from __future__ import annotations

import json
import logging
import sys
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.data import Calibration, Shape
from quadfringe.io.glb import encoded

MESHES = ("a.stl", "a.obj", "a.glb", "a.ply")


@pytest.fixture(scope="session")
def face(bench: tuple[qf.Shot, Calibration]) -> Shape:
    shot, calibration = bench
    return qf.decode(shot, qf.Plan(912, calibration=calibration))


@pytest.fixture(scope="session")
def saved(face: Shape, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("saved") / "face.npz"
    face.save(path)
    return path


@pytest.mark.parametrize("name", MESHES)
def test_meshes_open_without_a_warning(
    face: Shape, tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str
) -> None:
    face.save(tmp_path / name, faces=True, step=2)
    mesh = face.mesh(step=2)
    with caplog.at_level(logging.WARNING):
        loaded = trimesh.load_mesh(tmp_path / name, process=False)
    assert not caplog.records
    assert len(loaded.faces) == len(mesh.faces)
    # GLB holds metres with y up.
    found = loaded.triangles * np.array([1e3, -1e3, -1e3]) if name.endswith(".glb") else loaded.triangles
    np.testing.assert_allclose(found, mesh.vertices_mm[mesh.faces], atol=2e-4)
    np.testing.assert_allclose(np.sign(loaded.face_normals[:, 2]), 1 if name.endswith(".glb") else -1)


def normals_in(path: Path) -> Any:
    """Read the normals of the vertices from a file; trimesh computes them again from the triangles."""
    if path.suffix == ".obj":
        return np.array([line.split()[1:] for line in path.read_text().splitlines() if line.startswith("vn ")], float)
    if path.suffix == ".ply":
        stored = trimesh.load_mesh(path, process=False).metadata["_ply_raw"]["vertex"]["data"]
        return np.column_stack([stored[name].ravel() for name in ("nx", "ny", "nz")])
    content = path.read_bytes()
    size = int.from_bytes(content[12:16], "little")
    tree, binary = json.loads(content[20 : 20 + size]), content[28 + size :]
    accessor = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]]
    view = tree["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    return np.frombuffer(binary, "<f4", 3 * accessor["count"], start).reshape(-1, 3)


@pytest.mark.parametrize("name", ["a.obj", "a.glb", "a.ply"])
def test_meshes_keep_normals_and_colours(face: Shape, tmp_path: Path, name: str) -> None:
    mesh = face.mesh(step=4)
    mesh.save(tmp_path / name)
    loaded = trimesh.load(tmp_path / name, process=False)
    turn = np.array([1, -1, -1]) if name.endswith(".glb") else 1
    np.testing.assert_allclose(normals_in(tmp_path / name) * turn, mesh.normals, atol=1e-5)
    if name.endswith(".glb"):  # colours of glTF are linear
        (part,) = loaded.geometry.values()
        colours, material = encoded(part.visual.vertex_attributes["color"]), part.visual.material
        assert (material.metallicFactor, material.doubleSided) == (0.0, True)
    else:
        colours = loaded.visual.vertex_colors[:, :3]
    np.testing.assert_allclose(colours, mesh.colour, atol=1)


def test_mesh_of_ply_keeps_what_is_known_of_its_vertices(face: Shape, tmp_path: Path) -> None:
    mesh = face.mesh(step=4, fill_holes_px=20)
    mesh.save(tmp_path / "a.ply")
    stored = trimesh.load_mesh(tmp_path / "a.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    names = {"row", "column", "filled", "quality", "uncertainty_mm", "wrong_order_probability"}
    assert names == mesh.scalars.keys()
    for name, values in mesh.scalars.items():
        np.testing.assert_array_equal(stored[name].ravel(), values)


def test_points_of_ply_know_their_pixel_and_normal(face: Shape, tmp_path: Path) -> None:
    face.save(tmp_path / "a.ply")
    stored = trimesh.load(tmp_path / "a.ply").metadata["_ply_raw"]["vertex"]["data"]
    row, column = (stored[name].ravel() for name in ("row", "column"))
    assert face.xyz_mm is not None
    np.testing.assert_array_equal(stored["x"].ravel(), face.xyz_mm[row, column, 0])
    normal = np.column_stack([stored[name].ravel() for name in ("nx", "ny", "nz")])
    np.testing.assert_array_equal(normal, np.nan_to_num(face.normals().directions[row, column]))


def test_pcd_holds_one_point_for_each_pixel(face: Shape, tmp_path: Path) -> None:
    face.save(tmp_path / "a.pcd")
    head, _, data = (tmp_path / "a.pcd").read_bytes().partition(b"DATA binary\n")
    lines = dict(line.split(" ", 1) for line in head.decode().splitlines()[1:])
    rows, columns = face.phase_rad.shape
    assert (lines["WIDTH"], lines["HEIGHT"], lines["POINTS"]) == (str(columns), str(rows), str(rows * columns))
    names = lines["FIELDS"].split()
    assert names[:7] == ["x", "y", "z", "rgb", "normal_x", "normal_y", "normal_z"]
    assert lines["SIZE"].split() == ["4"] * len(names)
    points = np.frombuffer(data, [(name, "<f4") for name in names]).reshape(rows, columns)
    np.testing.assert_array_equal(points["z"], face.depth_mm)
    np.testing.assert_array_equal(points["uncertainty_mm"], face.uncertainty_mm)
    np.testing.assert_array_equal(points["normal_z"], face.normals().directions[..., 2])
    red = points["rgb"].copy().view(np.uint32) >> 16
    assert red.max() == 255


def test_trimesh_gets_the_mesh(face: Shape) -> None:
    found = face.to_trimesh()
    assert (len(found.vertices), len(found.faces)) == (len(face.mesh().vertices_mm), len(face.mesh().faces))
    assert np.isfinite(found.vertex_attributes["quality"]).all()


class StandIn(ModuleType):
    """The few names of Open3D that are used, where it is not installed: vectors become arrays of the wanted type."""

    def __init__(self) -> None:
        super().__init__("open3d")
        self.geometry = SimpleNamespace(PointCloud=SimpleNamespace, TriangleMesh=SimpleNamespace)
        self.utility = SimpleNamespace(
            Vector3dVector=lambda values: self.vectors(values, np.float64),
            Vector3iVector=lambda values: self.vectors(values, np.int32),
        )

    @staticmethod
    def vectors(values: Any, kind: type) -> Any:
        assert values.dtype == kind
        assert values.ndim == 2
        assert values.shape[1] == 3
        return values


def test_open3d_gets_points_and_mesh(face: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    if find_spec("open3d") is None:
        monkeypatch.setitem(sys.modules, "open3d", StandIn())
    cloud = face.to_open3d()
    assert face.xyz_mm is not None
    valid = np.isfinite(face.xyz_mm).all(axis=2)
    np.testing.assert_array_equal(np.asarray(cloud.points), face.xyz_mm[valid])
    assert np.asarray(cloud.normals).shape == np.asarray(cloud.colors).shape == (valid.sum(), 3)
    assert 0 <= np.asarray(cloud.colors).min() < np.asarray(cloud.colors).max() <= 1
    mesh = face.mesh(step=2)
    found = mesh.to_open3d()
    np.testing.assert_array_equal(np.asarray(found.triangles), mesh.faces)
    np.testing.assert_array_equal(np.asarray(found.vertex_normals), mesh.normals)


def test_xarray_gets_every_map_with_its_unit(face: Shape) -> None:
    found = face.to_xarray()
    assert found.sizes == {"row": 384, "column": 512, "axis": 3, "channel": 4}
    assert set(found.data_vars) == set(face.maps)
    for name, values in face.maps.items():
        np.testing.assert_array_equal(found[name].values, values)
        assert found[name].attrs["units"] in name or found[name].attrs["units"] == "1"
    flags = found["reason"].attrs
    names = dict(zip(flags["flag_values"], flags["flag_meanings"].split(), strict=True))
    assert names == {reason.value: reason.name.lower() for reason in qf.Reason}
    assert found["xyz_mm"].sel(row=200, column=250, axis="z").item() == face.xyz_mm[200, 250, 2]  # type: ignore[index]
    assert json.loads(found.attrs["config"]) == json.loads(json.dumps(dict(face.config)))
    assert "calibration" in found.attrs


def test_xarray_needs_no_calibration(face: Shape) -> None:
    phase_only = Shape(face.phase_rad, face.column_px, face.modulation, face.quality)
    assert set(phase_only.to_xarray().dims) == {"row", "column"}


@pytest.mark.parametrize(
    ("name", "choices", "words"),
    [
        ("a.ply", {"step": 2}, "ask for faces"),
        ("a.pcd", {"fill_holes_px": 3}, r"\.pcd holds every pixel"),
        ("a.tif", {"faces": True}, r"\.tif holds no faces"),
        ("a.xyz", {}, "expected a name that ends in"),
        ("missing/a.glb", {}, "does not exist"),
    ],
)
def test_wrong_choices_are_refused(face: Shape, tmp_path: Path, name: str, choices: dict[str, Any], words: str) -> None:
    with pytest.raises(qf.InputError, match=words):
        face.save(tmp_path / name, **choices)
    assert not list(tmp_path.iterdir())


def test_a_mesh_without_triangles_is_refused(face: Shape, tmp_path: Path) -> None:
    nothing = np.full_like(face.phase_rad, np.nan)
    empty = Shape(nothing, nothing, nothing, nothing, xyz_mm=np.full_like(face.xyz_mm, np.nan))  # type: ignore[arg-type]
    with pytest.raises(qf.InputError, match="the mesh has no triangles"):
        empty.save(tmp_path / "a.glb")
    empty.save(tmp_path / "a.pcd")
    assert (tmp_path / "a.pcd").stat().st_size > face.phase_rad.size


# The command


def run(*words: Any) -> Any:
    return CliRunner().invoke(app, ["convert", *map(str, words)])


@pytest.mark.parametrize("name", ["a.glb", "a.stl", "a.obj", "a.ply", "a.pcd", "a.tif", "a.npz"])
def test_convert_writes_each_kind(saved: Path, tmp_path: Path, name: str) -> None:
    result = run(saved, tmp_path / name)
    assert result.exit_code == 0, result.output
    assert (tmp_path / name).stat().st_size > 1000
    assert f"{name}: " in result.output


def test_convert_makes_smaller_meshes(saved: Path, tmp_path: Path) -> None:
    for name, choices in (("whole.ply", ()), ("small.ply", ("--step", 4, "--fill-holes", 20))):
        result = run(saved, tmp_path / name, "--faces", *choices)
        assert result.exit_code == 0, result.output
    whole, small = (len(trimesh.load_mesh(tmp_path / name).faces) for name in ("whole.ply", "small.ply"))
    assert 12 < whole / small < 20


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("missing.npz", "a.glb"), "missing.npz"),
        (("face.npz", "a.doc"), "expected a name that ends in"),
        (("face.npz", "a.pcd", "--step", 2), "holds every pixel"),
        (("face.npz", "a.glb", "--step", 0), "step: expected a whole number of at least 1"),
        (("face.npz", "a.glb", "--fill-holes", 5000), "fill_holes_px: expected at most 1000"),
        (("a.ply", "a.glb"), "expected a shape saved as .npz"),
    ],
)
def test_convert_refuses(saved: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[Any, ...], reason: str) -> None:
    monkeypatch.chdir(saved.parent)
    result = run(*words)
    assert result.exit_code == 2
    assert reason in result.output.replace("\n", " ")
    assert [path.name for path in saved.parent.iterdir()] == ["face.npz"]


def test_convert_counts_points_and_not_pixels(saved: Path, tmp_path: Path) -> None:
    shape = qf.Shape.load(saved)
    assert shape.xyz_mm is not None
    shape.xyz_mm[1:] = np.nan
    shape.save(tmp_path / "row.npz")
    count = np.isfinite(shape.xyz_mm[0, :, 2]).sum()
    assert f", from {count} points\n" in run(tmp_path / "row.npz", tmp_path / "row.ply").output
