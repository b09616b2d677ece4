"""A shot with a sound region is not refused: the region is returned, and its orders are right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold

import quadfringe as qf
from quadfringe.config import Device
from quadfringe.data import Reason
from quadfringe.decoding import verdict_params
from quadfringe.decoding._kernel import KernelDecoder
from quadfringe.decoding.closures import closure_of
from quadfringe.decoding.trusted import is_scattered, trusted_part
from quadfringe.errors import DecodeError
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import scoring
from quadfringe.evaluation._isolated import isolated, outline

NAMES = ("red", "green", "blue", "ir")
CAMERA = Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
NUMBERS = (36.0, 35.0, 30.0)

Images = dict[str, NDArray[np.uint8]]


def images_of(surface: str, seed: int, numbers: tuple[float, ...] = NUMBERS) -> tuple[Images, NDArray[np.float32]]:
    """Expose a small frame; give its images and the true columns."""
    scene = qf.SceneConfig.model_validate({"surface": surface, "noise": 0.01, "seed": seed})
    config = qf.SystemConfig(camera=CAMERA, scene=scene, fringes=qf.Fringes(numbers=numbers))
    with qf.open(config) as scanner:
        shot = scanner.grab()
    assert isinstance(shot, qf.Shot)
    assert shot.truth is not None
    return {name: image.copy() for name, image in shot.channels.items()}, shot.truth.column_px


def shot_of(images: Images) -> qf.Shot:
    return qf.Shot(*(np.ascontiguousarray(images[name]) for name in NAMES))


def plan_of(numbers: tuple[float, ...] = NUMBERS) -> qf.Plan:
    return qf.Plan(912, fringes=numbers, response="linear")


@pytest.mark.parametrize(
    ("bar", "fill", "seed", "level"),
    [("small_right_percent", 0.02, 31, 0.5), ("right_percent", 0.06, 33, 0.5), ("right_percent", 0.08, 34, 0.4)],
)
def test_an_object_before_an_even_wall_is_decoded(bar: str, fill: float, seed: int, level: float) -> None:
    scene = isolated(33, fill, seed, contrast=0.9)
    wall = ~outline(scene.red.shape, fill, seed)
    noise = np.random.default_rng(seed)
    lit: dict[str, Any] = {
        name: np.where(wall, np.round(255 * noise.normal(level, 0.01, wall.shape)), image).astype(np.uint8)
        for name, image in scene.channels.items()
    }
    found = scoring.score(scene, scenes.shape_of(replace(scene, **lit), response="linear").phase_rad)
    hold(f"wall.{bar}", found.right_percent)
    hold("wall.right_of_returned_percent", found.right_of_returned_percent)


def test_noise_has_no_region_of_fringes() -> None:
    for seed in range(8):
        noise = np.random.default_rng(seed)
        low, high = sorted(noise.integers(0, 256, 2))
        images = {name: noise.integers(low, high + 1, (144, 192)).astype(np.uint8) for name in NAMES}
        plan = replace(plan_of(), decode=qf.DecodeConfig(method="published"))
        shape = KernelDecoder((144, 192), 255.0, plan).shape(shot_of(images))
        assert is_scattered(shape)
        assert trusted_part(shape, shot_of(images), plan) is None


def shifted(images: Images, columns: int) -> None:
    images["ir"][:, :columns] = np.roll(images["ir"], 8, axis=1)[:, :columns]


def exchanged(images: Images, columns: int) -> None:
    red = images["red"][:, :columns].copy()
    images["red"][:, :columns] = images["blue"][:, :columns]
    images["blue"][:, :columns] = red


def saturated(images: Images, columns: int) -> None:
    for image in images.values():
        image[:, :columns] = 255


@pytest.mark.parametrize(
    ("spoil", "share", "words"),
    [
        (shifted, 0.75, "the infrared fringes lie .* of the image that fit are returned"),
        (exchanged, 0.75, "red and blue seem to be swapped"),
        (saturated, 0.8, "too much light"),
    ],
)
@pytest.mark.parametrize(("surface", "seed"), [("face", 41), ("peaks", 42)])
def test_the_sound_part_of_a_shot_is_returned(
    spoil: Callable[[Images, int], None], share: float, words: str, surface: str, seed: int
) -> None:
    images, column_px = images_of(surface, seed)
    columns = round(share * CAMERA.width_px)
    spoil(images, columns)
    with pytest.warns(qf.DecodeWarning, match=words):
        shape = qf.decode(shot_of(images), plan_of())
    right = np.abs(shape.column_px - column_px) < 0.5 * 912 / NUMBERS[0]
    hold("part.right_percent", 100 * (shape.returned & right)[:, columns:].mean())
    hold("part.wrong_percent", 100 * (shape.returned & ~right).mean())
    hold("part.returned_of_rest_percent", 100 * shape.returned[:, : columns - 16].mean())
    if spoil is not saturated:
        assert shape.reason is not None
        hold("part.doubtful_percent", 100 * (shape.reason[:, : columns - 16] == Reason.DOUBTFUL_ORDER).mean())


@pytest.mark.parametrize(
    ("shift_px", "lower", "words"),
    [
        (6, False, "of the image that fit are returned"),
        (8, True, "of the image that fit are returned"),
        (12, False, "of the image that fit are returned"),
        (12, True, "of the image that fit are returned"),
        (24, True, "of the image that fit are returned"),
    ],
)
def test_half_of_a_frame_with_shifted_infrared_is_no_data(shift_px: int, lower: bool, words: str) -> None:
    """The median order margin of the whole does not collapse; half of the shape was wrong without a word."""
    images, column_px = images_of("face", 46)
    half = np.s_[CAMERA.height_px // 2 :, :] if lower else np.s_[:, CAMERA.width_px // 2 :]
    images["ir"][half] = np.roll(images["ir"], shift_px, axis=1)[half]
    with pytest.warns(qf.DecodeWarning, match=words):
        shape = qf.decode(shot_of(images), plan_of())
    right = np.abs(shape.column_px - column_px) < 0.5 * 912 / NUMBERS[0]
    hold("part.half_right_percent", 100 * (shape.returned & right).mean())
    hold("part.half_wrong_percent", 100 * (shape.returned & ~right).mean())


def test_a_part_whose_cause_is_named_has_no_second_warning() -> None:
    images, _ = images_of("face", 41)
    columns = round(0.75 * CAMERA.width_px)
    green = images["green"][:, :columns].copy()
    images["green"][:, :columns], images["ir"][:, :columns] = images["ir"][:, :columns], green
    with pytest.warns(qf.DecodeWarning, match="green and ir seem to be swapped") as caught:
        qf.decode(shot_of(images), plan_of())
    assert len(caught) == 1


@pytest.mark.parametrize("surface", ["face", "steps"])
def test_no_part_of_a_shot_with_exchanged_channels_is_trusted(surface: str) -> None:
    images, _ = images_of(surface, 43)
    for first, second in combinations(NAMES, 2):
        shot = shot_of(images | {first: images[second], second: images[first]})
        shape = KernelDecoder(shot.red.shape, 255.0, plan_of()).shape(shot)
        assert trusted_part(shape, shot, plan_of()) is None


@pytest.mark.parametrize("numbers", [(37.0, 36.0, 31.0), (38.0, 37.0, 32.0), (34.0, 33.0, 28.0), (49.0, 48.0, 42.0)])
def test_no_part_of_a_shot_of_other_fringe_numbers_is_trusted(numbers: tuple[float, ...]) -> None:
    images, _ = images_of("face", 44)
    shot = shot_of(images)
    shape = KernelDecoder(shot.red.shape, 255.0, plan_of(numbers)).shape(shot)
    assert trusted_part(shape, shot, plan_of(numbers)) is None


def test_fine_fringes_of_other_numbers_are_named_without_decoding_often(monkeypatch: pytest.MonkeyPatch) -> None:
    images, _ = images_of("face", 45, (100.0, 99.0, 90.0))
    closure = closure_of(shot_of(images), plan_of((100.0, 99.0, 90.0)))
    assert closure is not None
    hold("diagnosis.fine_ratio_off", [abs(closure.green - 1), abs(closure.infrared - 1)])
    decoded = []
    plain = KernelDecoder.shape

    def counted(decoder: KernelDecoder, shot: qf.Shot) -> qf.Shape:
        decoded.append(shot.red.size)
        return plain(decoder, shot)

    monkeypatch.setattr(KernelDecoder, "shape", counted)
    with pytest.raises(DecodeError, match="which fits 100, 99, 90"):
        qf.decode(shot_of(images), plan_of((64.0, 63.0, 56.0)))
    assert sum(decoded) < 3 * CAMERA.width_px * CAMERA.height_px


def test_the_fringe_numbers_that_fit_best_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    # With 81, 80, 72, which are tried first, the margin rises too, but less.
    monkeypatch.setattr(verdict_params, "CLEARLY_BETTER", 1.0)
    images, _ = images_of("face", 45, (100.0, 99.0, 90.0))
    with pytest.raises(DecodeError, match="which fits 100, 99, 90"):
        qf.decode(shot_of(images), plan_of((64.0, 63.0, 56.0)))


def test_what_contradicts_every_order_is_no_data_with_a_warning() -> None:
    # The left part is narrower than a fringe, and so is the step to the part behind.
    scene = isolated(110, 0.02, 13, surface="steps")
    with pytest.warns(qf.DecodeWarning, match="of the pixels with fringes, green and infrared contradict .* no data"):
        shape = scenes.shape_of(scene, response="linear")
    contradicted = shape.quality == 0
    share = np.count_nonzero(contradicted) / np.count_nonzero(np.isfinite(shape.quality))
    hold("part.contradicted_percent", 100 * share)
    assert not (contradicted & shape.returned).any()
