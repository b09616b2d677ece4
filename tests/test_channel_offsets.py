"""Shifted infrared and other fringe numbers are found though the orders look sure; sound shots are left alone."""

from __future__ import annotations

import re
import time
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import quadfringe as qf
from quadfringe import _core
from quadfringe.decoding import params
from quadfringe.decoding.channel_offsets import Offsets, _in_part, contradiction, offsets_of
from quadfringe.decoding.pair_drift import infrared_drift
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation import world
from quadfringe.evaluation._variants import stepped

NUMBERS = (36.0, 35.0, 30.0)
# Scenes with white and painted surfaces, folds, narrow objects and fringes of 9 px.
SOUND = ("plane", "face_patches_12", "painted_face", "cloth", "rods", "fringes_9px")


@cache
def calibration() -> qf.Calibration:
    with qf.open(qf.SystemConfig()) as scanner:
        assert scanner.calibration is not None
        return scanner.calibration


@cache
def face(share: float = 1.0, seed: int = 41) -> qf.Shot:
    """Give a shot of a face, 1 % noise, or of an ellipse of it that fills a share of the image."""
    bench, noise = _core.Bench(), np.random.default_rng(seed)
    images = bench.render(bench.cast("face"), NUMBERS, noise=0.0, bit_depth=16)
    rows, columns = np.indices((768, 1024), float)
    reach = np.sqrt(share * 768 * 1024 / np.pi)
    inside = (np.hypot(rows - 384, columns - 512) < reach) | (share == 1)
    light = [images[name] / 65535 * inside + 0.01 * noise.standard_normal(inside.shape) for name in images]
    return qf.Shot(*(np.round(255 * np.clip(one, 0, 1)).astype(np.uint8) for one in light))


def moved(shot: qf.Shot, columns: int) -> qf.Shot:
    assert shot.ir is not None
    return replace(shot, ir=np.roll(shot.ir, columns, axis=1))


SHIFTS = [*((1.0, columns) for columns in (-24, -8, -4, 6, 17)), *((0.1, columns) for columns in (-8, -4, 6))]


@pytest.mark.parametrize(("share", "columns"), SHIFTS)
def test_infrared_that_is_shifted_by_pixels_is_refused(share: float, columns: int) -> None:
    with pytest.raises(qf.DecodeError, match="infrared") as refused:
        qf.decode(moved(face(share), columns), qf.Plan(912, calibration=calibration()))
    assert refused.value.reason in ("infrared registration", "infrared projector")
    if abs(columns) < 20:  # half a fringe of infrared
        stated = re.search(r"a shift of ([-+\d.]+) px along x", str(refused.value))
        assert stated is not None
        assert abs(float(stated[1]) + columns) < 0.7


def test_a_small_shift_of_infrared_is_warned_of() -> None:
    with pytest.warns(qf.DecodeWarning, match=r"the infrared image does not lie on the visible one"):
        shape = qf.decode(moved(face(), 2), qf.Plan(912, calibration=calibration()))
    assert len(shape.warnings) == 1


@pytest.mark.parametrize("numbers", [(35, 34, 29), (37, 36, 31), (38, 37, 32)])
@pytest.mark.parametrize("share", [0.1, 1.0])
def test_numbers_with_the_same_differences_are_refused_by_name(numbers: tuple[float, ...], share: float) -> None:
    with pytest.raises(qf.DecodeError, match="which fits 36, 35, 30") as refused:
        qf.decode(face(share), qf.Plan(912, fringes=numbers, calibration=calibration()))
    assert refused.value.reason == "fringe numbers"


