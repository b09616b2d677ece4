"""The reference measurement: noise against its bound, orders on real captures, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold
from support.steps import COLUMN_PX, NUMBERS, WIDTH_PX, errors_px, levels, stacks

import quadfringe as qf
from quadfringe.decoding import StepSettings, decode_steps
from quadfringe.errors import DecodeError, InputError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import reference


@pytest.mark.parametrize("steps", [(3, 3, 3), (4, 4, 4), (5, 5, 5), (8, 8, 8), (12, 12, 12), (12, 4, 3)])
def test_any_number_of_steps_reaches_the_bound(steps: tuple[int, int, int]) -> None:
    noise = 0.01
    shape = decode_steps(stacks(steps, noise=noise), NUMBERS, WIDTH_PX)
    information = sum((n / 36) ** 2 * s / 2 * (0.3 / noise) ** 2 for n, s in zip(NUMBERS, steps, strict=True))
    error_rad = 2 * np.pi * 36 / WIDTH_PX * errors_px(shape)
    assert shape.returned.all()
    hold("reference.rms_over_least", np.sqrt(np.mean(error_rad**2) * information))
    assert shape.uncertainty_rad is not None
    hold("reference.inside_1_sigma", np.mean(np.abs(error_rad) < shape.uncertainty_rad))


@pytest.mark.parametrize(
    ("numbers", "steps"),
    [((16.0, 15.0), (8, 8)), ((1.0,), (4,)), ((30.0, 36.0, 35.0), (4, 4, 4)), ((36.0, 35.0, 30.0, 7.5), (4, 3, 5, 6))],
)
def test_any_fringe_numbers(numbers: tuple[float, ...], steps: tuple[int, ...]) -> None:
    shape = decode_steps(stacks(steps, numbers), numbers, WIDTH_PX)
    hold("reference.exact_px", np.abs(errors_px(shape)).max() * max(numbers) / 36)
    by_phase_px = shape.phase_rad * WIDTH_PX / (2 * np.pi * numbers[0])
    hold("reference.exact_px", np.abs(by_phase_px - shape.column_px).max())


def test_the_kinds_of_images_agree() -> None:
    light = stacks((8, 8, 8), noise=0.01)
    eight, sixteen = levels(light, 255), levels(light, 65535)
    twelve = levels(light, 4095)
    exact = decode_steps(light, NUMBERS, WIDTH_PX)
    for images, full_scale in ((sixteen, None), (twelve, 4095.0), (eight, None)):
        found = decode_steps(images, NUMBERS, WIDTH_PX, settings=StepSettings(full_scale=full_scale))
        hold("reference.kinds_px", np.abs(found.column_px - exact.column_px).max())
        hold("reference.kinds_modulation", np.abs(found.modulation - exact.modulation).max())


def test_the_fields_of_a_shape() -> None:
    shape = decode_steps(levels(stacks((4, 4, 4), noise=0.01), 255), NUMBERS, WIDTH_PX)
    assert shape.config["decode"]["method"] == "reference"
    assert (shape.config["fringes"]["numbers"], shape.config["steps"]) == (list(NUMBERS), [4, 4, 4])
    assert (shape.config["response"], shape.config["response_from"]) == (None, None), "no calibration states one"
    assert shape.wrong_order_probability is not None
    hold("reference.wrong_order_probability", shape.wrong_order_probability.max())
    assert np.all((shape.quality >= 0) & (shape.quality <= 1))


def test_a_gamma_does_not_matter_with_many_steps_and_is_undone_with_few() -> None:
    def bent(steps: int) -> list[NDArray[np.float32]]:
        return [image**2.2 for image in stacks((steps,) * 3)]

    many = decode_steps(bent(12), NUMBERS, WIDTH_PX)
    hold("reference.exact_px", np.abs(errors_px(many)).max())
    three = bent(3)
    bent_px = np.abs(errors_px(decode_steps(three, NUMBERS, WIDTH_PX))).max()
    channel = qf.config.ChannelResponse(exponent=1 / 2.2)
    undone = decode_steps(three, NUMBERS, WIDTH_PX, response=qf.Response(green=channel))
    hold("reference.exact_px", np.abs(errors_px(undone)).max())
    assert bent_px > np.abs(errors_px(undone)).max()


def test_saturated_samples_are_left_out_of_the_fit() -> None:
    clipped = stacks((8, 8, 8), level=0.75)
    assert min(np.max(stack) for stack in clipped) == 1
    shape = decode_steps(clipped, NUMBERS, WIDTH_PX)
    assert shape.returned.all()
    hold("reference.exact_px", np.abs(errors_px(shape)).max())
    kept = decode_steps(clipped, NUMBERS, WIDTH_PX, settings=StepSettings(saturation=2.0))
    assert np.abs(errors_px(kept)).max() > np.abs(errors_px(shape)).max()


def test_pixels_that_too_few_samples_determine_are_no_data() -> None:
    images = stacks((4, 4, 4))
    for stack in images:
        stack[:2, 10:20, 30:60] = 1.0
        stack[:, 40:, 200:] = 0.001  # a shadow
    shape = decode_steps(images, NUMBERS, WIDTH_PX)
    lost = np.zeros(COLUMN_PX.shape, bool)
    lost[10:20, 30:60] = lost[40:, 200:] = True
    assert np.array_equal(shape.returned, ~lost)
    for values in shape.maps.values():
        assert np.isfinite(values[~lost]).all()


def test_strays_are_no_data() -> None:
    images = stacks((8, 8, 8), noise=0.01)
    rng = np.random.default_rng(3)
    shuffled = np.zeros(COLUMN_PX.shape, bool)
    shuffled[20:30, 100:140] = True
    for stack in images:  # pixels whose phases are arbitrary
        shift_rad = rng.uniform(0, 2 * np.pi, shuffled.sum())
        shifts_rad = 2 * np.pi * np.arange(8)[:, None] / 8
        stack[:, shuffled] = 0.5 + 0.3 * np.cos(shift_rad + shifts_rad)
    shape = decode_steps(images, NUMBERS, WIDTH_PX)
    # Some arbitrary phases come near to those of a column by chance.
    hold("reference.strays_returned_percent", 100 * shape.returned[shuffled].mean())
    assert shape.returned[~shuffled].all()


def test_a_range_of_columns_makes_a_repeating_code_unique() -> None:
    numbers = (36.0, 33.0)  # they repeat after 304 columns
    images = stacks((8, 8), numbers)
    with pytest.raises(ValueError, match="look alike"):
        decode_steps(images, numbers, WIDTH_PX)
    shape = decode_steps(images, numbers, WIDTH_PX, settings=StepSettings(columns_px=(60.0, 340.0)))
    hold("reference.exact_px", np.abs(errors_px(shape)).max())
    with pytest.raises(ValueError, match="columns_px: expected a range in which all columns differ"):
        decode_steps(images, numbers, WIDTH_PX, settings=StepSettings(columns_px=(0.0, 600.0)))


def test_results_do_not_depend_on_layout_of_memory() -> None:
    images = levels(stacks((4, 4, 4), noise=0.02), 255)
    plain = decode_steps(images, NUMBERS, WIDTH_PX)
    turned = [np.asfortranarray(stack) for stack in images]
    again = decode_steps(turned, NUMBERS, WIDTH_PX)
    for name, values in plain.maps.items():
        assert np.array_equal(values, again.maps[name], equal_nan=True)


def test_wrong_stacks_are_named() -> None:
    good = stacks((4, 4, 4))
    cases = [
        (good[:2], NUMBERS, r"stacks: expected 3, one for each fringe number, got 2"),
        ([], (), r"fringe_numbers: expected at least one"),
        ([good[0][:2], *good[1:]], NUMBERS, r"steps of 36 fringes: expected at least 3, got 2"),
        ([good[0], good[1][:, :-1], good[2]], NUMBERS, r"stack 1 .*expected \[4, 64, 256\].*got \[4, 63, 256\]"),
        ([good[0], good[1][0], good[2]], NUMBERS, r"stack 1: expected an array \(steps, H, W\)"),
        (good, (36.0, 35.0, np.nan), r"fringe number"),
        (good, (36.0, 36.0, 36.0), r"look alike"),
    ]
    for images, numbers, words in cases:
        with pytest.raises((InputError, ValueError), match=words):
            decode_steps(images, numbers, WIDTH_PX)


def test_mixed_types_nan_and_huge_light_are_refused() -> None:
    light = stacks((4, 4, 4))
    with pytest.raises(TypeError, match="stack 1: expected a 3D uint8 array, got a 3D float32 array"):
        decode_steps([levels(light, 255)[0], *light[1:]], NUMBERS, WIDTH_PX)
    with pytest.raises(TypeError, match="uint8, uint16 or float32"):
        decode_steps([stack.astype(np.float64) for stack in light], NUMBERS, WIDTH_PX)
    light[2][3, 5, 6] = np.nan
    with pytest.raises(ValueError, match=r"stack 2, step 3.*row 5, column 6"):
        decode_steps(light, NUMBERS, WIDTH_PX)
    light[2][3, 5, 6] = 1e9
    with pytest.raises(ValueError, match="times full scale"):
        decode_steps(light, NUMBERS, WIDTH_PX)


def test_shapes_beyond_memory_are_refused() -> None:
    endless = np.lib.stride_tricks.as_strided(np.zeros(1, np.uint8), (4, 1 << 20, 1 << 20), (0, 0, 0))
    with pytest.raises(InputError, match="GB of memory"):
        decode_steps([endless] * 3, NUMBERS, WIDTH_PX)


def test_a_single_row_and_a_single_pixel_are_decoded() -> None:
    for part in (np.s_[:, :1, :], np.s_[:, :1, :1]):
        images = [stack[part] for stack in stacks((4, 4, 4))]
        shape = decode_steps(images, NUMBERS, WIDTH_PX)
        hold("reference.exact_px", np.abs(shape.column_px - COLUMN_PX[part[1:]]).max())


def test_darkness_and_images_in_another_order_are_refused() -> None:
    with pytest.raises(DecodeError, match="no pixel has fringes"):
        decode_steps(stacks((4, 4, 4), amplitude=0.001), NUMBERS, WIDTH_PX)
    images = np.concatenate(stacks((4, 4, 4), noise=0.01))
    alternating = [np.ascontiguousarray(images[k::3]) for k in range(3)]
    with pytest.raises(DecodeError, match="order of the images"):
        decode_steps(alternating, NUMBERS, WIDTH_PX)


def test_the_calibration_must_fit(bench: tuple[qf.Shot, qf.Calibration]) -> None:
    _, calibration = bench
    images = stacks((4, 4, 4))
    with pytest.raises(InputError, match="512 x 384 pixels"):
        decode_steps(images, NUMBERS, WIDTH_PX, calibration=calibration)
    with pytest.raises(InputError, match="channel: expected red"):
        StepSettings(channel="grey")  # type: ignore[arg-type]


@pytest.mark.parametrize(("surface", "steps", "noise"), [("peaks", 12, 0.01), ("steps", 12, 0.01), ("face", 4, 0.03)])
def test_noise_on_the_bench_is_near_the_least_possible(surface: str, steps: int, noise: float) -> None:
    found = reference.virtual_figures(surface, steps, noise, seed=1)
    hold("reference.rms_over_least", found["rms_over_least"])
    hold("reference.inside_1_sigma", found["inside_1_sigma"])
    hold("reference.inside_2_sigma", found["inside_2_sigma"])
    hold("reference.returned_percent", found["returned_percent"])
    assert found["wrong"] <= np.ceil(found["wrong_promised"])


@pytest.mark.parametrize("name", scenes.CAPTURES)
def test_orders_of_the_captures(data_dir: Path, name: str) -> None:
    found = reference.capture_figures(data_dir, name)
    hold("reference.captures_right_percent", found["right_percent"])
    hold("reference.captures_right_of_returned_percent", found["right_of_returned_percent"])
    assert found["wrong"] <= found["wrong_promised"]
