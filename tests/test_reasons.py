"""The map of reasons: what is missing has the cause that the scene gave it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.bars import hold

import quadfringe as qf
from quadfringe import Reason, _core
from quadfringe.evaluation import world

SEED = world.REPORT[0]
BLOCK = np.s_[300:420, 400:600]
INSIDE = np.s_[320:400, 420:580]  # away from the rim of the block


@pytest.fixture(scope="module")
def shot() -> qf.Shot:
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="plane", noise=0.02))) as scanner:
        return scanner.grab()


def decoded(shot: qf.Shot, **settings: object) -> qf.Shape:
    plan = qf.Plan(912, response="linear", decode=settings)
    return qf.Decoder(shot, plan).decode_without_verdict(shot)


def changed(shot: qf.Shot, block: dict[str, NDArray[np.uint8] | int]) -> qf.Shot:
    images = {name: getattr(shot, name).copy() for name in ("red", "green", "blue", "ir")}
    for name, values in block.items():
        images[name][BLOCK] = values
    return replace(shot, **images)


def share_inside(shape: qf.Shape, *reasons: Reason) -> float:
    assert shape.reason is not None
    return 100 * float(np.isin(shape.reason[INSIDE], reasons).mean())


def test_the_names_are_those_of_the_kernel() -> None:
    assert [reason.name for reason in Reason] == list(_core.REASONS)
    assert len({reason.words for reason in Reason}) == len(Reason)


@pytest.mark.parametrize("method", ["joint", "published"])
@pytest.mark.parametrize("name", ["steps", "painted_face"])
def test_a_pixel_has_either_data_or_a_reason(name: str, method: str) -> None:
    shape = decoded(world.take(name, SEED).shot, method=method)
    assert shape.reason is not None
    np.testing.assert_array_equal(shape.reason == Reason.RETURNED, shape.returned)
    assert sum(shape.reasons().values()) == pytest.approx(100)
    assert set(shape.reasons()) <= set(Reason)


def test_shadows_and_steps_of_the_bench_are_named() -> None:
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="steps", noise=0.02))) as scanner:
        shot = scanner.grab()
    assert shot.truth is not None
    shape = decoded(shot)
    shadow, edge = shot.truth.shadow & ~shape.returned, shot.truth.edge
    hold("reasons.shadow_named_percent", 100 * float((shape.reason[shadow] == Reason.SHADOW).mean()))
    apart = shape.reason == Reason.DISCONTINUITY
    near = sum(np.roll(edge, (down, right), (0, 1)) for down in range(-3, 4) for right in range(-3, 4)) > 0
    hold("reasons.discontinuity_at_edge_percent", 100 * float(near[apart].mean()))


def test_a_dark_block_is_too_dark(shot: qf.Shot) -> None:
    shape = decoded(changed(shot, dict.fromkeys(("red", "green", "blue", "ir"), 1)))
    hold("reasons.dark_percent", share_inside(shape, Reason.SHADOW))


def test_ambient_light_far_from_fringes_is_light_without_fringes(shot: qf.Shot) -> None:
    noise = np.random.default_rng(3)
    images = {name: getattr(shot, name).copy() for name in ("red", "green", "blue", "ir")}
    for image in images.values():
        image[:, :600] = noise.normal(120, 1.5, (image.shape[0], 600)).round()
    shape = decoded(replace(shot, **images))
    assert shape.reason is not None
    far = shape.reason[:, 50:500]
    hold("reasons.ambient_percent", 100 * float((far == Reason.LOW_MODULATION).mean()))


def test_a_saturated_block_is_named(shot: qf.Shot) -> None:
    shape = decoded(changed(shot, {"red": 255, "green": 255, "blue": 255}))
    hold("reasons.saturated_percent", share_inside(shape, Reason.SATURATED))


def test_channels_that_contradict_each_other_are_a_misfit(shot: qf.Shot) -> None:
    """In the block, the fringes of G and IR are displaced to opposite sides."""
    moved = {name: np.roll(getattr(shot, name), by, axis=1)[BLOCK] for name, by in (("green", 7), ("ir", -5))}
    shape = decoded(changed(shot, moved))
    assert shape.reason is not None
    named = np.isin(shape.reason[INSIDE], (Reason.MISFIT, Reason.DOUBTFUL_ORDER))
    missing = ~shape.returned[INSIDE]
    assert missing.any()
    hold("reasons.contradiction_percent", 100 * named[missing].mean())
    hold("reasons.contradiction_of_all_percent", 100 * named.mean())


def test_pixels_outside_the_infrared_image_are_not_seen(shot: qf.Shot) -> None:
    shift = qf.Calibration.model_validate(
        {"ir_registration": [[1.0, 0.0, 60.0], [0.0, 1.0, 0.0]]}
        | {name: camera_of()[name] for name in ("camera", "projector")}
    )
    shape = qf.Decoder(shot, qf.Plan(912, calibration=shift)).decode_without_verdict(shot)
    assert shape.reason is not None
    gap = shape.reason == Reason.NO_IMAGE
    assert gap[:, -55:].all() or gap[:, :55].all()
    assert not gap[:, 70:-70].any()


def camera_of() -> dict[str, object]:
    with qf.open() as scanner:
        assert scanner.calibration is not None
        return scanner.calibration.model_dump()


def test_depths_outside_the_stated_range_say_so() -> None:
    with qf.open(qf.SystemConfig(scene=qf.SceneConfig(surface="face"))) as scanner:
        shot, calibration = scanner.grab(), scanner.calibration
    whole = qf.decode(shot, qf.Plan(912, calibration=calibration))
    assert whole.depth_mm is not None
    near_mm = float(np.nanquantile(whole.depth_mm, 0.3))
    part = qf.decode(shot, qf.Plan(912, calibration=calibration, decode={"depth_range_mm": (near_mm, 3000.0)}))
    assert part.reason is not None
    np.testing.assert_array_equal(part.reason == Reason.OUT_OF_RANGE, whole.returned & ~part.returned)


def test_the_reference_names_saturation_and_darkness() -> None:
    rows, columns = np.mgrid[0:40, 0:300]
    noise, steps = np.random.default_rng(5), 2 * np.pi * np.arange(12)[:, None, None] / 12
    stacks = [
        (120 + 90 * np.cos(2 * np.pi * number * (columns + 0.1 * rows) / 300 + steps)).round().astype(np.uint8)
        for number in (9.0, 8.0, 6.0)
    ]
    for stack in stacks:
        stack[:, 10:20, 150:190] = 2
        stack[:, 25:35, 50:90] = 130
        stack[:] = np.clip(stack + noise.normal(0, 5, stack.shape).round(), 0, 255)
        stack[:, 10:20, 50:90] = 255
    shape = qf.decode_steps(stacks, (9.0, 8.0, 6.0), 300)
    assert shape.reason is not None
    np.testing.assert_array_equal(shape.reason == Reason.RETURNED, shape.returned)
    for place, reason in (
        (np.s_[10:20, 50:90], Reason.SATURATED),
        (np.s_[10:20, 150:190], Reason.SHADOW),
        (np.s_[25:35, 50:90], Reason.LOW_MODULATION),
    ):
        hold("reasons.reference_percent", 100 * (shape.reason[place] == reason).mean())


def test_files_keep_the_map_and_refuse_what_has_no_meaning(tmp_path: Path, shot: qf.Shot) -> None:
    shape = decoded(shot)
    shape.save(tmp_path / "shape.npz")
    back = qf.Shape.load(tmp_path / "shape.npz")
    assert back.reason is not None
    assert back.reason.dtype == np.uint8
    np.testing.assert_array_equal(back.reason, shape.reason)
    stored = dict(np.load(tmp_path / "shape.npz"))
    for wrong, words in (
        (stored["reason"] + 50, "expected 0 to 10"),
        (stored["reason"] * 1.0, "reason: expected uint8"),
    ):
        np.savez(tmp_path / "wrong.npz", **stored | {"reason": wrong})
        with pytest.raises(qf.InputError, match=words):
            qf.Shape.load(tmp_path / "wrong.npz")
    del stored["reason"]
    np.savez(tmp_path / "old.npz", **stored)
    old = qf.Shape.load(tmp_path / "old.npz")
    assert old.reason is None
    assert old.reasons() == {}
