"""A shot that is darker than the black of the stated response is decoded with the response that it shows itself."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.config import ChannelResponse
from quadfringe.data import Calibration
from quadfringe.decoding import params
from quadfringe.decoding._kernel import KernelDecoder
from quadfringe.decoding.black import below_black, too_dark
from quadfringe.errors import DecodeWarning

CAMERA = qf.Device(width_px=512, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(255.5, 191.5))
# Black of the bench below: room light, which is the same share of the exposure at any exposure time.
AMBIENT, GAMMA, LESS = 0.08, 1.8, 0.2
MEASURED = ChannelResponse(offset=AMBIENT, exponent=1 / GAMMA)
RESPONSE = qf.Response(red=MEASURED, green=MEASURED, blue=MEASURED, ir=MEASURED)


@pytest.fixture(scope="module")
def bright() -> qf.Shot:
    scene = qf.SceneConfig(surface="face", projector_exponent=GAMMA, noise=0.004, seed=1)
    with qf.open(qf.SystemConfig(camera=CAMERA, scene=scene)) as scanner:
        shot = scanner.grab()
    assert isinstance(shot, qf.Shot)
    return changed(shot, lambda image: AMBIENT + 0.9 * image)


@pytest.fixture(scope="module")
def dim(bright: qf.Shot) -> qf.Shot:
    return changed(bright, lambda image: LESS * image)


def changed(shot: qf.Shot, change: Any) -> qf.Shot:
    images = {
        name: np.round(255 * np.clip(change(i / 255), 0, 1)).astype(np.uint8) for name, i in shot.channels.items()
    }
    return replace(shot, **images)


def plan(response: Any) -> qf.Plan:
    return qf.Plan(912, response=response)


def test_the_response_of_the_exposure_is_kept(bright: qf.Shot) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DecodeWarning)
        shape = qf.decode(bright, plan(RESPONSE))
    assert shape.config["response_from"] == "plan"
    assert below_black(bright, RESPONSE) < params.BELOW_SHARE / 5


def test_a_response_of_brighter_light_is_replaced(dim: qf.Shot, bright: qf.Shot) -> None:
    with pytest.warns(DecodeWarning, match="darker than the black of the response"):
        shape = qf.decode(dim, plan(RESPONSE))
    assert shape.config["response_from"] == "shots"
    assert "darker than the black" in shape.config["warnings"][0]
    expected = qf.decode(bright, plan(RESPONSE))
    both = expected.returned & shape.returned
    hold("black.returned", both.sum() / expected.returned.sum())
    error_rad = np.abs(shape.phase_rad - expected.phase_rad)[both]
    hold("black.right", np.mean(error_rad < np.pi))
    stated_rad = np.abs(KernelDecoder((384, 512), 255, plan(RESPONSE)).shape(dim).phase_rad - expected.phase_rad)
    hold("black.median_over_stated", np.median(error_rad) / np.nanmedian(stated_rad))


def test_every_shot_of_a_decoder_is_held_against_the_stated_response(dim: qf.Shot, bright: qf.Shot) -> None:
    decoder = qf.Decoder(bright, plan(RESPONSE))
    with pytest.warns(DecodeWarning):
        first = decoder.decode(dim)
    again = decoder.decode_without_verdict(dim)
    assert np.array_equal(first.phase_rad, again.phase_rad, equal_nan=True)
    assert decoder.decode(bright).config["response_from"] == "plan"
    assert decoder.response == RESPONSE


def test_a_response_without_black_is_never_contradicted(dim: qf.Shot) -> None:
    plain = ChannelResponse(exponent=1 / GAMMA)
    assert below_black(dim, "linear") == 0
    assert below_black(dim, qf.Response(red=plain)) == 0


def test_noise_is_no_contradiction() -> None:
    with qf.open(qf.SystemConfig(camera=CAMERA, scene=qf.SceneConfig(surface="steps", noise=0.03, seed=2))) as scanner:
        shot = scanner.grab()
    dark = ChannelResponse(offset=0.01, exponent=0.9)
    assert below_black(shot, qf.Response(red=dark, green=dark, blue=dark, ir=dark)) < params.BELOW_SHARE


@pytest.mark.parametrize("dark", [0.3, 0.5])
def test_a_dark_level_above_the_light_is_told(dark: float, bright: qf.Shot) -> None:
    device = qf.Device(width_px=912, height_px=384, focal_px=(1290.0, 1290.0), centre_px=(455.5, 191.5))
    devices = {"camera": CAMERA, "projector": device.model_copy(update={"translation_mm": (-250.0, 0.0, 0.0)})}
    words = "darker than the dark level of the calibration"
    for level, expected in ((AMBIENT, False), (dark, True)):
        known = Calibration(**devices, dark=(level,) * 4)
        cause = too_dark(bright, known)
        assert (cause is not None and words in cause.found) == expected
    assert too_dark(bright, Calibration(**devices)) is None


def test_a_shape_says_that_the_dark_level_is_wrong(small_bench: Path) -> None:
    """Most of the surface was missing without a word: dark fringes below the dark level have no phase."""
    known = Calibration.load(small_bench / "calibration.json").model_copy(update={"dark": (0.5,) * 4})
    level = r"% of the bright places .* darker than the dark level of the calibration"
    with pytest.warns(DecodeWarning, match=level):
        shape = qf.decode(qf.read_shot(small_bench), qf.Plan(912, calibration=known, response="linear"))
    assert "dark level" in shape.warnings[0]
    # The returned pixels have the right order, and the dark level is the only fault that is named.
    truth_px = np.load(small_bench / "truth.npz")["column_px"]
    off_px = np.abs(shape.column_px - truth_px)[shape.returned]
    hold("black.cut_right", np.mean(off_px < 0.5 * 912 / 36))
    assert len(shape.warnings) == 1
