"""Height from phase by polynomial and by triangulation on the same shots; planes, spheres and steps as artefacts."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.bars import bar, hold, tolerance
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.calibration.acceptance import Acceptance, Artefacts, Limits, accept, measure_artefacts, write_acceptance
from quadfringe.calibration.height import HeightCalibration, compare_heights, fit_heights, heights_over
from quadfringe.calibration.surfaces import (
    Sphere,
    dominant_plane,
    dominant_sphere,
    fit_plane,
    fit_sphere,
    form_of,
    measure_steps,
)
from quadfringe.calibration.trueness import (
    dimension_trueness_percent,
    global_planarity_mm,
    local_planarity_mm,
    point_precision_mm,
)
from quadfringe.cli import app
from quadfringe.config import Device, SceneConfig, SystemConfig
from quadfringe.devices.virtual import VirtualBench
from quadfringe.errors import InputError

SMALL = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
HEIGHTS_MM = (-45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0)


@pytest.fixture(scope="module")
def planes() -> list[qf.Shape]:
    """Decoded planes at HEIGHTS_MM, and one at 22 mm that no fit has seen."""
    bench = VirtualBench(SystemConfig(camera=SMALL, scene=SceneConfig(noise=0.01, bit_depth=12)))
    bench.project(qf.Fringes())
    shots = []
    for i, height in enumerate((*HEIGHTS_MM, 22.0)):
        bench.place_plane((0.0, 0.0, 800.0 - height), (0.0, 0.0, -1.0))
        shots.append(bench.expose(seed=i))
    decoder = qf.Decoder(shots[0], qf.Plan(912, calibration=bench.calibration()))
    return [decoder.decode(shot) for shot in shots]


@pytest.fixture(scope="module")
def heights(planes: list[qf.Shape]) -> HeightCalibration:
    return fit_heights(HEIGHTS_MM, [shape.phase_rad for shape in planes[:-1]])


def test_polynomial_and_triangulation_agree(planes: list[qf.Shape], heights: HeightCalibration) -> None:
    polynomial = [heights.height_from_phase(shape.phase_rad) for shape in planes]
    triangulated = [heights_over(shape.xyz_mm, planes[3].xyz_mm) for shape in planes]
    found = compare_heights(polynomial, triangulated)
    assert found.pixels > 1_000_000
    hold("heights.agreement_rms_mm", found.rms_mm)
    hold("heights.agreement_mean_mm", abs(found.mean_mm))
    hold("heights.scale_percent", abs(found.scale_percent))
    for ways in (polynomial, triangulated):
        unseen = ways[-1][30:-30, 30:-30]
        hold("heights.unseen_mean_mm", abs(np.nanmean(unseen) - 22.0))
        hold("heights.unseen_sd_mm", np.nanstd(unseen))


def test_heights_beyond_the_planes_are_no_data(planes: list[qf.Shape]) -> None:
    found = fit_heights(HEIGHTS_MM[1:6], [shape.phase_rad for shape in planes[1:6]])
    hold("heights.refused_beyond", np.isnan(found.height_from_phase(planes[0].phase_rad)).mean())
    hold("heights.returned_within", np.isfinite(found.height_from_phase(planes[2].phase_rad)).mean())


def test_height_calibrations_come_back(heights: HeightCalibration, planes: list[qf.Shape], tmp_path: Path) -> None:
    heights.save(tmp_path / "h.npz")
    again = HeightCalibration.load(tmp_path / "h.npz")
    expected = heights.height_from_phase(planes[1].phase_rad)
    np.testing.assert_array_equal(again.height_from_phase(planes[1].phase_rad), expected)
    assert (again.heights_mm, again.degree) == (HEIGHTS_MM, 3)
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(InputError, match="not a height calibration"):
        HeightCalibration.load(tmp_path / "other.npz")


def test_planes_at_fault_are_explained(planes: list[qf.Shape], heights: HeightCalibration) -> None:
    phases = [shape.phase_rad for shape in planes[:-1]]
    with pytest.raises(InputError, match="7 heights for 6 phase maps"):
        fit_heights(HEIGHTS_MM, phases[:-1])
    with pytest.raises(InputError, match="all must have one size"):
        fit_heights(HEIGHTS_MM, [*phases[:-1], phases[-1][:-1]])
    with pytest.raises(InputError, match="4 different heights for degree 3"):
        fit_heights(HEIGHTS_MM[:4], phases[:4])
    with pytest.raises(ValueError, match="phase map"):
        heights.height_from_phase(np.zeros((3, 4), np.float32))
    with pytest.raises(InputError, match="no pixel has a height both"):
        compare_heights([np.full((4, 4), np.nan, np.float32)], [np.zeros((4, 4), np.float32)])


@pytest.fixture(scope="module")
def accepted() -> Acceptance:
    """The published bench at 1024 x 768, 1 % noise."""
    return accept(measure_artefacts(SystemConfig(scene=SceneConfig(noise=0.01))))


def test_the_instrument_is_accepted(accepted: Acceptance) -> None:
    assert {line.name: line.value_mm for line in accepted.lines if not line.accepted} == {}
    for name, limit in vars(Limits()).items():
        assert limit == tolerance(f"acceptance.{name}"), name
    hold("acceptance.sphere_form_mm", accepted.figures["sphere_1_form_6sigma_mm"])
    hold("acceptance.plane_form_mm", accepted.figures["plane_1_form_6sigma_mm"])
    assert len(accepted.lines) == 2 + 2 + 9


def test_precision_and_trueness_are_stated(accepted: Acceptance) -> None:
    hold("acceptance.point_precision_mm", accepted.figures["point_precision_mm"])
    for plane in ("plane_1", "plane_2"):
        hold("acceptance.local_planarity_mm", accepted.figures[f"{plane}_local_planarity_precision_mm"])
        hold("acceptance.global_planarity_mm", accepted.figures[f"{plane}_global_planarity_trueness_mm"])
    for artefact in ("sphere_1", "steps_1"):
        hold("acceptance.dimension_percent", accepted.figures[f"{artefact}_dimension_trueness_percent"])


def test_precision_and_trueness_of_known_points() -> None:
    random = np.random.default_rng(0)
    y, x = np.mgrid[:256, :256].astype(float)
    scatter = 0.02 * random.standard_normal((2, *x.shape))
    bowed = 0.1 * np.cos(np.pi * x / 255)  # mean deviations of up to 0.1 mm, nearly flat within a tile
    assert local_planarity_mm(bowed + scatter[0]) == pytest.approx(0.02, rel=bar("compare.normal").upper)
    assert global_planarity_mm(bowed) == pytest.approx(0.1, rel=bar("acceptance.tile_share").upper)
    shapes = [np.stack([x, y, 800 + part], axis=-1) for part in scatter]
    assert point_precision_mm(shapes) == pytest.approx(0.02, rel=bar("compare.normal").upper)
    assert point_precision_mm([shapes[0], shapes[1] + 2.0]) is None
    assert point_precision_mm([shapes[0], shapes[1][:100]]) is None
    assert dimension_trueness_percent([0.1, -0.3], [10.0, 60.0]) == pytest.approx(1.0)


def test_the_report_is_drawn(accepted: Acceptance, tmp_path: Path) -> None:
    write_acceptance(tmp_path / "a.png", accepted)
    assert (tmp_path / "a.png").stat().st_size > 50_000


def sphere_points(centre: tuple[float, ...], radius: float, noise: float = 0.0) -> np.ndarray:
    random = np.random.default_rng(2)
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 120), np.linspace(-0.8, 0.8, 120))
    z = -np.sqrt(np.where(x**2 + y**2 < 0.64, 1 - x**2 - y**2, np.nan))
    away = radius + noise * random.standard_normal(x.shape)
    return np.stack([x, y, z], axis=-1) * away[..., None] + np.array(centre)


def test_fits_find_what_was_there() -> None:
    points = sphere_points((10.0, -5.0, 800.0), 30.0, 0.01)
    sphere = fit_sphere(points)
    near_mm = tolerance("fitting.sphere_mm")
    np.testing.assert_allclose(sphere.centre_mm, (10.0, -5.0, 800.0), atol=near_mm)
    assert sphere.radius_mm == pytest.approx(30.0, abs=near_mm)
    x, y = np.meshgrid(np.arange(200.0), np.arange(150.0))
    flat = np.stack([x - 100, y - 75, 800 + 0.1 * x], axis=-1)
    flat[20:60, 30:70] -= (0, 0, 15.0)
    plane = dominant_plane(flat)
    assert plane.normal @ np.array([0.1, 0, -1]) / np.sqrt(1.01) == pytest.approx(1.0, abs=1e-9)
    scene = np.concatenate([points.reshape(-1, 3), flat.reshape(-1, 3) + np.array((0, 0, 60.0))])
    among = dominant_sphere(scene, 60.0)
    np.testing.assert_allclose(among.centre_mm, (10.0, -5.0, 800.0), atol=tolerance("fitting.sphere_among_mm"))
    assert plane.distances_mm([0.0, 0.0, 0.0]) > 0  # the camera is on the positive side
    assert Sphere(np.zeros(3), 1.0).distances_mm([0.0, 0.0, 3.0]) == 2.0


def test_the_base_of_a_staircase_is_found_whatever_the_draw() -> None:
    # Eight treads of 5 mm; the base has a quarter of the points, the next tread a fifth.
    shares = np.cumsum([0.25, 0.2, 0.15, 0.1, 0.1, 0.08, 0.07])
    x, y = np.meshgrid(np.linspace(-60.0, 60.0, 200), np.linspace(-45.0, 45.0, 150))
    tread = np.searchsorted(shares, (x + 60.0) / 120.0)
    noise_mm = 0.1 * np.random.default_rng(4).standard_normal(x.shape)
    xyz = np.stack([x, y, 800.0 - 5.0 * tread + noise_mm], axis=-1)
    for seed in range(20):
        hold("fitting.base_mm", abs(dominant_plane(xyz, seed=seed).offset_mm + 800.0))


def test_form_leaves_out_three_in_a_thousand() -> None:
    values = np.linspace(-0.05, 0.05, 10_000)
    values[:20] = 5.0
    form = form_of(values)
    hold("fitting.form_mm", abs(form.form_mm - 0.1))
    hold("fitting.range_mm", abs(form.range_mm - 5.05))
    hold("fitting.form_mm", abs(form_of(np.append(values[20:], np.nan)).form_6sigma_mm - 0.1))
    with pytest.raises(InputError, match="at least 100"):
        form_of(values[:50])


def test_steps_are_measured_and_missing_ones_named() -> None:
    x, y = np.meshgrid(np.arange(240.0), np.arange(180.0))
    z = np.full(x.shape, 800.0)
    z[40:90, 40:90] -= 10.02
    z[40:90, 120:170] -= 20.0
    xyz = np.stack([x - 120, y - 90, z], axis=-1)
    found = measure_steps(xyz, (10.0, 20.0))
    assert found.errors_mm == pytest.approx((0.02, 0.0), abs=1e-6)
    with pytest.raises(InputError, match="points lie near 30 mm"):
        measure_steps(xyz, (10.0, 30.0))
    with pytest.raises(InputError, match="at least 2 mm apart"):
        measure_steps(xyz, (10.0, 11.0))


def test_artefacts_that_are_not_there_are_named() -> None:
    flat = np.dstack([*np.meshgrid(np.arange(300.0), np.arange(200.0)), np.full((200, 300), 800.0)])
    with pytest.raises(InputError, match="found no sphere of about 60 mm"):
        accept(Artefacts(spheres=(flat,), sphere_diameter_mm=60.0))
    with pytest.raises(InputError, match="0 points"):
        fit_plane(np.full((4, 4, 3), np.nan))


def test_saved_shapes_are_judged_on_the_command_line(planes: list[qf.Shape], tmp_path: Path) -> None:
    planes[3].save(tmp_path / "plane.npz")
    run = CliRunner().invoke(app, ["accept", "--plane", str(tmp_path / "plane.npz"), "--json", "-"])
    assert run.exit_code == 0, run.output
    hold("acceptance.plane_form_mm", json.loads(run.stdout)["figures"]["plane_1_form_mm"])
    tight = CliRunner().invoke(app, ["accept", "--plane", str(tmp_path / "plane.npz"), "--plane-form-mm", "0.001"])
    assert (tight.exit_code, "NO" in tight.stdout) == (1, True)
    assert CliRunner().invoke(app, ["accept", "--steps", str(tmp_path / "plane.npz")]).exit_code == 2
