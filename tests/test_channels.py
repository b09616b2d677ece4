"""Responses, crosstalk, dark level and flat field, from evenly lit shots of the virtual bench to linear light."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.bars import hold, tolerance

from quadfringe import _core
from quadfringe.calibration.channels import Channels, fit_channels
from quadfringe.calibration.flat import flat_field
from quadfringe.calibration.levels import CHANNELS, LevelPlan, dark_level, level_plan, mean_levels
from quadfringe.config import Device, SceneConfig, SystemConfig
from quadfringe.data import Calibration, Shot
from quadfringe.decoding.stages import linear_light
from quadfringe.devices.virtual import VirtualBench
from quadfringe.errors import InputError

CAMERA = Device(width_px=256, height_px=192, focal_px=(645.0, 645.0), centre_px=(127.5, 95.5))
MIXED = tuple(tuple(1.0 if i == j else 0.15 for j in range(4)) for i in range(4))
BENCHES = {
    "projector": {"projector_exponent": (2.2,) * 4},
    "camera": {"camera_exponent": (2.2,) * 4},
    "both": {"projector_exponent": (2.2, 1.8, 2.0, 1.0), "camera_exponent": (1.3, 1.0, 1.1, 1.4)},
}


def bench_of(**light: Any) -> VirtualBench:
    scene = {
        "crosstalk": MIXED,
        "noise": 0.01,
        "gain": (0.6,) * 4,
        "camera_offset": (0.02,) * 4,
        "ambient": (0.01,) * 4,
    }
    bench = VirtualBench(SystemConfig(camera=CAMERA, scene=SceneConfig.model_validate(scene | light)))
    bench.place_plane((0.0, 0.0, 800.0), (0.0, 0.0, -1.0))
    return bench


def seen_of(bench: VirtualBench, plan: LevelPlan, seed: int = 0) -> np.ndarray[Any, Any]:
    found = []
    for i, (levels, exposure) in enumerate(zip(plan.levels, plan.exposure, strict=True)):
        bench.project_levels(tuple(levels))
        found.append(mean_levels(bench.expose(seed=seed + i, exposure=float(exposure)), share=0.6))
    return np.array(found)


def dark_of(bench: VirtualBench, shots: int = 3) -> tuple[float, ...]:
    bench.project_levels((0.0,) * 4)
    return dark_level([bench.expose(seed=900 + i, capped=True) for i in range(shots)]).level


@pytest.fixture(scope="module", params=list(BENCHES))
def found(request: pytest.FixtureRequest) -> tuple[VirtualBench, Channels]:
    bench = bench_of(**BENCHES[request.param])
    plan = level_plan()
    return bench, fit_channels(plan, seen_of(bench, plan), dark_of(bench))


def test_what_is_left_keeps_the_bar(found: tuple[VirtualBench, Channels]) -> None:
    _, channels = found
    figures = channels.figures
    for figure in ("stray_before", "stray_after", "level_rms_after", "level_worst_after"):
        hold(f"calibration.{figure}_percent", figures[f"{figure}_percent"])


def test_levels_that_were_not_fitted_keep_the_bar(found: tuple[VirtualBench, Channels]) -> None:
    bench, channels = found
    random = np.random.default_rng(3)
    levels = random.uniform(0.1, 0.95, (24, 4))
    seen = seen_of(bench, LevelPlan(levels, np.ones(24)), seed=5000)
    images = [np.ascontiguousarray(column[None], np.float32) for column in seen.T]
    light = linear_light(Shot(*images, 1.0), calibration(channels))
    for i, name in enumerate(CHANNELS):
        value = light[name][0]
        scale = float(value @ levels[:, i] / (levels[:, i] @ levels[:, i]))
        hold("calibration.level_rms_after_percent", 100 * np.abs(value / scale - levels[:, i]))


def test_fringes_come_out_as_they_were_projected(found: tuple[VirtualBench, Channels]) -> None:
    """Every pixel of a shot without noise, against the ideal fringes: RMS in per cent of full scale.

    Where both bend, noise that the camera cuts off near black is seen at the steepest end of the projector's response.
    """
    _, channels = found
    settings = next(
        values for values in BENCHES.values() if exponents_of(values) == pytest.approx(exponents(channels), 0.02)
    )
    bench = _core.Bench(camera=_core.Device(256, 192, (645.0, 645.0), (127.5, 95.5)))
    cast = bench.cast("plane")
    light = {"crosstalk": MIXED, "gain": (0.6,) * 4, "ambient": (0.01,) * 4, "camera_offset": (0.02,) * 4}
    images = bench.render(cast, (36.0, 35.0, 30.0), bit_depth=16, **light, **settings)
    shot = Shot(*(images[name] for name in CHANNELS), 65535.0)
    column = cast.column_px().astype(float)
    shifts = dict(zip(CHANNELS, ((36, 0.0), (35, 0.0), (36, np.pi / 2), (30, 0.0)), strict=True))
    seen = linear_light(shot, calibration(channels))
    for name, (number, shift) in shifts.items():
        ideal = 0.5 + 0.5 * np.cos(2 * np.pi * number * column / 912 + shift)
        scale = float((seen[name] * ideal).sum() / (ideal * ideal).sum())
        rms = float(np.sqrt(np.mean((seen[name] / scale - ideal) ** 2)))
        both = settings is BENCHES["both"]
        hold("calibration.fringes_both_rms_percent" if both else "calibration.fringes_rms_percent", 100 * rms)


def exponents(channels: Channels) -> list[float]:
    pairs = [
        (getattr(channels.response, n).exponent, getattr(channels.projector_response, n).exponent) for n in CHANNELS
    ]
    return [value for camera, projector in pairs for value in (camera, 1 / projector)]


def exponents_of(settings: dict[str, Any]) -> list[float]:
    ones = (1.0,) * 4
    pairs = zip(settings.get("camera_exponent", ones), settings.get("projector_exponent", ones), strict=True)
    return [value for pair in pairs for value in pair]


def calibration(channels: Channels) -> Calibration:
    return Calibration(camera=CAMERA, projector=CAMERA, **channels.keywords())


def test_camera_and_projector_are_told_apart(found: tuple[VirtualBench, Channels]) -> None:
    _, channels = found
    near = tolerance("calibration.exponent_error")
    assert any(exponents(channels) == pytest.approx(exponents_of(values), abs=near) for values in BENCHES.values())
    hold("calibration.crosstalk_error", np.abs(np.array(channels.crosstalk) - MIXED))
    hold("calibration.exponent_sd", channels.camera_exponent_sd)


def test_captures_at_fault_are_explained() -> None:
    bench, plan = bench_of(), level_plan(4)
    seen = seen_of(bench, plan)
    with pytest.raises(InputError, match="expected 23 captures of 4 channels"):
        fit_channels(plan, seen[:-1])
    with pytest.raises(InputError, match="red is saturated in all but 0 captures"):
        fit_channels(plan, np.ones_like(seen))
    with pytest.raises(InputError, match="put the channels into the order"):
        fit_channels(plan, seen_of(bench_of(crosstalk=None, gain=(0.9, 0.9, 0.9, 0.001)), plan))
    with pytest.raises(InputError, match="two shots or more"):
        dark_level([bench.expose(capped=True)])
    bench.project_levels((1.0,) * 4)
    with pytest.raises(InputError, match="put the cap on"):
        dark_level([bench.expose(), bench.expose()])


def test_a_flat_field_is_made_even() -> None:
    random = np.random.default_rng(1)
    y, x = np.mgrid[:480, :640]
    fall = 1 - 0.4 * (((x - 320) / 320) ** 2 + ((y - 240) / 240) ** 2) / 2
    gain = fall * (1 + 0.01 * random.standard_normal((480, 640)))
    gain[30, 40] = 0.0

    def shot() -> Shot:
        images = [0.5 * gain + 0.01 * random.standard_normal(gain.shape) for _ in CHANNELS]
        return Shot(*(np.clip(image, 0, 1).astype(np.float32) for image in images), 1.0)

    found = flat_field([shot() for _ in range(16)])
    assert found.defects == 4
    assert np.isnan(found.gain[0, 30, 40])
    hold("calibration.vignetting_error_percent", abs(found.figures["vignetting_percent"] - 40))
    hold("calibration.pixels_error_percent", abs(found.figures["pixels_percent"] - 1.0))
    after_over_before = found.figures["uneven_after_percent"] / found.figures["uneven_before_percent"]
    hold("calibration.flat_field_after_over_before", after_over_before)
    with pytest.raises(InputError, match="4 shots or more"):
        flat_field([shot()] * 3)
    with pytest.raises(InputError, match="red has 0% of full scale"):
        flat_field([Shot(*(np.zeros((20, 20), np.float32),) * 4, 1.0)] * 4)
