"""The doctor names the cause and not what follows from it, and finds no fault with objects that are hard to fit."""

from __future__ import annotations

from typing import Any

import pytest

import quadfringe as qf
from quadfringe.doctor import Finding, examine_shot
from quadfringe.evaluation import broken


def exposed(scene: str, seed: int, *, half: bool = True, **options: Any) -> qf.Shot:
    return broken.exposed(scene, seed, broken.Fault("", options), half=half)


def findings(shot: qf.Shot) -> list[Finding]:
    with qf.open() as scanner:
        calibration = scanner.calibration
    assert calibration is not None
    if shot.first.shape == (broken.HALF.height_px, broken.HALF.width_px):
        calibration = calibration.model_copy(update={"camera": broken.HALF})
    return [one for one in examine_shot(shot, qf.Plan(912, calibration=calibration)) if one.grade != "good"]


def named(shot: qf.Shot) -> list[str]:
    """Give the names of warnings and faults, the likeliest first."""
    return [one.name for one in findings(shot) if one.grade in ("warning", "fault")]


# A narrow object


@pytest.mark.parametrize(("scene", "fill", "seed"), [("face", 0.04, 62), ("face", 0.12, 61), ("painted_face", 0.2, 62)])
def test_a_sound_narrow_object_has_no_fault(scene: str, fill: float, seed: int) -> None:
    """Across three fringes 36, 35 and 30 are nearly alike, so that the fit may take any for another."""
    found = findings(broken.cut_out(exposed(scene, 31, half=False), fill, seed))
    assert [one for one in found if one.grade == "fault"] == []
    (told,) = (one for one in found if one.name == "crosstalk")
    assert (told.grade, "cannot be measured" in told.found) == ("note", True)


@pytest.mark.parametrize(("pair", "words"), [((1, 3), "green sees 1"), ((0, 1), "red sees 1")])
def test_crosstalk_on_a_narrow_object_is_told(pair: tuple[int, int], words: str) -> None:
    first, *_ = findings(broken.cut_out(exposed("sphere", 31, half=False, **broken.stray({pair: 0.2})), 0.08, 61))
    assert (first.name, first.grade) == ("crosstalk", "fault")
    assert first.found.startswith(words)


def test_a_small_painted_object_is_not_called_dark() -> None:
    small = broken.cut_out(exposed("painted_face", 31, half=False), 0.02, 61)
    assert not any(name.startswith("brightness") for name in named(small))


# The projectors have not moved


@pytest.mark.parametrize("scene", ["photographs_peaks", "photographs_face", "photographs_steps"])
def test_print_that_differs_between_channels_is_no_moved_projector(scene: str) -> None:
    found = [one for one in findings(exposed(scene, 3)) if one.name in ("coaxial pair", "crosstalk", "response")]
    assert [one for one in found if one.grade == "fault" or one.found.startswith("infrared")] == []


@pytest.mark.parametrize(("scene", "pair"), [("clutter", (1, 2)), ("coin", (0, 1)), ("glossy_face", (0, 1))])
def test_crosstalk_is_no_moved_projector(scene: str, pair: tuple[int, int]) -> None:
    told = named(exposed(scene, 9, **broken.stray({pair: 0.25})))
    assert told[0] == "crosstalk"
    assert "coaxial pair" not in told


# Blur, crosstalk and the response


@pytest.mark.parametrize("scene", ["glossy_face", "glossy_sphere"])
def test_blur_is_named_in_spite_of_a_highlight(scene: str) -> None:
    assert named(exposed(scene, 11, half=False, blur_px=5.0))[0] == "blur"


@pytest.mark.parametrize("scene", ["coin", "plane"])
def test_crosstalk_of_one_channel_is_not_called_blur(scene: str) -> None:
    told = named(exposed(scene, 11, **broken.stray({(0, 1): 0.4})))
    assert told[0] == "crosstalk"
    assert "blur" not in told


@pytest.mark.parametrize(("scene", "exponent"), [("coin", 3.0), ("coin", 2.6), ("plane", 3.0)])
def test_a_strong_response_is_not_called_a_shift_of_infrared(scene: str, exponent: float) -> None:
    assert named(exposed(scene, 11, half=False, projector_exponent=(exponent,) * 4))[0] == "response"
