"""The verdict refuses shots that cannot be trusted and names the likely cause; sound shots pass."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.decoding._kernel import KernelDecoder
from quadfringe.decoding.readings import band_of, rows_of
from quadfringe.decoding.verdict import order_margin
from quadfringe.decoding.verdict_params import NEAR
from quadfringe.errors import DecodeError

METHODS = ("joint", "published")
NAMES = ("red", "green", "blue", "ir")
Images = dict[str, np.ndarray[Any, Any]]


@pytest.fixture(scope="module")
def sound(small_bench: Any) -> qf.Shot:
    return qf.read_shot({name: small_bench / f"{name}.png" for name in NAMES})


def plan(method: str) -> qf.Plan:
    return qf.Plan(912, decode=qf.DecodeConfig.model_validate({"method": method}))


def changed(shot: qf.Shot, change: Callable[[Images], Images]) -> qf.Shot:
    images = change({name: image.copy() for name, image in shot.channels.items()})
    return qf.Shot(*(images[name] for name in NAMES), shot.full_scale)


def reason(shot: qf.Shot, method: str) -> str:
    with pytest.raises(DecodeError) as caught:
        qf.decode(shot, plan(method))
    return str(caught.value)


@pytest.mark.parametrize("method", METHODS)
def test_a_sound_shot_passes(sound: qf.Shot, method: str) -> None:
    shape = qf.decode(sound, plan(method))
    hold("demo.simulated_quality", np.nanmedian(shape.quality))
    hold("demo.simulated_returned", shape.returned.mean())


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pair", list(combinations(NAMES, 2)))
def test_exchanged_channels_are_named(sound: qf.Shot, pair: tuple[str, str], method: str) -> None:
    first, second = pair
    swapped = changed(sound, lambda i: {**i, first: i[second], second: i[first]})
    assert f"{first} and {second} seem to be swapped" in reason(swapped, method)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("channel", NAMES)
@pytest.mark.parametrize(("level", "word"), [(0, "black"), (255, "saturated")])
def test_a_blind_channel_is_named(sound: qf.Shot, channel: str, level: int, word: str, method: str) -> None:
    blind = changed(sound, lambda i: {**i, channel: np.full_like(i[channel], level)})
    assert f"channel {channel} is {word}" in reason(blind, method)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("level", [0, 255])
def test_no_light_and_too_much_are_told(sound: qf.Shot, level: int, method: str) -> None:
    flat = changed(sound, lambda i: {name: np.full_like(image, level) for name, image in i.items()})
    told = reason(flat, method)
    assert all(f"channel {name} is" in told for name in NAMES)


@pytest.mark.parametrize("method", METHODS)
def test_fringes_of_another_kind_are_suspected(sound: qf.Shot, method: str) -> None:
    same = changed(sound, lambda i: dict.fromkeys(NAMES, i["red"]))
    noise = np.random.default_rng(4)
    random = changed(sound, lambda i: {n: noise.integers(20, 230, m.shape, np.uint8) for n, m in i.items()})
    grey = changed(sound, lambda i: {name: np.full_like(image, 128) for name, image in i.items()})
    for shot in (same, random, grey):
        assert "no shape" in reason(shot, method)


def test_one_image_given_twice_is_refused(sound: qf.Shot) -> None:
    twice = changed(sound, lambda i: {**i, "blue": i["red"]})
    assert "every channel is given once" in reason(twice, "joint")


def test_other_fringe_numbers_are_suspected(sound: qf.Shot) -> None:
    with pytest.raises(DecodeError, match="fringe numbers"):
        qf.decode(sound, qf.Plan(912, fringes=qf.Fringes(numbers=(49.0, 48.0, 42.0))))


@pytest.mark.parametrize("method", METHODS)
def test_a_decoder_judges_later_shots_as_the_first(sound: qf.Shot, method: str) -> None:
    decoder = qf.Decoder(sound, plan(method))
    decoder.decode(sound)
    swapped = changed(sound, lambda i: {**i, "green": i["ir"], "ir": i["green"]})
    with pytest.raises(DecodeError, match="green and ir seem to be swapped"):
        decoder.decode(swapped)


def test_a_patch_of_glare_is_no_data_and_the_rest_stays(sound: qf.Shot) -> None:
    def glare(images: Images) -> Images:
        for image in images.values():
            image[100:200, 100:300] = 255
        return images

    with pytest.warns(qf.DecodeWarning, match="too much light"):
        shape = qf.decode(changed(sound, glare), plan("joint"))
    assert not shape.returned[100:200, 100:300].any()
    hold("demo.mixed_returned", shape.returned.mean())


def test_rows_of_an_image_have_the_calibration_of_the_whole() -> None:
    """The verdict decodes bands of rows; the camera and the infrared chip then have another origin."""
    chips = ((1.001, 0.002, 1.5), (-0.003, 0.998, -2.0))
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="face", infrared_from_visible=chips))) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    assert isinstance(shot, qf.Shot)
    first, rows = 192, np.s_[192:288]
    whole = KernelDecoder(shot.ir.shape, 255.0, qf.Plan(912, calibration=calibration, decode={"method": "published"}))
    part = whole.for_rows(first, 96)
    band = qf.Shot(*(image[rows] for image in shot.channels.values()))
    points_mm, expected_mm = part.shape(band).xyz_mm, whole.shape(shot).xyz_mm
    assert points_mm is not None
    assert expected_mm is not None
    assert np.nanmedian(np.abs(points_mm - expected_mm[rows])) < 5e-4
    assert part.plan.calibration is not None
    place = np.array((500.0, 250.0, 1.0))
    seen = np.array(part.plan.calibration.ir_registration) @ (place - (0, first, 0))
    np.testing.assert_allclose(seen, np.array(chips) @ place - (0, first), atol=1e-9)


BAND_SCENES: dict[str, dict[str, Any]] = {
    "face": {},
    "steps": {"surface": "steps"},
    "sphere": {"surface": "sphere"},
    "peaks without noise": {"surface": "peaks", "noise": 0.0},
    "coloured squares": {"patch_mm": 20.0},
    "small squares on steps": {"surface": "steps", "patch_mm": 12.0},
    "gamma 2.2": {"projector_exponent": 2.2},
    "room light": {"ambient": 0.3, "albedo": 0.5},
    "mosaic": {"bayer": "rggb"},
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("scene", BAND_SCENES)
def test_a_band_of_rows_keeps_enough_of_the_margin(scene: str, method: str) -> None:
    config = qf.SceneConfig.model_validate({"noise": 0.03} | BAND_SCENES[scene])
    with qf.open(qf.SystemConfig(scene=config)) as scanner:
        shot = scanner.grab()
    decoder = KernelDecoder(shot.ir.shape, None, plan(method))
    shape = decoder.shape(shot)
    first, count = band_of(shape)
    band = decoder.for_rows(first, count).shape(rows_of(shot, first, count))
    share = order_margin(band) / order_margin(shape)
    print(f"{scene}, {method}: the band has {share:.2f} of the margin")
    assert share >= NEAR[method]
