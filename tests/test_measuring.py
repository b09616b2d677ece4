"""Measuring on a shape: points under a ray, distances with their noise, and sections."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.stepped import SOUGHT, STEP_MM, stepped_shape, towards

from quadfringe.data import Shape
from quadfringe.view import measuring
from quadfringe.view._items import Grid
from quadfringe.view.measuring import Ray, Spot


@pytest.fixture(scope="module")
def shape() -> Shape:
    return stepped_shape()


@pytest.mark.parametrize("eye", [(0.0, 0.0, 0.0), (-90.0, 40.0, 300.0), (5.0, 5.0, 1800.0)])
def test_a_ray_finds_its_pixel(shape: Shape, eye: tuple[float, float, float]) -> None:
    spot = Grid(shape).spot(towards(shape, SOUGHT, eye))
    assert spot is not None
    assert shape.xyz_mm is not None
    assert spot.pixel == SOUGHT
    np.testing.assert_allclose(spot.place_mm, shape.xyz_mm[SOUGHT], rtol=1e-6)
    assert spot.uncertainty_mm == pytest.approx(0.12)


def test_the_foremost_surface_is_taken() -> None:
    far = np.stack([*np.mgrid[-5:6, -5:6], np.full((11, 11), 900)], axis=2).reshape(-1, 3).astype(float)
    near = far * [1, 1, 0] + [0, 0, 500]
    ray = Ray(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    assert measuring.nearest(np.concatenate([far, near]), ray, 1.0) == 121 + 60
    assert measuring.nearest(near, Ray(np.array([0.0, 0.0, 600.0]), ray.direction), 1.0) is None, "it lies behind"


def test_a_ray_near_a_thin_part_finds_it_and_far_away_nothing() -> None:
    point = np.array([[0.0, 0.0, 1000.0]])
    for off_mm, expected in ((4.0, 0), (8.0, None)):
        ray = Ray(np.array([off_mm, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        assert measuring.nearest(point, ray, 0.3) == expected


def first_hit(box: trimesh.Trimesh, ray: Ray) -> np.ndarray | None:
    """Where a ray meets any triangle first, one after another."""
    found = []
    for a, b, c in box.triangles:
        matrix = np.column_stack([b - a, c - a, -ray.direction])
        if abs(np.linalg.det(matrix)) > 1e-9:
            u, v, depth = np.linalg.solve(matrix, ray.origin - a)
            if min(u, v, 1 - u - v, depth) > 0:
                found.append(depth)
    return ray.origin + min(found) * ray.direction if found else None


@pytest.mark.parametrize("seed", range(8))
def test_hits_are_those_of_every_triangle(seed: int) -> None:
    box = trimesh.creation.icosphere(subdivisions=2, radius=30.0)
    noise = np.random.default_rng(seed)
    origin = noise.normal(size=3) * 60
    direction = noise.normal(size=3) * 20 - origin
    ray = Ray(origin, direction / np.linalg.norm(direction))
    expected = first_hit(box, ray)
    found = measuring.hit(np.asarray(box.vertices), np.asarray(box.faces), ray)
    assert (found is None) is (expected is None)
    if found is not None:
        np.testing.assert_allclose(found.place_mm, expected, atol=1e-9)
        assert np.linalg.norm(box.vertices[found.corner] - expected) < 10, "the corner is one of that triangle"


def test_distances_and_their_noise() -> None:
    a, b = Spot((30.0, 0.0, 600.0), None, 0.3), Spot((30.0, 0.0, 640.0), None, 0.4)
    found = measuring.distance(a, b)
    assert (found.length_mm, found.parts_mm) == (40.0, (0.0, 0.0, 40.0))
    # Both points move along z, and the distance with them.
    assert found.uncertainty_mm == pytest.approx(0.5)
    assert measuring.distance(a, Spot((31.0, 0.0, 600.0))).uncertainty_mm is None
    assert measuring.distance(a, a).uncertainty_mm is None


def test_the_noise_of_distances_is_that_of_noisy_points() -> None:
    places = np.array([[100.0, 20.0, 700.0], [-60.0, 90.0, 760.0]])
    noise = np.random.default_rng(1)
    moved = places[None] * (1 + noise.normal(size=(20_000, 2, 1)) * 0.2 / places[None, :, 2:])
    spread = np.linalg.norm(moved[:, 0] - moved[:, 1], axis=1).std()
    a, b = (Spot((x, y, z), None, 0.2) for x, y, z in places)
    assert measuring.distance(a, b).uncertainty_mm == pytest.approx(spread, rel=0.03)


def test_a_section_over_pixels_shows_the_step_and_what_is_missing(shape: Shape) -> None:
    assert shape.depth_mm is not None
    across = measuring.grid_section(shape.depth_mm, shape.uncertainty_mm, (10, 10), (10, 70))
    assert len(across.along) == 61
    assert across.height_mm[0] - across.height_mm[-1] == STEP_MM
    down = measuring.grid_section(shape.depth_mm, None, (59, 10), (40, 10))
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(down.height_mm)), [9])
    oblique = measuring.grid_section(shape.depth_mm, None, (0, 0), (30, 40))
    assert oblique.along[-1] == 50.0
    assert len(measuring.grid_section(shape.depth_mm, None, (5, 5), (5, 5)).height_mm) == 2


def test_a_section_of_triangles_follows_a_ball() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=50.0)
    view = np.array([0.0, 0.0, 1.0])  # along z: the foremost side is that of negative z
    first, last = (-40.0, 0.0, -30.0), (40.0, 0.0, -30.0)
    found = measuring.plane_section(ball.vertices, ball.faces, first, last, view)
    expected = np.sqrt(50.0**2 - (found.along - 40) ** 2) - 30
    np.testing.assert_allclose(found.height_mm[2:-2], expected[2:-2], atol=0.1)
    wide = measuring.plane_section(ball.vertices, ball.faces, (-60.0, 0.0, -60.0), (60.0, 0.0, -60.0), view)
    assert np.isnan(wide.height_mm[[0, -1]]).all()
    assert np.isfinite(wide.height_mm[200])
    along = measuring.plane_section(ball.vertices, ball.faces, (0.0, 0.0, -50.0), (0.0, 0.0, 50.0), view)
    assert np.isfinite(along.height_mm).any(), "the line lies in the direction of sight"