@pytest.mark.parametrize("scene", SOUND)
def test_a_sound_shot_has_no_contradiction(scene: str) -> None:
    taken = world.take(scene, 4)
    plan = qf.Plan(912, fringes=taken.fringe_numbers, calibration=calibration(), response="linear")
    shape = qf.Decoder(taken.shot, plan).decode_without_verdict(taken.shot)
    assert contradiction(shape, taken.shot, plan) is None
    closure = np.exp(1j * offsets_of(shape, taken.shot, plan).closure_rad(taken.fringe_numbers)).mean()
    print(scene, np.angle(closure), abs(closure))
    assert abs(np.angle(closure)) < 0.75 * params.CLOSURE_RAD


@pytest.mark.parametrize("step", [0, 4, 8])
@pytest.mark.parametrize("name", scenes.CAPTURES)
def test_a_real_shot_has_no_contradiction(name: str, step: int, data_dir: Path) -> None:
    scene = stepped(data_dir, name, step)
    shot = qf.Shot(scene.red, scene.green, scene.blue, scene.ir)
    plan = qf.Plan(scene.projector_width, fringes=scene.fringe_numbers, response="linear")
    shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    assert offsets_of(shape, shot, plan).turn_rad.size >= params.OFFSET_TILES_MIN
    assert contradiction(shape, shot, plan) is None


def test_saturated_light_is_named_before_shifted_infrared() -> None:
    shot = moved(face(), 6)
    bright = qf.Shot(*(np.minimum(1.7 * image, 255).astype(np.uint8) for image in shot.channels.values()))
    with pytest.warns(qf.DecodeWarning):
        shape = qf.decode(bright, qf.Plan(912, calibration=calibration(), response="linear"))
    light, infrared = shape.warnings
    assert light.startswith("too much light")
    assert "infrared" in infrared


def test_crosstalk_is_taken_for_neither() -> None:
    shot = face()
    red, green = (np.asarray(image, float) for image in (shot.red, shot.green))
    mixed = [np.round((a + 0.15 * b) / 1.15).astype(np.uint8) for a, b in ((red, green), (green, red))]
    crossed = replace(shot, red=mixed[0], green=mixed[1])
    plan = qf.Plan(912, calibration=calibration(), response="linear")
    shape = qf.Decoder(crossed, plan).decode_without_verdict(crossed)
    assert contradiction(shape, crossed, plan) is None
    drift = infrared_drift(crossed, shape, plan)
    assert drift is not None
    assert drift.off < 0.1


def test_a_small_mirrored_object_is_refused() -> None:
    shot = face(0.02)
    flipped = qf.Shot(*(np.ascontiguousarray(image[:, ::-1]) for image in shot.channels.values()))
    with pytest.raises(qf.DecodeError, match="mirrored left to right"):
        qf.decode(flipped, qf.Plan(912, calibration=calibration()))


def test_a_shape_without_data_has_no_offsets() -> None:
    shot = face(0.02)
    plan = qf.Plan(912)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        shape = qf.Decoder(shot, plan).decode_without_verdict(shot)
    shape.phase_rad[:] = np.nan
    assert offsets_of(shape, shot, plan).turn_rad.size == 0
    assert contradiction(shape, shot, plan) is None


def check_that_no_thread_goes_on() -> None:
    before = time.process_time()
    time.sleep(0.2)
    assert time.process_time() - before < 0.1


def test_no_thread_goes_on_after_a_decode() -> None:
    # After some products of matrices, threads of OpenBLAS wait for work in a loop, on the cores of the next decode.
    decoder = qf.Decoder(face(), qf.Plan(912, calibration=calibration(), decode=qf.DecodeConfig(method="published")))
    for _ in range(3):
        decoder.decode(face())
    check_that_no_thread_goes_on()


def test_no_thread_goes_on_after_a_shifted_part_is_found() -> None:
    place = np.indices((8, 10)).reshape(2, -1).T
    still, shifted = np.zeros(80), np.where(place[:, 0] < 3, 1.2, 0.0)
    turn = np.linspace(0, 2 * np.pi, 80)
    assert _in_part(Offsets(still, still, shifted, turn, place), qf.Plan(912)) is not None
    check_that_no_thread_goes_on()
