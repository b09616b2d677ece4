"""Meshes and normals: what is joined, what is not, holes, hostile points, and the truth of the virtual bench."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold

import quadfringe as qf
from quadfringe import _core
from quadfringe.data import Shape
from quadfringe.evaluation import mesh_truth
from quadfringe.evaluation.mesh_truth import Topology

FOCAL_PX = 2500.0
ROWS, COLUMNS = 12, 16
Map = NDArray[np.float32]


def shape_of(depth_mm: Any, uncertainty_mm: Any = 0.01) -> Shape:
    """Give a shape with this depth on the rays of a camera."""
    depth = np.broadcast_to(np.asarray(depth_mm, np.float32), (ROWS, COLUMNS))
    row, column = np.mgrid[0:ROWS, 0:COLUMNS].astype(np.float32)
    points = np.stack([column / FOCAL_PX * depth, row / FOCAL_PX * depth, depth], axis=2)
    sigma = np.broadcast_to(np.asarray(uncertainty_mm, np.float32), depth.shape)
    known = np.where(np.isfinite(depth), np.float32(0.9), np.float32("nan"))
    return Shape(known, known, known, known, xyz_mm=points.astype(np.float32), uncertainty_mm=sigma.copy())


def plane() -> Map:
    return np.full((ROWS, COLUMNS), 800, np.float32)


def test_a_plane_is_one_piece_and_faces_the_camera() -> None:
    mesh = shape_of(plane()).mesh()
    assert repr(mesh) == f"Mesh({ROWS * COLUMNS} vertices, {2 * (ROWS - 1) * (COLUMNS - 1)} triangles)"
    assert mesh_truth.topology_of(mesh.faces) == Topology(euler=1, borders=1)
    a, b, c = mesh.vertices_mm[mesh.faces].astype(np.float64).swapaxes(0, 1)
    assert (np.cross(b - a, c - a)[:, 2] < 0).all()
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0, -1], (ROWS * COLUMNS, 1)), atol=1e-3)
    assert mesh.pixel[COLUMNS + 2].tolist() == [1, 2]
    assert not mesh.filled.any()


def test_a_step_is_not_joined_and_a_slope_is() -> None:
    step, slope = plane(), plane() + np.arange(COLUMNS, dtype=np.float32)
    step[:, 8:] -= 5
    assert mesh_truth.topology_of(shape_of(step).mesh().faces) == Topology(euler=2, borders=2)
    assert mesh_truth.topology_of(shape_of(slope).mesh().faces) == Topology(euler=1, borders=1)
    noisy = shape_of(step, uncertainty_mm=1.5).mesh()
    assert mesh_truth.topology_of(noisy.faces) == Topology(euler=1, borders=1)


def test_a_diagonal_does_not_cross_an_edge() -> None:
    depth = np.where(np.add.outer(np.arange(ROWS), np.arange(COLUMNS)) < 12, 800, 790)
    mesh = shape_of(depth).mesh()
    assert (np.ptp(mesh.vertices_mm[mesh.faces][:, :, 2], axis=1) == 0).all()
    # Every pixel but the corner that has no neighbour on its side keeps its place.
    assert len(mesh.vertices_mm) == ROWS * COLUMNS


def test_three_points_of_a_cell_give_one_triangle() -> None:
    depth = plane()
    depth[0, 0] = np.nan
    mesh = shape_of(depth).mesh()
    assert len(mesh.faces) == 2 * (ROWS - 1) * (COLUMNS - 1) - 1
    assert len(mesh.vertices_mm) == ROWS * COLUMNS - 1


def test_normals_turn_with_the_surface_and_their_noise_is_stated() -> None:
    random = np.random.default_rng(5)
    tilt, sigma = 0.3, np.float32(0.02)
    errors, stated = [], []
    for _ in range(40):
        column = np.arange(COLUMNS, dtype=np.float64)
        # The plane z = 800 + tilt x in the frame of the camera.
        depth = 800 / (1 - tilt * column / FOCAL_PX) + random.normal(0, sigma, (ROWS, COLUMNS))
        found = shape_of(depth, sigma).normals()
        truth = np.array([tilt, 0, -1], np.float32) / np.hypot(tilt, 1)
        inner = np.s_[1:-1, 1:-1]
        errors.append(mesh_truth.normal_errors_rad(found.directions[inner], truth))
        stated.append(found.uncertainty_rad[inner])
    ratio = np.sqrt(np.mean(np.square(errors)) / np.mean(np.square(stated)))
    hold("mesh.normal_error_over_stated_independent", ratio)


def test_small_holes_are_filled_and_marked() -> None:
    depth = plane() + 0.2 * np.arange(COLUMNS, dtype=np.float32)
    whole = shape_of(depth).xyz_mm
    assert whole is not None
    depth[4:6, 5:8] = np.nan
    shape = shape_of(depth)
    assert not shape.mesh(fill_holes_px=5).filled.any()
    mesh = shape.mesh(fill_holes_px=6)
    assert repr(mesh).endswith("6 filled)")
    assert mesh_truth.topology_of(mesh.faces) == Topology(euler=1, borders=1)
    assert mesh.quality is not None
    assert np.isnan(mesh.quality[mesh.filled]).all()
    assert np.isfinite(mesh.quality[~mesh.filled]).all()
    row, column = mesh.pixel[mesh.filled].T
    np.testing.assert_allclose(mesh.vertices_mm[mesh.filled], whole[row, column], atol=0.02)


@pytest.mark.parametrize("case", ["step", "border"])
def test_other_holes_stay(case: str) -> None:
    depth = plane()
    if case == "step":
        depth[:, 8:] -= 5
        depth[4:6, 7:9] = np.nan
    else:
        depth[0:2, 3] = np.nan
    assert not shape_of(depth).mesh(fill_holes_px=100).filled.any()


def test_every_second_pixel() -> None:
    mesh = shape_of(plane()).mesh(step=2)
    assert (mesh.step, repr(mesh)[-8:]) == (2, " step 2)")
    assert (mesh.pixel % 2 == 0).all()
    assert len(mesh.vertices_mm) == (ROWS // 2) * (COLUMNS // 2)
    step = plane()
    step[:, 7] -= 5  # between the pixels that are kept
    torn = shape_of(step).mesh(step=2)
    assert mesh_truth.topology_of(torn.faces) == Topology(euler=2, borders=2)


def test_colour_is_given_or_grey() -> None:
    shape = shape_of(plane())
    assert shape.mesh().colour.shape == (ROWS * COLUMNS, 3)
    colour = np.random.default_rng(0).integers(0, 255, (ROWS, COLUMNS, 3), np.uint8)
    np.testing.assert_array_equal(shape.mesh(colour=colour).colour, colour.reshape(-1, 3))


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"step": 0}, "step: expected a whole number of at least 1, got 0"),
        ({"step": 1.5}, "step: expected a whole number of at least 1, got 1.5"),
        ({"fill_holes_px": -1}, "fill_holes_px: expected a whole number of at least 0, got -1"),
        ({"fill_holes_px": 10**6}, "fill_holes_px: expected at most 1000, got 1000000"),
        ({"fill_holes_px": 10**30}, "fill_holes_px: expected at most 1000, got 10{30}"),
        ({"step": 10**30}, "step: expected at most 65536, got 10{30}"),
        ({"colour": np.zeros((2, 2, 3), np.uint8)}, r"colour: expected a picture of uint8 \(12, 16, 3\)"),
        ({"colour": "red"}, "colour: expected a picture of uint8 .* got str"),
    ],
)
def test_wrong_choices_are_refused(choices: dict[str, Any], words: str) -> None:
    with pytest.raises(qf.InputError, match=words):
        shape_of(plane()).mesh(**choices)


def test_a_shape_without_millimetres_is_refused() -> None:
    known = plane()
    for method in ("mesh", "normals", "to_trimesh", "to_open3d"):
        with pytest.raises(qf.InputError, match="decode with a calibration"):
            getattr(Shape(known, known, known, known), method)()


def hostile(change: Callable[[Map], None]) -> Shape:
    shape = shape_of(plane())
    assert shape.xyz_mm is not None
    change(shape.xyz_mm)
    return shape


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -800.0])
def test_points_that_are_none_give_no_triangles(value: float) -> None:
    def spoil(points: Map) -> None:
        points[..., 2] = value

    mesh = hostile(spoil).mesh(fill_holes_px=100)
    assert repr(mesh) == "Mesh(0 vertices, 0 triangles)"


@pytest.mark.parametrize("value", [3e38, 1e-38, np.float32(1e-45)])
def test_extreme_points_keep_the_rest_whole(value: float) -> None:
    def spoil(points: Map) -> None:
        points[3:5, 4] = value

    mesh = hostile(spoil).mesh(fill_holes_px=100)
    assert np.isfinite(mesh.vertices_mm).all()
    assert len(mesh.faces) > ROWS * COLUMNS
    ordinary = np.abs(mesh.vertices_mm[:, 2] - 800) < 1
    assert (ordinary[mesh.faces].all(axis=1) | ~ordinary[mesh.faces].any(axis=1)).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (2, 2)])
def test_small_images(size: tuple[int, int]) -> None:
    shape = shape_of(plane())
    assert shape.xyz_mm is not None
    rows, columns = size
    points = shape.xyz_mm[:rows, :columns].copy()
    found = _core.mesh_from_points(points, step=1, holes_px=10)
    assert len(found["faces"]) == 2 * (rows - 1) * (columns - 1)
    assert _core.normals_from_points(points)["normals"].shape == (rows, columns, 3)


@pytest.mark.parametrize("step", [3, 100])
def test_steps_that_leave_little(step: int) -> None:
    mesh = shape_of(plane()).mesh(step=step)
    assert len(mesh.faces) == 2 * ((ROWS - 1) // step) * ((COLUMNS - 1) // step)


def test_maps_of_unequal_size_are_refused() -> None:
    points = np.zeros((4, 5, 3), np.float32)
    with pytest.raises(ValueError, match="uncertainty_mm: expected"):
        _core.mesh_from_points(points, np.zeros((5, 4), np.float32))
    with pytest.raises(ValueError, match="xyz_mm: expected 3 numbers"):
        _core.mesh_from_points(np.zeros((4, 5, 2), np.float32))
    with pytest.raises(TypeError, match="xyz_mm: expected a 3D float32 array"):
        _core.mesh_from_points(points.astype(np.float64))


# The truth of the virtual bench


def measured(surface: str) -> tuple[Shape, qf.Truth]:
    with qf.open_system(qf.SystemConfig(scene=qf.SceneConfig(surface=surface, noise=0.03, seed=4))) as scanner:
        shot = scanner.grab()
        assert shot.truth is not None
        return scanner.decode(shot), shot.truth


@pytest.mark.parametrize("surface", ["steps", "face"])
def test_no_triangle_crosses_a_true_step(surface: str) -> None:
    shape, truth = measured(surface)
    mesh = shape.mesh()
    steps = mesh_truth.Steps.of(lambda bench: bench.cast(surface))
    assert np.count_nonzero(steps.right) > 1000
    hold("mesh.crossing_triangles", mesh_truth.crossing_triangles(mesh, steps))
    hold("mesh.in_mesh_percent", 100 * len(mesh.vertices_mm) / shape.returned.sum())
    found, true = shape.normals(), _core.normals_from_points(truth.xyz_mm)["normals"]
    errors = mesh_truth.normal_errors_rad(found.directions, true)
    known = np.isfinite(errors) & ~truth.edge
    hold("mesh.normal_error_over_stated", np.median(errors[known] / found.uncertainty_rad[known]))


def test_triangles_across_steps_are_counted() -> None:
    """The judge itself: a mesh that joins everything crosses the steps."""
    shape, _ = measured("steps")
    careless = Shape(*[shape.phase_rad] * 4, xyz_mm=shape.xyz_mm, uncertainty_mm=np.full_like(shape.phase_rad, 20))
    steps = mesh_truth.Steps.of(lambda bench: bench.cast("steps"))
    assert mesh_truth.crossing_triangles(careless.mesh(), steps) > 1000


def test_a_convex_part_has_no_holes() -> None:
    """The cap of the sphere that the camera sees at 40 degrees or more: one piece with one border."""
    shape, truth = measured("sphere")
    mesh = shape.mesh()
    centre, radius = np.array([-62.0, -22.0, 738.0]), 34.0
    row, column = mesh.pixel.T
    true = truth.xyz_mm[row, column].astype(np.float64)
    outward = true - centre
    on_sphere = np.abs(np.linalg.norm(outward, axis=1) - radius) < 0.01
    facing = -np.sum(outward * true, axis=1) / np.linalg.norm(outward, axis=1) / np.linalg.norm(true, axis=1)
    inside = on_sphere & (facing > np.sin(np.radians(40)))
    assert inside.sum() > 10_000
    assert mesh_truth.topology_of(mesh.faces[inside[mesh.faces].all(axis=1)]) == Topology(euler=1, borders=1)
