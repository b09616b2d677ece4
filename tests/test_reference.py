"""The reference measurement: noise against its bound, orders on real captures, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold
from typer.testing import CliRunner

import quadfringe as qf
from quadfringe.cli import app
from quadfringe.decoding import StepSettings, decode_steps, read_steps
from quadfringe.devices import ExternalLight
from quadfringe.errors import ConfigError, DecodeError, InputError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import reference

WIDTH_PX, NUMBERS = 912, (36.0, 35.0, 30.0)
COLUMN_PX = 100 + 0.7 * np.arange(256) + 0.3 * np.sin(np.arange(64) / 9)[:, None]


def stacks(
    steps: tuple[int, ...],
    numbers: tuple[float, ...] = NUMBERS,
    noise: float = 0.0,
    level: float = 0.5,
    amplitude: float = 0.3,
) -> list[NDArray[np.float32]]:
    """Give step images of a smooth surface, shares of full scale, clipped at 1."""
    rng = np.random.default_rng(7)
    found = []
    for number, count in zip(numbers, steps, strict=True):
        phase_rad = 2 * np.pi * number * COLUMN_PX / WIDTH_PX
        shifts_rad = 2 * np.pi * np.arange(count)[:, None, None] / count
        light = level + amplitude * np.cos(phase_rad + shifts_rad)
        found.append(np.clip(light + noise * rng.standard_normal(light.shape), 0, 1).astype(np.float32))
    return found


def levels(images: list[NDArray[np.float32]], full_scale: int) -> list[NDArray[np.uint8 | np.uint16]]:
    dtype = np.uint8 if full_scale == 255 else np.uint16
    return [np.round(image * full_scale).astype(dtype) for image in images]


def errors_px(shape: qf.Shape) -> NDArray[np.float64]:
    return np.asarray(shape.column_px - COLUMN_PX)


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
    assert np.abs(errors_px(shape)).max() < 2e-3 * 36 / max(numbers)
    assert np.allclose(shape.phase_rad, 2 * np.pi * numbers[0] * shape.column_px / WIDTH_PX, atol=1e-3)


def test_the_kinds_of_images_agree() -> None:
    light = stacks((8, 8, 8), noise=0.01)
    eight, sixteen = levels(light, 255), levels(light, 65535)
    twelve = levels(light, 4095)
    exact = decode_steps(light, NUMBERS, WIDTH_PX)
    for images, full_scale in ((sixteen, None), (twelve, 4095.0), (eight, None)):
        found = decode_steps(images, NUMBERS, WIDTH_PX, settings=StepSettings(full_scale=full_scale))
        assert np.abs(found.column_px - exact.column_px).max() < 0.03
        assert np.allclose(found.modulation, exact.modulation, atol=2e-3)


def test_the_fields_of_a_shape() -> None:
    shape = decode_steps(levels(stacks((4, 4, 4), noise=0.01), 255), NUMBERS, WIDTH_PX)
    assert shape.config["decode"]["method"] == "reference"
    assert (shape.config["fringes"]["numbers"], shape.config["steps"]) == (list(NUMBERS), [4, 4, 4])
    assert shape.wrong_order_probability is not None
    assert float(shape.wrong_order_probability.max()) < 1e-3
    assert np.all((shape.quality > 0.8) & (shape.quality <= 1))


def test_a_gamma_does_not_matter_with_many_steps_and_is_undone_with_few() -> None:
    def bent(steps: int) -> list[NDArray[np.float32]]:
        return [image**2.2 for image in stacks((steps,) * 3)]

    many = decode_steps(bent(12), NUMBERS, WIDTH_PX)
    assert np.abs(errors_px(many)).max() < 2e-3
    three = bent(3)
    assert np.abs(errors_px(decode_steps(three, NUMBERS, WIDTH_PX))).max() > 0.05
    channel = qf.config.ChannelResponse(exponent=1 / 2.2)
    undone = decode_steps(three, NUMBERS, WIDTH_PX, response=qf.Response(green=channel))
    assert np.abs(errors_px(undone)).max() < 2e-3


def test_saturated_samples_are_left_out_of_the_fit() -> None:
    clipped = stacks((8, 8, 8), level=0.75)
    assert np.mean([np.mean(stack >= 1) for stack in clipped]) > 0.1
    shape = decode_steps(clipped, NUMBERS, WIDTH_PX)
    assert shape.returned.all()
    assert np.abs(errors_px(shape)).max() < 2e-3
    kept = decode_steps(clipped, NUMBERS, WIDTH_PX, settings=StepSettings(saturation=2.0))
    assert np.abs(errors_px(kept)).max() > 0.02


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
    assert np.abs(errors_px(shape)).max() < 2e-3
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
        assert np.abs(shape.column_px - COLUMN_PX[part[1:]]).max() < 2e-3


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
    assert found["wrong"] <= found["wrong_promised"] + 1


@pytest.mark.parametrize("name", scenes.CAPTURES)
def test_orders_of_the_captures(data_dir: Path, name: str) -> None:
    found = reference.capture_figures(data_dir, name)
    hold("reference.captures_right_percent", found["right_percent"])
    hold("reference.captures_right_of_returned_percent", found["right_of_returned_percent"])
    assert found["wrong"] <= found["wrong_promised"]


def run(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the steps of three fringe numbers in the order of their names."""
    where = tmp_path_factory.mktemp("steps")
    for k, stack in enumerate(levels(stacks((4, 4, 4), noise=0.01), 255)):
        for s, image in enumerate(stack):
            cv2.imwrite(str(where / f"f{k}_s{s}.png"), image)
    return where


