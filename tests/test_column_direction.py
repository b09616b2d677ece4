"""Images that are mirrored or turned are named without a calibration too, and upright ones are not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import quadfringe as qf
from quadfringe.evaluation import _scenes as scenes
from quadfringe.evaluation._variants import VARIANTS, stepped, turned

CAMERA = qf.Device(width_px=512, height_px=384, focal_px=(1290, 1290), centre_px=(255.5, 191.5))
Image = NDArray[np.generic]


@pytest.fixture(scope="module")
def upright() -> qf.Shot:
    with qf.open(qf.SystemConfig(camera=CAMERA, scene=qf.SceneConfig(surface="face", noise=0.02))) as scanner:
        return scanner.grab()


def decoded(shot: qf.Shot, image: Callable[[Image], Image], method: str = "joint") -> qf.Shape:
    changed = qf.Shot(*(np.ascontiguousarray(image(channel)) for channel in shot.channels.values()))
    return qf.decode(changed, qf.Plan(912, decode=qf.DecodeConfig(method=method)))


@pytest.mark.parametrize("method", ["joint", "published"])
def test_upright_images_have_no_warning(upright: qf.Shot, method: str) -> None:
    assert not decoded(upright, lambda image: image, method).warnings


@pytest.mark.parametrize("turns", [1, 3])
def test_images_turned_by_90_degrees_have_a_warning(upright: qf.Shot, turns: int) -> None:
    way = "up" if turns == 1 else "down"
    with pytest.warns(qf.DecodeWarning, match=f"turned by 90 degrees: .* grow {way} the images; turn the images"):
        shape = decoded(upright, lambda image: np.rot90(image, turns))
    assert len(shape.warnings) == 1


@pytest.mark.parametrize("image", [np.fliplr, lambda image: np.rot90(image, 2)])
def test_mirrored_images_and_those_turned_by_180_degrees_have_a_warning(
    upright: qf.Shot, image: Callable[[Image], Image]
) -> None:
    with pytest.warns(qf.DecodeWarning, match="mirrored, or turned by 180 degrees: .* right to left; switch off"):
        shape = decoded(upright, image)
    assert len(shape.warnings) == 1


def test_a_small_mirrored_object_has_a_warning(upright: qf.Shot) -> None:
    def cut_out(image: Image) -> Image:
        inside = np.zeros(image.shape, image.dtype)
        inside[160:220, 200:300] = 1  # 3 % of the frame
        return np.fliplr(image * inside)

    with pytest.warns(qf.DecodeWarning, match="mirrored"):
        decoded(upright, cut_out)


def test_a_calibration_decides_instead(upright: qf.Shot) -> None:
    with qf.open(qf.SystemConfig(camera=CAMERA)) as scanner:
        plan = qf.Plan(912, calibration=scanner.calibration)
    mirrored = qf.Shot(*(np.ascontiguousarray(np.fliplr(image)) for image in upright.channels.values()))
    with pytest.raises(qf.DecodeError, match="the calibration says"):
        qf.decode(mirrored, plan)


@pytest.mark.parametrize("name", scenes.CAPTURES)
def test_captures_are_upright_unless_they_are_turned(data_dir: Path, name: str) -> None:
    shot = stepped(data_dir, name, 2)
    for variant in ("as captured", "inclined"):
        assert not scenes.shape_of(VARIANTS[variant](shot, 2)).warnings
    with pytest.warns(qf.DecodeWarning, match="turned by 90 degrees"):
        scenes.shape_of(turned(shot, 2))
