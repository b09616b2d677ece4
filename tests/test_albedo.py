"""The albedo of a shot: the colours of the scene, without fringes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.bars import hold

import quadfringe as qf
from quadfringe.errors import ConfigError, InputError
from quadfringe.evaluation import world
from quadfringe.evaluation.albedo_truth import judge_albedo, true_albedo
from quadfringe.evaluation.world.scenes import Take
from quadfringe.io.export import srgb

SEED = world.REPORT[0]


def decoded(taken: Take, **settings: object) -> qf.Shape:
    plan = qf.Plan(912, fringes=qf.Fringes(numbers=taken.fringe_numbers), response="linear", decode=settings)
    return qf.Decoder(taken.shot, plan).decode_without_verdict(taken.shot)


@pytest.mark.parametrize(
    ("name", "bar"),
    [("face", "white"), ("face_patches_20", "patches"), ("peaks_patches_20", "patches"), ("painted_face", "print")],
)
def test_the_albedo_is_that_of_the_scene_without_fringes(name: str, bar: str) -> None:
    taken = world.take(name, SEED)
    shape = decoded(taken)
    assert shape.albedo is not None
    found = judge_albedo(shape.albedo, taken, true_albedo(name, SEED))
    hold(f"albedo.{bar}_rms_percent", found.rms_percent)
    hold("albedo.fringe_percent", found.fringe_percent)
    without = shape.returned & ~np.isfinite(shape.albedo[..., 0])
    hold("albedo.missing_percent", 100 * without.sum() / shape.returned.sum())
    assert not np.isfinite(shape.albedo[~shape.returned]).any()


def test_a_saturated_spot_has_the_albedo_around_it() -> None:
    taken = world.take("face", SEED)
    red = taken.shot.red.copy()
    red[400:403, 500:503] = 255
    plain, spotted = (decoded(replace(taken, shot=replace(taken.shot, red=image))) for image in (taken.shot.red, red))
    assert plain.albedo is not None
    assert spotted.albedo is not None
    spot = spotted.albedo[400:403, 500:503, 0]
    assert np.isfinite(spot).any()
    hold("albedo.saturated_percent", 100 * np.nanmax(abs(spot / np.nanmean(plain.albedo[400:403, 500:503, 0]) - 1)))


def test_the_albedo_changes_nothing_else_and_can_be_left_out() -> None:
    with qf.open() as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    plans = [qf.Plan(912, calibration=calibration, decode=decode) for decode in ({}, {"albedo": False})]
    with_albedo, without = (qf.decode(shot, plan) for plan in plans)
    assert without.albedo is None
    assert with_albedo.config["decode"]["albedo"] is True
    assert without.config["decode"]["albedo"] is False
    for name, values in without.maps.items():
        np.testing.assert_array_equal(values, with_albedo.maps[name])
    published = qf.decode(shot, qf.Plan(912, calibration=calibration, decode={"method": "published"}))
    assert published.albedo is None
    with pytest.raises(ConfigError, match='albedo needs method = "joint"'):
        qf.DecodeConfig(method="published", albedo=True)


def test_the_albedo_does_not_depend_on_the_threads() -> None:
    taken = world.take("painted_face", SEED)
    one, three = (decoded(taken, threads=threads).albedo for threads in (1, 3))
    assert one is not None
    assert three is not None
    np.testing.assert_array_equal(one, three)


def test_shapes_keep_their_albedo(tmp_path: Path) -> None:
    maps = [np.ones((2, 3), np.float32)] * 4
    albedo = np.full((2, 3, 4), 0.25, np.float32)
    albedo[0, 0] = np.nan
    shape = qf.Shape(*maps, albedo=albedo)
    shape.save(tmp_path / "a.npz")
    np.testing.assert_array_equal(qf.Shape.load(tmp_path / "a.npz").albedo, albedo)
    assert shape.colour[0, 1].tolist() == [255, 255, 255]
    assert shape.colour[0, 0].tolist() == [255, 255, 255]  # grey by its modulation
    with pytest.raises(InputError, match=r"albedo: expected an array \(H, W, 4\)"):
        qf.Shape(*maps, albedo=np.ones((2, 3, 3), np.float32))


def test_colours_are_coded_as_srgb() -> None:
    light = np.zeros((1, 200, 4), np.float32)
    light[0, :, :3] = np.linspace(0.0, 1.0, 200)[:, None]
    light[0, :, 1] *= 0.5
    picture = srgb(light)
    top = 0.99
    assert picture[0, -1].tolist() == [255, int(255 * (1.055 * (0.5 / top) ** (1 / 2.4) - 0.055) + 0.5), 255]
    assert picture[0, 0].tolist() == [0, 0, 0]
    assert srgb(np.full((1, 2, 4), np.nan, np.float32)).max() == 0