def test_the_command_reads_folders_and_files_in_both_orders(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "ref.npz"
    words = ["--steps", 4, "--numbers", 36, 35, 30]
    more = ["--projector-width", WIDTH_PX, "--out", out]
    code, text = run("decode", *words, folder, *more, "--json", tmp_path / "f.json")
    assert code == 0, text
    assert json.loads((tmp_path / "f.json").read_text())["figures"]["returned_percent"] == 100.0
    by_folder = qf.Shape.load(out)
    files = sorted(folder.iterdir())
    for order, listed in (("frequency", files), ("step", [files[4 * k + s] for s in range(4) for k in range(3)])):
        code, text = run("decode", *words, *listed, *more, "--order", order)
        assert code == 0, text
        assert np.array_equal(qf.Shape.load(out).phase_rad, by_folder.phase_rad)
    assert np.abs(errors_px(by_folder)).max() < 1


def test_the_command_explains_what_is_wrong(folder: Path, tmp_path: Path) -> None:
    files, out = sorted(folder.iterdir()), tmp_path / "ref.npz"
    more = ["--projector-width", WIDTH_PX, "--out", out]
    steps = ["decode", "--steps", 4, "--numbers", 36, 35, 30]
    cases = [
        ([*steps, *files[:11]], 2, "expected 12 images, 11 are given"),
        ([*steps, *files, files[0]], 2, "name only the images of the steps"),
        ([*steps, *files, "--method", "joint"], 2, "--method: only for a single shot"),
        ([*steps, *files, "--order", "step"], 1, "order of the images"),
        (["decode", "--steps", 4, *files], 2, "--numbers"),
        (["decode", "--steps", 2, "--numbers", 36, *files], 2, "at least 3"),
        (["decode", folder], 2, "--fringes"),
        (["decode", "--fringes", 36, 35, 30, *files], 2, "expected one folder"),
    ]
    for words, status, text in cases:
        code, output = run(*words, *more)
        assert (code, text in output) == (status, True), output
    assert not out.exists()


def test_read_steps_wants_images_alike(folder: Path, tmp_path: Path) -> None:
    assert [stack.shape for stack in read_steps(folder, 3, 4)] == [(4, 64, 256)] * 3
    files = sorted(folder.iterdir())
    cv2.imwrite(str(tmp_path / "other.png"), np.zeros((8, 8), np.uint16))
    with pytest.raises(InputError, match=r"other.png: 8 x 8 uint16, but .* is 256 x 64 uint8"):
        read_steps([*files[:11], tmp_path / "other.png"], 3, 4)


def test_a_scanner_measures_with_steps(small_bench: Path, tmp_path: Path) -> None:
    out = tmp_path / "ref.npz"
    code, text = run("measure", small_bench / "system.toml", "--reference", "--steps", 4, "--out", out)
    assert code == 0, text
    shape = qf.Shape.load(out)
    assert (shape.config["decode"]["method"], shape.config["steps"]) == ("reference", [4, 4, 4])
    assert shape.config["scene"]["surface"] == "steps"
    with qf.open(small_bench / "system.toml") as scanner:
        single = scanner.measure()
        shown = []
        show = scanner.projector.show
        scanner.projector.show = lambda light: (shown.append(light), show(light))
        infrared = scanner.measure(reference=True, steps=3, infrared=True)
        with pytest.raises(InputError, match="at least 3, got 2"):
            scanner.measure(reference=True, steps=2)
    assert [(light.number, light.beam) for light in shown] == [(n, "infrared") for n in NUMBERS for _ in range(3)]
    assert single.depth_mm is not None
    for found in (shape, infrared):
        assert found.depth_mm is not None
        apart_mm = (found.depth_mm - single.depth_mm)[found.returned & single.returned]
        assert np.median(np.abs(apart_mm)) < 0.3
    code, text = run("measure", small_bench / "system.toml", "--steps", 4, "--out", out)
    assert (code, "--reference" in text) == (2, True)


def test_a_system_without_projector_says_so(small_bench: Path) -> None:
    with qf.open(small_bench / "system.toml") as scanner:
        scanner.projector = ExternalLight()
        with pytest.raises(ConfigError, match="no projector"):
            scanner.measure(reference=True)
