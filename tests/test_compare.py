"""Comparison of shapes: the difference, its figures, its causes, and the ways in which it can go wrong."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from support.bars import bar, hold

import quadfringe as qf
from quadfringe import _core
from quadfringe.config import Device
from quadfringe.data import Calibration, core_device
from quadfringe.decoding.compare import Deviations, Explanation, ShapeComparison
from quadfringe.decoding.compare.deviations import bands_of, deviations_of
from quadfringe.decoding.compare.forms import blur_of, fit_form
from quadfringe.decoding.compare.synthesis import recipe_of
from quadfringe.evaluation.comparing import faults_of

SMALL = Device(width_px=512, height_px=384, focal_px=(1290.325, 1290.325), centre_px=(255.5, 191.5))
NOISE = 0.03


class Stage:
    """The small bench, its calibration, and shapes of its scenes."""

    def __init__(self) -> None:
        self.bench = _core.Bench(camera=core_device(SMALL))
        with qf.open(qf.SystemConfig(camera=SMALL)) as scanner:
            assert scanner.calibration is not None
            self.calibration: Calibration = scanner.calibration

    def shape(self, cast: _core.Cast, seed: int, **options: object) -> qf.Shape:
        images = self.bench.render(cast, (36, 35, 30), noise=NOISE, seed=seed, **options)
        shot = qf.Shot(images["red"], images["green"], images["blue"], images["ir"])
        plan = qf.Plan(912, calibration=self.calibration, response="linear")
        return qf.Decoder(shot, plan).decode(shot)


@pytest.fixture(scope="module")
def stage() -> Stage:
    return Stage()


@pytest.fixture(scope="module")
def plane(stage: Stage) -> qf.Shape:
    return stage.shape(stage.bench.cast("plane"), 1)


# Figures


def test_figures_of_known_differences() -> None:
    random = np.random.default_rng(0)
    difference = 0.5 + 0.1 * random.standard_normal((200, 200))
    found = deviations_of(difference, np.ones((200, 200), bool), np.full((200, 200), 0.5), "mm")
    assert found.bias == pytest.approx(0.5, rel=bar("compare.normal").upper)
    assert found.robust_rms == pytest.approx(0.1, rel=bar("compare.normal").upper)
    assert found.rms == pytest.approx(float(np.hypot(0.5, 0.1)), rel=bar("compare.normal").upper)
    assert found.inside_percent[0] == pytest.approx(50, rel=bar("compare.normal").upper)
    assert found.inside_percent[1:] == (100.0, 100.0)
    assert set(found.figures()) >= {"bias_mm", "rms_mm", "inside_1_percent"}


def test_slow_and_fast_parts() -> None:
    y, x = np.mgrid[:200, :300].astype(float)
    slow, fast = np.sin(x / 60), 0.1 * np.sin(2 * np.pi * x / 5)
    found = bands_of(slow + fast, np.ones(x.shape, bool), 8.0)
    hold("compare.slow_part", np.std((found.form - slow)[30:-30, 30:-30]))
    assert found.noise_rms < found.form_rms
    fitted = fit_form(2.0 + 0.01 * y)
    np.testing.assert_allclose(fitted.form, 2.0 + 0.01 * y, atol=1e-9)


def test_blur_is_told_from_less_light() -> None:
    frequency = np.linspace(0.02, 0.05, 5000)
    blurred = 2 * np.pi**2 * 9.0 * frequency**2
    assert blur_of(blurred, frequency) == pytest.approx(9.0, rel=1e-6)
    assert blur_of(np.full(5000, 0.7), frequency) == pytest.approx(0.0, abs=1e-6)


# Bars


def test_a_tenth_of_a_millimetre_between_two_planes_is_found(stage: Stage, plane: qf.Shape) -> None:
    near = stage.shape(stage.bench.cast_plane(point_mm=(0, 0, 799.9), normal=(0, 0, -1)), 2)
    found = qf.compare(near, plane)
    hold("compare.step_mm", -found.overall.bias)
    assert [one.name for one in found.causes] == ["calibration or pose"]


def test_a_step_of_a_tenth_of_a_millimetre_in_a_plane_is_found(stage: Stage, plane: qf.Shape) -> None:
    heights = np.zeros((2, 200))
    heights[:, 100:] = 0.1
    cast = stage.bench.cast_height_map(heights, pitch_mm=(3.0, 800.0), origin_mm=(-300.0, -400.0), z_mm=800.0)
    found = qf.compare(stage.shape(cast, 3), plane, causes=False)
    profile = found.profiles["image column"]
    left, right = (np.median(profile.bias[part]) for part in (profile.at < 230, profile.at > 280))
    hold("compare.step_mm", left - right)
    plane_albedo = found.profiles["albedo"]
    assert plane_albedo.unit == "share of full scale"
    assert 0.4 < np.average(plane_albedo.at, weights=plane_albedo.pixels) < 0.6


@pytest.mark.parametrize("surface", ["plane", "face", "peaks"])
def test_faults_are_named_and_sound_shapes_have_none(stage: Stage, surface: str) -> None:
    cast = stage.bench.cast(surface)
    sound = stage.shape(cast, 12)
    assert qf.compare(stage.shape(cast, 4), sound).causes == ()
    for cause, strength in (("gamma", "1.2"), ("crosstalk", "10 % ir in green"), ("defocus", "3 px")):
        fault = next(one for one in faults_of(cause) if one.strength == strength)
        faulty = stage.shape(cast, 4, **fault.options)
        named = [one.name for one in qf.compare(faulty, sound).causes]
        assert named[:1] == [cause], (surface, cause, named)


def test_the_fault_of_the_second_shape_has_the_other_sign(stage: Stage, plane: qf.Shape) -> None:
    bent = stage.shape(stage.bench.cast("plane"), 4, projector_exponent=(1.2,) * 4)
    cause = qf.compare(plane, bent).causes[0]
    assert cause.name == "gamma"
    visible, infrared = map(float, re.findall(r"-?\d\.\d+", cause.evidence))
    hold("compare.exponent_share", [visible / -0.2, infrared / -0.2])


def test_the_order_of_a_pair_changes_no_cause(stage: Stage, plane: qf.Shape) -> None:
    bent = stage.shape(stage.bench.cast("plane"), 4, projector_exponent=(1.1,) * 4)
    first, second = (qf.compare(*pair).causes[0] for pair in ((bent, plane), (plane, bent)))
    assert first.name == second.name == "gamma"
    assert first.size == pytest.approx(second.size)
    assert first.share == pytest.approx(second.share)


def test_half_the_light_is_named(stage: Stage, plane: qf.Shape) -> None:
    dim = stage.shape(stage.bench.cast("plane"), 4, gain=(0.5,) * 4)
    assert [one.name for one in qf.compare(dim, plane).causes] == ["less light"]


def test_wrong_orders_are_named(plane: qf.Shape) -> None:
    phase, column = plane.phase_rad.copy(), plane.column_px.copy()
    phase[100:160, 100:200] += np.float32(2 * np.pi)
    column[100:160, 100:200] += np.float32(912 / 36)
    found = qf.compare(replace(plane, phase_rad=phase, column_px=column), plane)
    assert [one.name for one in found.causes] == ["wrong orders"]
    assert found.wrong_order.sum() == 60 * 100
    assert found.right.rms == 0


@pytest.mark.parametrize("other", ["face", "peaks"])
def test_another_object_is_not_blamed_on_the_orders(stage: Stage, plane: qf.Shape, other: str) -> None:
    found = qf.compare(stage.shape(stage.bench.cast(other), 1), plane)
    assert "another surface" in [one.name for one in found.causes]
    assert "wrong orders" not in [one.name for one in found.causes]


# Other pairs


def test_a_shape_compared_with_itself(plane: qf.Shape) -> None:
    found = qf.compare(plane, plane)
    assert (found.overall.rms, found.wrong_order_percent, found.both_percent, found.causes) == (0, 0, 100, ())
    assert len(repr(found)) < 240


def test_phase_alone_is_compared_in_radians(plane: qf.Shape) -> None:
    phase_only = replace(plane, xyz_mm=None, uncertainty_mm=None, calibration=None)
    found = qf.compare(phase_only, phase_only, causes=False)
    assert (found.overall.unit, found.difference_mm) == ("rad", None)
    assert "rms_rad" in found.figures()
    mixed = qf.compare(plane, phase_only, causes=False)
    assert mixed.overall.unit == "rad"
    assert "B holds phase only" in mixed.warnings[0]


def test_shapes_without_a_common_point_are_doubted(plane: qf.Shape) -> None:
    assert plane.xyz_mm is not None
    nowhere = replace(plane, xyz_mm=np.full_like(plane.xyz_mm, np.nan))
    assert qf.compare(plane, nowhere, causes=False).warnings == (
        "no pixel has a point in both, so that no depths are compared",
    )


def test_other_calibrations_and_fringes_are_doubted(plane: qf.Shape) -> None:
    assert plane.calibration is not None
    other = plane.calibration.model_copy(update={"response": None})
    assert "calibrations" in qf.compare(plane, replace(plane, calibration=other), causes=False).warnings[0]
    fewer = replace(plane, phase_rad=plane.phase_rad * np.float32(32 / 36))
    assert "fringes" in qf.compare(plane, fewer, causes=False).warnings[0]


def test_what_cannot_be_compared_is_refused(plane: qf.Shape) -> None:
    cut = qf.Shape(*(getattr(plane, name)[:100] for name in ("phase_rad", "column_px", "modulation", "quality")))
    with pytest.raises(qf.InputError, match=r"one camera, got 512 x 384 and 512 x 100"):
        qf.compare(plane, cut)
    empty = replace(plane, phase_rad=plane.phase_rad * np.nan, column_px=plane.column_px * np.nan)
    with pytest.raises(qf.InputError, match="no pixel is returned by both"):
        qf.compare(plane, empty)
    with pytest.raises(qf.InputError, match="expected a Shape, or the path"):
        qf.compare(np.zeros((3, 3)), plane)  # type: ignore[call-overload]
    with pytest.raises(qf.InputError, match=r"expected a shape \(\.npz\) or a mesh"):
        qf.compare(plane, "part.step")


def test_few_pixels_name_no_waves(plane: qf.Shape) -> None:
    few = plane.phase_rad.copy()
    few[:, 12:] = np.nan
    found = qf.compare(replace(plane, phase_rad=few), plane)
    assert found.causes == ()
    assert recipe_of(replace(plane, config={})) is None


@pytest.mark.parametrize("size", [(1, 1), (9, 9), (12, 700)])
def test_small_shapes_are_compared(size: tuple[int, int]) -> None:
    column_px = np.tile(np.linspace(300, 310, size[1], dtype=np.float32), (size[0], 1))
    even = np.full(size, 0.4, np.float32)
    shape = qf.Shape(np.float32(2 * np.pi * 36 / 912) * column_px, column_px, even, even)
    found = qf.compare(shape, shape)
    assert (found.overall.unit, found.overall.rms, found.causes) == ("rad", 0, ())


def test_a_shape_without_modulation_names_no_loss(plane: qf.Shape) -> None:
    assert qf.compare(replace(plane, modulation=plane.modulation * np.float32(np.nan)), plane).causes == ()


def test_records_read_well() -> None:
    one = Deviations("mm", 10, 0.1, 0.2, 0.15, 0.4, (60.0, 90.0, 99.0))
    words = repr(Explanation("gamma", "because", 0.5, 0.2)) + repr(one)
    assert "gamma" in words
    assert ShapeComparison.__doc__
